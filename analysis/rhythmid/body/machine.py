"""A machine of several joints: a body, and along every joint the path of elements that a machine of one axis has.

    body: {mjcf: leg.xml, base: rail, step: 0.00025, contacts: true}     # or urdf:; base: fixed | free | a joint
    joints:
      knee:
        command:  [{input_delay: {delay: 0.0}}, {position_control: {proportional: 60, derivative: 0.8}}]
        actuator: [{actuator_lag: {time_constant: 0.002}}]
        force:    [{coulomb_friction: {force: 0.3, transition: 0.02}}]
      hip: {}

A joint's path is a `Model` whose inertia is the body's: the one that a force along the joint meets at the reference pose. Damping
and dry friction that the file gives a joint become the elements of that name, where the path has none. `free:` under `body:`
names inertial parameters that are estimated: `free: {shank.mass: {prior: {mean: 0.4, std: 0.04}}, shank.payload: {}, knee.armature: {}}`.
A payload sits at the end of its link, for which `ends: {shank: [0, 0, -0.2]}` may give another place [m] in the link's frame;
`centres: {shank: [0, 0, -0.1]}` gives a link's centre of mass.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml
from pydantic import ConfigDict, StrictBool, TypeAdapter
from pydantic import Field as Limits

from rhythmid.body.body import BODY, Array
from rhythmid.body.inertial_parameter import ARMATURE, PAYLOAD, TURNING, described, split
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.robot_file import FIXED, FREE
from rhythmid.document import Node, parse, read
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.elements.element import SLOTS, Element
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Model
from rhythmid.output import write_text
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units
from rhythmid.validation import Number, validated
from rhythmid.value import Value, entry_of, value_of

KINDS = ("mjcf", "urdf")
LONGEST_STEP = 0.01  # [s] of an integration: ten times what contacts bear
TRANSITION = (
    0.01  # [rad/s or m/s] over which the dry friction of a body's file turns, which MuJoCo holds for a jump
)


@dataclass(frozen=True)
class Machine:
    """A body and the paths of its joints.

    Attributes
    ----------
    body : with the parameters that `inertial` says.
    paths : by joint, in the order of the file; the inertia of each is borrowed from the body and fixed.
    inertial : inertial parameters that the file mentions, by "link.mass", "link.inertia", "link.payload" or "joint.armature".
    kind : "mjcf" or "urdf", what the body's file is.
    """

    body: MujocoBody
    paths: Mapping[str, Model]
    inertial: Mapping[str, Value] = field(default_factory=dict)
    kind: str = "mjcf"

    @classmethod
    def load(cls, path: str | Path, catalogue: Catalogue | None = None) -> "Machine":
        """The machine in a YAML file. Raises InputError naming line, parameter and unit of what is wrong."""
        known = load_catalogue() if catalogue is None else catalogue
        return _machine(read(path), Path(path).resolve().parent, known)

    @classmethod
    def from_text(cls, text: str, folder: Path, catalogue: Catalogue, path: str = "model.yaml") -> "Machine":
        """The machine in a YAML text that stands for the file `path` in a folder."""
        return _machine(parse(text, path), folder, catalogue)

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that have a path, in the file's order."""
        return tuple(self.paths)

    def controlled(self, joint: str) -> bool:
        """Whether a joint's command is a position reference for a controller in its path."""
        return any(term.element.name == "position_control" for term in self.paths[joint].terms)

    @cached_property
    def parameters(self) -> dict[str, Value]:
        """All parameters: "joint.element.parameter", and "body.link.mass", "body.link.inertia", "body.link.payload" and "body.joint.armature" of those
        that the file mentions."""
        found = {f"{BODY}.{name}": value for name, value in self.inertial.items()}
        for joint, model in self.paths.items():
            found |= {f"{joint}.{n}": v for n, v in model.parameters.items() if n != INERTIA}
        return found

    @property
    def free(self) -> list[str]:
        """Names of the parameters that are estimated."""
        return [name for name, value in self.parameters.items() if not value.fixed]

    def value(self, name: str) -> float:
        """Value of one parameter. Raises InputError for an unknown name."""
        if name not in self.parameters:
            raise InputError(f"the machine has no parameter {name!r}; it has {', '.join(self.parameters)}")
        return self.parameters[name].value

    def with_parameters(self, changes: Mapping[str, Value]) -> "Machine":
        """A copy with some parameters replaced. Raises InputError for an unknown name."""
        for name in changes:
            self.value(name)
        own = {name.partition(".")[2]: v for name, v in changes.items() if name.startswith(f"{BODY}.")}
        body = self.body.with_parameters({n: v.value for n, v in own.items()}) if own else self.body
        paths = {}
        for joint, model in self.paths.items():
            begin = f"{joint}."
            path = model.with_parameters(
                {name.removeprefix(begin): v for name, v in changes.items() if name.startswith(begin)}
            )
            paths[joint] = _with_inertia(path, body.effective_inertia(joint)) if own else path
        return replace(self, body=body, paths=paths, inertial={**self.inertial, **own})

    def with_values(self, values: Mapping[str, float]) -> "Machine":
        """A copy with some values replaced; bounds and priors stay. Raises InputError for an unknown name."""
        for name in values:
            self.value(name)
        return self.with_parameters(
            {n: replace(self.parameters[n], value=float(v)) for n, v in values.items()}
        )

    def with_path(self, joint: str, model: Model) -> "Machine":
        """A copy with another path along a joint."""
        return replace(self, paths={**self.paths, joint: model})

    def with_element(
        self, joint: str, element: Element, values: Mapping[str, float] | None = None, fixed: bool = False
    ) -> "Machine":
        """A copy with one more element along a joint."""
        return self.with_path(joint, self.paths[joint].with_element(element, values, fixed))

    def with_inertial(self, values: Mapping[str, float]) -> "Machine":
        """A copy with inertial parameters "link.mass", "link.inertia", "link.payload" or "joint.armature", which the file need not mention, of these values."""
        known = {name: self._inertial(name, value) for name, value in values.items()}
        mentioned = replace(self, inertial={**self.inertial, **known})
        return mentioned.with_values({f"{BODY}.{name}": value for name, value in values.items()})

    def with_payload(self, link: str, mass: float, place: Array) -> "Machine":
        """A copy whose link carries a point mass [kg] at a place (3,) [m] of its frame. Raises InputError for a link within a chain."""
        return replace(self, body=self.body.with_ends({link: place})).with_inertial(
            {f"{link}.{PAYLOAD}": mass}
        )

    def with_centre(self, link: str, place: Array) -> "Machine":
        """A copy whose link has its centre of mass at a place (3,) [m] of its frame. Raises InputError for a link that does not exist."""
        body = self.body.with_centres({link: place})
        paths = {
            joint: _with_inertia(path, body.effective_inertia(joint)) for joint, path in self.paths.items()
        }
        return replace(self, body=body, paths=paths)

    def _inertial(self, name: str, value: float) -> Value:
        parameter = described(name)
        units = _units(self.body, name)
        fixed = self.inertial[name].fixed if name in self.inertial else True
        return Value(value, units.of(parameter.unit), fixed, parameter.bounds)

    def _loaded(self) -> list[str]:
        """The links whose payload the file mentions."""
        return [owner for owner, kind in map(split, self.inertial) if kind == PAYLOAD]

    def to_yaml(self, beside: Path | None = None) -> str:
        """The machine as YAML text that `load` reads back from a file in the folder `beside`."""
        path = self.body.path if beside is None else Path(os.path.relpath(self.body.path, beside))
        body: dict[str, Any] = {self.kind: str(path), "base": self.body.base}
        body |= {"step": self.body.step, "contacts": self.body.contacts}
        if self.body.hold:
            body["hold"] = dict(self.body.hold)
        if ends := {link: self.body.ends[link].tolist() for link in self._loaded()}:
            body["ends"] = ends
        if centres := {link: np.asarray(place).tolist() for link, place in self.body.centres.items()}:
            body["centres"] = centres
        if self.inertial:
            body["free"] = {
                name: entry_of(value, described(name)) | {"fixed": value.fixed}
                for name, value in self.inertial.items()
            }
        content: dict[str, Any] = {"body": body, "joints": {}}
        for joint, model in self.paths.items():
            content["joints"][joint] = {
                slot: entries
                for slot, entries in yaml.safe_load(model.to_yaml()).items()
                if slot in SLOTS and entries
            }
        return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110)

    def save(self, path: str | Path) -> None:
        """Write the machine; nothing is left half-written. Raises InputError when the place is not writable."""
        write_text(Path(path), self.to_yaml(Path(path).resolve().parent))


def describes_machine(path: str | Path) -> bool:
    """Whether a model file describes a machine of several joints. Raises InputError where it cannot be read."""
    value = read(path).value
    return isinstance(value, dict) and BODY in value


def _with_inertia(model: Model, inertia: float) -> Model:
    return replace(model, mass=replace(model.mass, value=inertia))


def _units(body: MujocoBody, name: str) -> Units:
    """Units of a parameter "owner.kind", which belongs to a joint or to a link."""
    owner, kind = split(name)
    return ROTATIONAL if kind == ARMATURE and body.joints[owner].rotational else TRANSLATIONAL


def _machine(document: Node, folder: Path, catalogue: Catalogue) -> Machine:
    keys = document.mapping([BODY, "joints"])
    for name in (BODY, "joints"):
        if name not in keys:
            document.fail(f"'{name}:' is missing")
    body, kind = _body(keys[BODY], folder)
    given = keys["joints"].mapping()
    if not given:
        keys["joints"].fail("names no joint")
    for name, node in given.items():
        if name not in body.joints:
            node.fail(f"{body.path.name} has no such joint; it has {', '.join(body.joints)}")
        if name == body.base:
            node.fail("is the joint of the base, which nothing drives; leave it out here")
    body = body.with_losses(name for name in body.joints if name not in given)
    free = keys[BODY].mapping().get("free")
    inertial = {} if free is None else _free(free, body)
    # an inertia that is mentioned is one of its own, which a mass leaves as it is
    changed = {
        n: v.value for n, v in inertial.items() if v.value != body.parameters[n] or split(n)[1] == TURNING
    }
    body = body.with_parameters(changed) if changed else body
    order = sorted(given, key=lambda name: body.joints[name].velocity)
    paths = {name: _path(given[name], name, body, catalogue) for name in order}
    return Machine(body, paths, inertial, kind)


@dataclass(frozen=True)
class _Body:
    """A body as it is written."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    mjcf: str | None = None
    urdf: str | None = None
    base: str = FIXED
    step: Annotated[Number, Limits(ge=1e-7, le=LONGEST_STEP)] | None = None
    contacts: StrictBool = True
    hold: list[str] | dict[str, Number] | None = None
    free: dict[str, Any] | None = None
    ends: dict[str, tuple[Number, Number, Number]] | None = None
    centres: dict[str, tuple[Number, Number, Number]] | None = None


_BODY: TypeAdapter[_Body] = TypeAdapter(_Body)


def _body(node: Node, folder: Path) -> tuple[MujocoBody, str]:
    given = validated(node, _BODY)
    named = {kind: name for kind in KINDS if (name := getattr(given, kind)) is not None}
    if len(named) != 1:
        node.fail("name one file: mjcf: leg.xml, or urdf: leg.urdf")
    kind, name = next(iter(named.items()))
    try:
        hold = given.hold if isinstance(given.hold, dict) else dict.fromkeys(given.hold or (), 0.0)
        body = MujocoBody.load(folder / name, given.base, given.step, given.contacts, hold)
        ends, centres = (
            {link: np.array(place) for link, place in (one or {}).items()}
            for one in (given.ends, given.centres)
        )
        return body.with_centres(centres).with_ends(ends), kind
    except InputError as error:
        raise InputError(f"{node.at(kind).place}: {error}") from None


def _free(node: Node, body: MujocoBody) -> dict[str, Value]:
    found, known = {}, body.parameters
    for name, entry in node.mapping().items():
        if name not in known:
            entry.fail(f"{body.path.name} has no such parameter; it has {', '.join(known)}")
        said = {} if entry.value is None else entry.mapping()
        value = {"value": Node(known[name], entry.place, entry.path), **said}
        made = value_of(replace(entry, value=value), described(name), _units(body, name))
        found[name] = made
    return found


def _path(node: Node, joint: str, body: MujocoBody, catalogue: Catalogue) -> Model:
    """The path of one joint, with the file's damping and dry friction where it has none of its own."""
    sections = {} if node.value is None else node.mapping(SLOTS)
    units = ROTATIONAL if body.joints[joint].rotational else TRANSLATIONAL
    mass = {"value": body.effective_inertia(joint), "unit": units.mass, "fixed": True}
    inertia = {
        "mass": Node({k: Node(v, node.place, node.path) for k, v in mass.items()}, node.place, node.path)
    }
    model = Model.from_document(
        replace(node, value={"inertia": Node(inertia, node.place, node.path), **sections}), catalogue
    )
    names = {term.element.name for term in model.terms}
    said = body.passive[joint]
    if said.damping > 0.0 and "viscous_damper" not in names:
        model = model.with_element(catalogue["viscous_damper"], {"damping": said.damping})
    if (
        said.friction > 0.0
        and not {"coulomb_friction", *catalogue["coulomb_friction"].special_case_of} & names
    ):
        values = {"force": said.friction, "transition": TRANSITION}
        model = model.with_element(catalogue["coulomb_friction"], values)
    return model


__all__ = ["FIXED", "FREE", "Machine", "describes_machine"]
