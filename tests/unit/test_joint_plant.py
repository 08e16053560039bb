"""A machine of several joints fed command by command, and the experiments that are played on it."""

import functools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from legged import MODELS

from rhythmid.body.joint_experiment import JointExperiment, perform
from rhythmid.body.joint_hold import JointHold
from rhythmid.body.joint_plant import JointPlant
from rhythmid.body.machine import Machine
from rhythmid.errors import InputError

EXPERIMENT = """
duration: 0.3
rate: 1000
namespace: /leg
start: {rail: 0.45}
orthogonal: true
seed: 5
excitation:
  hip:  {offset: 0.6, limits: [0.4, 0.7], type: multisine, rms: 0.2, period: 1.0, periods: 1, band: [0.5, 6.0], select: all, seed: 1}
  knee: {offset: -1.2, type: multisine, rms: 0.3, period: 1.0, periods: 1, band: [0.5, 6.0], select: all, seed: 2}
"""


@functools.cache
def leg() -> Machine:
    """A leg that touches the floor, whose knee hears its commands late and whose hip is measured late, neither by whole steps."""
    from rhythmid.elements.catalogue import load_catalogue

    known = load_catalogue()
    machine = Machine.load(MODELS / "leg.yaml").with_values({"knee.input_delay.delay": 0.0031})
    machine = machine.with_element("hip", known["measurement_delay"], {"delay": 0.0033})
    return machine.with_element("hip", known["measurement_noise"], {"std": 0.001})


def experiment(folder: Path, text: str = EXPERIMENT) -> JointExperiment:
    (folder / "experiment.yaml").write_text(text)
    return JointExperiment.load(folder / "experiment.yaml")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory):
    """An experiment and what its run tells."""
    made = experiment(tmp_path_factory.mktemp("whole"))
    return made, perform(leg(), made)


@settings(max_examples=10, deadline=None)
@given(sizes=st.lists(st.integers(1, 60), min_size=1, max_size=12))
def test_a_run_does_not_depend_on_the_chunks_in_which_its_commands_come(whole, sizes: list[int]):
    made, run = whole
    asked, plant = made.asked(leg()), made.plant(leg())
    first, parts = 0, []
    for size in [*sizes, len(asked)]:
        chosen = slice(first, first + size)
        if len(run.stamp_ns[chosen]):
            plant.push_many(run.stamp_ns[chosen], asked[chosen])
            parts.append(plant.states(int(run.stamp_ns[chosen][-1]))[1])
        first += size
    for name, expected in run.topics["/leg/joint_states"][1].items():
        np.testing.assert_array_equal(np.vstack([part[name] for part in parts]), expected)


def test_commands_keep_to_their_joints_limits_and_orthogonal_multisines_share_the_lines_out(whole):
    made, run = whole
    hip = run.topics["/leg/command"][1]["position"][:, 0]
    assert hip.min() == 0.4 and hip.max() <= 0.7
    signals = [made.excitation[joint].excitation for joint in ("hip", "knee")]
    time = np.arange(1000) * 1e-3
    first, second = (one(time) for one in signals)
    assert abs(first @ second) < 1e-9 * np.linalg.norm(first) * np.linalg.norm(second)
    assert sorted([*signals[0].harmonics, *signals[1].harmonics]) == [1, 2, 3, 4, 5, 6]


def test_an_effort_is_the_mean_over_the_sample_period_before_it(tmp_path: Path):
    made = experiment(tmp_path, EXPERIMENT.replace("rate: 1000", "rate: 500"))
    machine = Machine.load(MODELS / "leg.yaml")
    asked = made.asked(machine)
    stamps = np.arange(made.count, dtype=np.int64) * made.period_ns
    efforts = []
    for period in (made.period_ns, round(machine.body.step * 1e9)):
        plant = JointPlant(machine, period, start={"rail": 0.45, "hip": asked[0, 0], "knee": asked[0, 1]})
        plant.push_many(stamps, asked)
        efforts.append(plant.states(int(stamps[-1]))[1]["effort"][:, :2])
    coarse, fine = efforts  # of a period of one step the mean is that step's
    expected = fine[1:].reshape(-1, 4, 2).mean(axis=1)
    np.testing.assert_allclose(coarse[1:], expected, rtol=1e-9, atol=1e-9)


def test_references_that_nobody_renews_are_held_and_forces_fade():
    hold = JointHold(0.01, 0.002, 1_000_000, np.array([False, True]))
    hold.renew(0, np.array([0.5, 2.0]))
    steps = hold.until(30_000_000)
    assert hold.lapses == 1
    np.testing.assert_array_equal(steps[-1][1], [0.5, 0.0])
    stamps = np.array([31_000_000, 32_000_000])
    _, filled = hold.fill(stamps, np.array([[0.1, 1.0], [0.2, 1.0]]))
    np.testing.assert_array_equal(filled, [[0.1, 1.0], [0.2, 1.0]])


def test_what_a_plant_cannot_do_is_told():
    with pytest.raises(InputError, match="no whole number of the body's steps"):
        JointPlant(leg(), 3_333_333)
    plant = JointPlant(leg(), 1_000_000)
    plant.push(5, plant.held)
    with pytest.raises(InputError, match="order of their stamps"):
        plant.push(5, plant.held)
    with pytest.raises(InputError, match="not a finite number"):
        plant.push(6, np.array([np.nan, 0.0]))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("duration: 0.3", "duration: 0.3\nmodel: none.yaml", "no such file"),
        ("rate: 1000", "rate: 1000\ntime: {mode: fast}", "time"),
        ("rate: 1000", "rate: 1000\nsafety: {joints: {hip: {speed: 3}}}", "speed"),
        ("namespace: /leg", "namespace: my leg", "namespace"),
    ],
)
def test_what_is_wrong_in_an_experiment_is_told_with_its_line(tmp_path: Path, old: str, new: str, said: str):
    with pytest.raises(InputError, match=rf"experiment.yaml:\d+: .*{said}"):
        experiment(tmp_path, EXPERIMENT.replace(old, new))
