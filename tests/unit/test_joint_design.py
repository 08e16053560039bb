"""References designed for a machine of several joints, and the standard deviations that are predicted of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from legged import MODELS, fixed_leg
from typer.testing import CliRunner

from rhythmid.body.joint_experiment import JointExperiment
from rhythmid.body.machine import Machine
from rhythmid.cli import app
from rhythmid.design.joint_design import JointRequirements, design_joints, rehearsed
from rhythmid.errors import InputError
from rhythmid.identify.joints.base_parameters import NAMES, BaseParameter
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.record.joint_record import JointRecord, JointSignals

NOISE = 0.2  # [N m]
WANTED = JointRequirements(duration=6.0, band=(0.3, 5.0), max_effort=25.0, noise_std=NOISE, rate=500)


def noisy(record: JointRecord, rng: np.random.Generator) -> JointRecord:
    """The record with white noise on the forces."""
    joints = {}
    for name, one in record.joints.items():
        assert one.effort is not None
        value = one.effort.value + NOISE * rng.normal(size=len(one.effort.value))
        joints[name] = replace(one, effort=replace(one.effort, value=value))
    return replace(record, joints=joints)


def true_base(machine: Machine, one: BaseParameter) -> float:
    """A combination of inertial parameters as the machine has it."""
    known = {
        f"{link}.{name}": value
        for link in machine.body.links
        for name, value in zip(NAMES, machine.body.inertial(link), strict=True)
    }
    return known[one.name] + sum(factor * known[name] for name, factor in one.beside.items())


def test_estimates_scatter_about_the_true_values_as_was_predicted_and_forces_keep_to_the_limit(
    tmp_path: Path,
):
    machine = Machine.load(fixed_leg(tmp_path))
    found = design_joints(machine, WANTED)
    record, peak = rehearsed(machine, found.experiment)
    assert record is not None and max(peak.values()) <= 25.0
    names = ("hip.viscous_damper.damping", "knee.viscous_damper.damping")
    base = {one.name: one for one in found.inertia.base}
    assert found.inertia.rank == 5
    scores = []
    rng = np.random.default_rng(1)
    for _ in range(4):
        made = identify_machine([noisy(record, rng)], machine, free=False)
        for name in names:
            error = made.parameters[name].value - machine.value(name)
            scores.append(error / found.parameters[name].std)
        assert made.inertia is not None
        for one in made.inertia.base:
            if one.name in base:
                scores.append((one.value - true_base(machine, one)) / base[one.name].std)
    assert len(scores) >= 20 and 0.5 < np.sqrt(np.mean(np.square(scores))) < 2.0


def test_a_design_is_written_as_an_experiment_that_can_be_played_and_signals_for_its_bag(tmp_path: Path):
    model = fixed_leg(tmp_path)
    arguments = ["--duration", "4", "--band", "0.5", "5", "--max-effort", "25", "--noise-std", "0.1"]
    plan = tmp_path / "plan"
    done = CliRunner().invoke(app, ["design", str(model), *arguments, "--rate", "500", "--output", str(plan)])
    assert done.exit_code == 0, done.output
    made = JointExperiment.load(plan / "experiment.yaml")
    assert made.model is not None and made.model.resolve() == model.resolve()
    machine = Machine.load(model)
    asked = made.asked(machine)
    assert asked[:, 1].min() > -2.6 and asked[:, 1].max() < -0.2
    hip, knee = (asked - asked.mean(axis=0)).T
    assert abs(hip @ knee) < 1e-3 * np.linalg.norm(hip) * np.linalg.norm(knee)
    assert JointSignals.load(plan / "signals.yaml").taken == "after_actuator"
    assert "predicted standard deviations" in done.output
    yaml.safe_load((plan / "experiment.yaml").read_text())


@pytest.mark.parametrize(
    "option",
    [
        ["--kind", "comb"],
        ["--harmonics", "5"],
        ["--longest-delay", "0.1"],
        ["--spacing", "0"],
        ["--forcing", "1", "1"],
    ],
)
def test_an_option_for_one_axis_alone_is_refused(tmp_path: Path, option: list[str]):
    model = fixed_leg(tmp_path)
    limits = ["--duration", "4", "--band", "0.5", "5", "--max-effort", "25", "--noise-std", "0.1"]
    done = CliRunner().invoke(
        app, ["design", str(model), *limits, *option, "--output", str(tmp_path / "plan")]
    )
    assert isinstance(done.exception, InputError) and option[0] in str(done.exception)
    assert not (tmp_path / "plan").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"max_effort": 0.01}, "stays at"),
        ({"band": (0.31, 0.33)}, "no line of the multisine"),
    ],
)
def test_what_cannot_be_designed_is_told(tmp_path: Path, change: dict, said: str):
    with pytest.raises(InputError, match=said):
        design_joints(Machine.load(fixed_leg(tmp_path)), replace(WANTED, duration=2.0, **change))


def test_a_joint_without_a_controller_or_a_range_is_refused():
    with pytest.raises(InputError, match="has no position_control"):
        design_joints(Machine.load(MODELS / "hopper.yaml"), WANTED)
    arm = Machine.load(MODELS / "arm.yaml")
    free = replace(arm, body=arm.body.with_parameters({}))
    free.body.model.jnt_limited[:] = 0
    with pytest.raises(InputError, match="has no range"):
        design_joints(free, WANTED)
