"""Embeds the paths of a machine's joints in its MJCF file, as a custom text that MuJoCo keeps."""

from collections.abc import Mapping
from typing import Any

import yaml

from rhythmid.body.robot_file import mujoco
from rhythmid.document import as_node
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model

NAME = "rhythmid"  # name of the text in the file
ABSENT = (
    "the model holds no paths of joints: apply needs a file that  rhythmid export MACHINE.yaml --to mujoco --out FILE.xml  wrote of a machine "
    "with `joints:`; that of a one-axis model runs without apply, and its comments tell what MJCF cannot express"
)


def text_of(paths: Mapping[str, Model]) -> str:
    """Paths as one line of text; `paths_in` is the inverse."""
    plain = {joint: yaml.safe_load(model.to_yaml()) for joint, model in paths.items()}
    return yaml.safe_dump(plain, default_flow_style=True, sort_keys=False, width=10**9).strip()


def paths_in(model: Any, elements: tuple[str, ...] = ()) -> dict[str, Model]:
    """The paths in the file of a compiled model. Raises InputError where it holds none, or names an unknown element."""
    number = mujoco().mj_name2id(model, mujoco().mjtObj.mjOBJ_TEXT, NAME)
    if number < 0:
        raise InputError(ABSENT)
    begin = int(model.text_adr[number])
    held = bytes(model.text_data)[begin : begin + int(model.text_size[number]) - 1]
    catalogue = load_catalogue(elements)
    plain = yaml.safe_load(held.decode())
    return {joint: Model.from_document(as_node(one, NAME, joint), catalogue) for joint, one in plain.items()}
