"""A model file in one line, and whether records fit it, for `rhythmid check --model`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Model
from rhythmid.report.quantity import with_written_unit

if TYPE_CHECKING:
    from rhythmid.record.joint_record import JointRecord
    from rhythmid.record.record import Record


def model_lines(
    path: Path,
    records: Sequence["Record"],
    elements: Sequence[Path] = (),
    joints: Sequence["JointRecord"] = (),
) -> list[str]:
    """What a model is, in one line, and notes: on each unit of the records that is not the model's, on an effort of the opposite
    sign, and on the share of the records in which the machine rests, where their effort would be scored. `joints` are the records of a machine of several joints.

    Raises InputError as a diagnosis would, where the model is wrong or the records do not fit it.
    """
    from rhythmid.commands.machines import is_machine
    from rhythmid.diagnose.admission import admitted
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.start.balanced import sign_note

    catalogue = load_catalogue(elements)
    if is_machine(path):
        from rhythmid.body.machine import Machine
        from rhythmid.identify.joints.joint_plausibility import check_joints
        from rhythmid.record.cleaning import cleaned_joints

        machine = Machine.load(path, catalogue)
        check_joints(machine, cleaned_joints(joints, machine.turning)[0])
        paths = "; ".join(f"{joint}: {_elements(model)}" for joint, model in machine.paths.items())
        return [f"{path}: {len(machine.joints)} joints; {paths}; {_free(machine.free)}"]
    model = Model.load(path, catalogue)
    units, whole = model.units, admitted(records, [], model).whole_records if records else []
    rests, sign = _rests(whole, model), sign_note(whole, units)
    mass = model.parameters[INERTIA]
    told = f"inertia {with_written_unit(f'{mass.value:g}', mass.unit)}{' (fixed)' if mass.fixed else ''}; {_elements(model)}; {_free(model.free)}"
    return [
        f"{path}: {told}; units {units.force}, {units.position}, {units.mass}",
        *(f"  note: {note}" for one in records for note in _foreign_units(one, model)),
        *(f"  note: {note}" for note in (sign,) if note is not None),
        *(f"  note: were the effort scored: {note}" for note in (rests,) if note is not None),
    ]


def _rests(records: Sequence["Record"], model: Model) -> str | None:
    """A note that the machine rests during a share of these records, if they contain an effort and the share is of practical size."""
    from rhythmid.identify.inverse_dynamics.balance import Balance
    from rhythmid.identify.inverse_dynamics.rests import told

    try:
        return told(Balance.of(records, model).stuck)
    except InputError:  # no effort, or too little motion for one
        return None


def _elements(model: Model) -> str:
    return ", ".join(term.label for term in model.terms) or "no elements"


def _free(names: Sequence[str]) -> str:
    listed = f" ({', '.join(names)})" if names else ""
    return f"{len(names)} free parameter{'' if len(names) == 1 else 's'}{listed}"


def _foreign_units(record: "Record", model: Model) -> list[str]:
    """Notes on channels whose unit is not that of the model."""
    expected = {"output": (record.output, model.units.position)} if record.output_kind == "position" else {}
    if record.input is not None and record.input_kind == "force":
        expected["input"] = (record.input, model.units.force)
    if record.effort is not None:
        expected["effort"] = (record.effort, model.units.force)
    return [
        f"{record.name}: the {role} is in {channel.unit} by signals.yaml, in {unit} by the model"
        for role, (channel, unit) in expected.items()
        if model.units.of(channel.unit) != unit and channel.unit != unit
    ]
