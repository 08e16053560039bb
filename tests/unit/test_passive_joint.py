"""A joint without a motor has an effort of zero, which tells as much as any other effort."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from legged import TWO_LINKS, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.effort.candidate import NO_MOTOR, starts_of
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.diagnose.joints.joint_case import diagnose_joint, joint_catalogue
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import size_of
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.start.robot import start_robot

DRIVEN = "{command: [{position_control: {proportional: {value: 80, fixed: true}, derivative: {value: 2.0, fixed: true}}}]}"
NOTHING = "command: [{position_control: {proportional: 0.0, derivative: 0.0}}]"
SWINGING = f"{{{NOTHING}, force: [{{viscous_damper: {{damping: 0.01}}}}, {{coulomb_friction: {{force: 0.4, transition: 0.05}}}}]}}"
WITHOUT = "{force: [{viscous_damper: {damping: 0.01}}]}"


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> JointBalances:
    """Two links of which only the lower one is driven; the upper one has a dry friction that the model lacks."""
    folder = tmp_path_factory.mktemp("swing")
    (folder / "two.urdf").write_text(TWO_LINKS)

    def made(upper: str) -> Machine:
        (folder / "two.yaml").write_text(
            f"body: {{urdf: two.urdf, contacts: false}}\njoints:\n  one: {upper}\n  two: {DRIVEN}\n"
        )
        return Machine.load(folder / "two.yaml")

    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(3)
    asked = references({"one": (0.0, 0.0), "two": (0.0, 1.0)}, time, rng, (0.5, 1.2))
    record = recorded(made(SWINGING), asked, time, rng)
    one = record.joints["one"]
    assert one.effort is not None
    still = replace(one.effort, value=np.zeros_like(one.effort.value))
    joints = {**record.joints, "one": replace(one, effort=still)}
    return JointBalances.of(made(WITHOUT), [replace(record, joints=joints)])


def test_a_joint_without_a_motor_has_no_candidate_that_makes_its_effort_vanish(found: JointBalances):
    balance, model = found.balance("one"), found.models["one"]
    assert balance.undriven and not found.balance("two").undriven
    starts = starts_of(joint_catalogue(load_catalogue()), model, scales_of(balance, model), balance)
    slots = {one.element.slot for one in starts if one.element}
    assert "force" in slots and "actuator" not in slots
    assert all(one.kind != "delay" for one in starts)
    # forces that only balance one another tell no size: freed masses could make all of them vanish
    assert not [one.name for one in starts if one.name in balance.motions[0].links]


def test_the_size_of_an_effort_of_zero_is_that_of_what_the_rest_of_the_body_requires(found: JointBalances):
    balance = found.balance("one")
    rest = balance.rows([one.coupling for one in balance.motions if one.coupling is not None])
    assert size_of(balance) == pytest.approx(np.sqrt(np.mean(rest**2)))


def test_the_friction_of_a_joint_without_a_motor_is_found(found: JointBalances):
    known = load_catalogue()
    few = Catalogue({name: known[name] for name in ("coulomb_friction", "actuator_gain", "actuator_fade")})
    one = diagnose_joint(found, None, "one", few, lambda _: None, Budget())
    assert one.result.decision.named[0] == "coulomb_friction"
    assert one.result.chosen.model.value("coulomb_friction.force") == pytest.approx(0.4, abs=0.05)
    assert one.result.search.not_tried["actuator_gain"] == NO_MOTOR


def table(folder: Path, hook: float) -> Path:
    """A table of both joints whose effort of the upper one is always this."""
    time = np.arange(0.0, 4.0, 0.01)
    columns = [time, np.sin(3.0 * time), np.cos(2.0 * time), np.full(len(time), hook), np.sin(2.0 * time)]
    path = folder / "run.csv"
    heading = "time,one_pos,two_pos,one_tau,two_tau"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=heading, comments="")
    return path


def test_init_takes_an_effort_that_is_always_zero_at_one_joint(tmp_path: Path):
    (tmp_path / "two.urdf").write_text(TWO_LINKS)
    found = start_robot([table(tmp_path, 0.0)], tmp_path / "two.urdf", tmp_path, None, load_catalogue())
    assert 'effort: {column: "*_tau"' in found.signals
    (said,) = [line for line in found.lines() if "one" in line and "always 0" in line]
    assert (
        said
        == "CHECK effort: that of one is always 0, as where no motor acts; where one acts whose effort was not recorded, nothing that is said of these joints holds"
    )


def test_init_refuses_positions_alone(tmp_path: Path):
    (tmp_path / "two.urdf").write_text(TWO_LINKS)
    time = np.arange(0.0, 4.0, 0.01)
    path = tmp_path / "run.csv"
    np.savetxt(path, np.column_stack([time, np.sin(time), np.cos(time)]), delimiter=",", header="time,one_pos,two_pos", comments="")  # fmt: skip
    with pytest.raises(InputError, match="neither efforts nor references of one, two"):
        start_robot([path], tmp_path / "two.urdf", tmp_path, None, load_catalogue())
