"""Experiments: one file says all of a run; the run without ROS; what is told and what is concealed."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import rhythmid
from rhythmid.errors import InputError
from rhythmid.experiment import Delay, Experiment, Forcing, ramped
from rhythmid.offline_run import perform
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

PAPER = Path(rhythmid.__file__).parent / "models" / "paper_hopper.yaml"
MS = 1_000_000
TEXT = """\
model: hopper.yaml
excitation: {type: chirp, amplitude: 0.004, sweep: 2.0, repetitions: 1}
forcing: {amplitude: 1.0, frequency: 1.0, phase: 0.25}
delays: {input: 0.0403, measurement: 0.05}
noise: {measurement_std: 1.0e-5}
time: {mode: lockstep, rate: 1000, window: 50, layout: processes}
duration: 1.5
seed: 7
initial: {position: 0.15, velocity: 0.0}
safety: {max_effort: 5.0, ramp: 0.1, stale_after: 0.2, envelope: [0.0, 0.4]}
record: {path: bag, storage: sqlite3, topics: [excitation, joint_states]}
namespace: /lab/hopper
joint: knee
"""
SHORT = "model: hopper.yaml\nexcitation: {type: silence, length: 1.0}\n"


@pytest.fixture
def folder(tmp_path) -> Path:
    shutil.copy(PAPER, tmp_path / "hopper.yaml")
    return tmp_path


def load(folder: Path, text: str) -> Experiment:
    (folder / "run.yaml").write_text(text, encoding="utf-8")
    return Experiment.load(folder / "run.yaml")


def test_everything_in_the_file_arrives(folder):
    experiment = load(folder, TEXT)
    assert experiment.model_path == folder / "hopper.yaml"
    assert experiment.excitation.duration == 2.0
    assert experiment.forcing == Forcing(1.0, 1.0, 0.25)
    assert (experiment.input_delay, experiment.measurement_delay) == (Delay(0.0403), Delay(0.05))
    assert experiment.noise.measurement_std == 1e-5
    assert (experiment.time.mode, experiment.time.rate, experiment.time.window) == ("lockstep", 1000, 50)
    assert (experiment.count, experiment.seed, experiment.initial) == (1500, 7, (0.15, 0.0))
    assert experiment.safety.envelope == (0.0, 0.4)
    assert experiment.record.storage == "sqlite3"
    assert (experiment.namespace, experiment.joint) == ("/lab/hopper", "knee")


def test_a_short_file_gets_the_papers_forcing_no_delay_and_the_limit_cycle(folder):
    experiment = load(folder, SHORT)
    assert experiment.forcing == Forcing(1.0, 1.0, 0.0)
    assert experiment.forcing_assumed and experiment.description()["forcing_assumed"]
    assert experiment.input_delay == experiment.measurement_delay == Delay(0.0)
    assert experiment.initial is None
    assert (experiment.count, experiment.time.rate) == (1000, 1000)
    assert experiment.record.topics == ("excitation", "joint_states", "forcing", "run")
    assert experiment.namespace == "/hopper"


def test_forcing_and_delays_of_the_model_count_where_the_experiment_names_none(folder):
    model = PAPER.read_text(encoding="utf-8").replace("delay: {value: 0.0,", "delay: {value: 0.03,")
    model = model.replace("force:", "force:\n  - periodic_forcing: {amplitude: 0.5, frequency: 2.0}")
    (folder / "hopper.yaml").write_text(model, encoding="utf-8")
    silent = load(folder, SHORT)
    assert (silent.forcing, silent.input_delay, silent.measurement_delay) == (
        Forcing(0.5, 2.0, 0.0),
        Delay(0.03),
        Delay(0.03),
    )
    told = load(folder, SHORT + "forcing: {amplitude: 2.0}\ndelays: {input: 0.01}\n")
    assert (told.forcing, told.input_delay, told.measurement_delay) == (
        Forcing(2.0),
        Delay(0.01),
        Delay(0.03),
    )
    assert [term.label for term in told.plant_model.terms].count("periodic_forcing") == 1


def test_a_model_may_take_the_place_of_the_one_in_the_file(folder):
    (folder / "heavy.yaml").write_text(
        "inertia: {mass: 9}\ncommand: [{input_delay: {delay: 0.02}}]", encoding="utf-8"
    )
    (folder / "run.yaml").write_text(SHORT, encoding="utf-8")
    experiment = Experiment.load(folder / "run.yaml", model=folder / "heavy.yaml")
    assert experiment.model.value("inertia.mass") == 9.0
    assert experiment.input_delay == Delay(0.02)


def test_the_offline_run_is_what_the_graph_publishes(folder):
    experiment = load(folder, TEXT.replace("noise: {measurement_std: 1.0e-5}\n", ""))
    topics = perform(experiment)
    stamps = np.arange(1500) * MS
    time = stamps * 1e-9
    effort = 0.004 * np.sin(7 * np.pi * time**2 / 2) * np.clip(np.minimum(time, 1.5 - time) / 0.1, 0, 1)
    np.testing.assert_array_equal(topics["excitation"].stamp_ns, stamps)
    np.testing.assert_allclose(topics["excitation"].effort, effort, atol=1e-15)
    np.testing.assert_array_equal(topics["command"].stamp_ns, stamps + 40_300_000)
    np.testing.assert_array_equal(topics["command"].effort, topics["excitation"].effort)
    np.testing.assert_array_equal(topics["forcing"].stamp_ns, stamps)
    np.testing.assert_allclose(topics["forcing"].effort, np.cos(2 * np.pi * time + 0.25), atol=1e-14)
    np.testing.assert_array_equal(topics["joint_states"].stamp_ns, stamps + 50 * MS)
    for name in ("position", "velocity", "effort"):
        np.testing.assert_array_equal(
            getattr(topics["joint_states"], name), getattr(topics["plant/joint_states"], name)
        )
    model = experiment.plant_model.with_values({"input_delay.delay": 0.0403, "measurement_delay.delay": 0.05})
    command = zero_order_hold(topics["excitation"].stamp_ns * 1e-9, topics["excitation"].effort)
    seen = simulate(model, topics["joint_states"].stamp_ns * 1e-9, command, initial=(0.15, 0.0))
    np.testing.assert_allclose(topics["joint_states"].position, seen.output, atol=1e-13)


def test_the_same_seed_gives_the_same_run_and_noise_of_the_stated_size(folder):
    clean = perform(load(folder, TEXT.replace("1.0e-5", "0.0")))["joint_states"].position
    first, again, other = (
        perform(load(folder, TEXT.replace("seed: 7", f"seed: {seed}")))["joint_states"].position
        for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert np.std(first - clean) == pytest.approx(1e-5, rel=0.1)
    assert np.any(first != other)


def test_rounding_rounds_what_is_measured(folder):
    text = TEXT.replace("measurement_std: 1.0e-5", "quantisation: 1.0e-4")
    steps = perform(load(folder, text))["joint_states"].position / 1e-4
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert len(np.unique(np.rint(steps))) > 20


def test_ramp_and_clamp_bound_the_command(folder):
    experiment = load(
        folder, SHORT.replace("{type: silence, length: 1.0}", "{type: profile, points: [[0, 4]], length: 9}")
    )
    time = np.linspace(0, 9, 1000)
    safe = ramped(experiment.excitation, experiment.safety, time, 9.0)
    np.testing.assert_array_equal(safe[:-1], 4.0)
    gentle = load(folder, TEXT.replace("5.0, ramp: 0.1", "0.005, ramp: 1.0")).safety
    bounded = ramped(experiment.excitation, gentle, time, 9.0)
    np.testing.assert_allclose(
        bounded, np.clip(4 * np.clip(np.minimum(time, 9 - time), 0, 1), 0, 0.005), atol=1e-12
    )


@given(
    some.lists(some.integers(0, 50 * MS), min_size=1, max_size=50, unique=True).map(sorted),
    some.lists(some.floats(0, 0.1), min_size=2, max_size=8),
)
def test_nothing_overtakes_on_its_way_through_a_changing_delay(tmp_path_factory, stamps, delays):
    file = tmp_path_factory.mktemp("delay") / "profile.csv"
    file.write_text("".join(f"{0.01 * i},{delay!r}\n" for i, delay in enumerate(delays)), encoding="utf-8")
    stamp_ns = np.array(stamps, dtype=np.int64)
    released = Delay(profile=file).release(stamp_ns)
    due = stamp_ns + np.rint(1e9 * np.interp(stamp_ns * 1e-9, 0.01 * np.arange(len(delays)), delays)).astype(
        int
    )
    expected = []
    for each in due:
        expected.append(max(each, expected[-1] + 1) if expected else each)
    np.testing.assert_array_equal(released, expected)


def test_a_delay_profile_is_followed_between_its_points(folder):
    (folder / "late.csv").write_text("seconds,delay\n0.0,0.010\n1.0,0.030\n", encoding="utf-8")
    experiment = load(folder, SHORT + "delays: {input: {profile: late.csv}}\n")
    released = experiment.input_delay.release(np.array([0, 500 * MS, 2000 * MS]))
    np.testing.assert_array_equal(released, [10 * MS, 520 * MS, 2030 * MS])


def test_the_description_conceals_model_delays_and_noise(folder):
    text = json.dumps(load(folder, TEXT).description())
    for secret in ("0.0403", "0.05", "1e-05", "hopper.yaml", "stiffness", "delay", "noise", "seed"):
        assert secret not in text
    for told in ("chirp", "0.004", "/lab/hopper", "knee", '"rate": 1000'):
        assert told in text


def test_the_graph_has_five_nodes_and_only_the_plant_knows_the_model(folder):
    nodes = {node.name: node for node in load(folder, TEXT).nodes()}
    assert sorted(nodes) == ["command_delay", "excitation", "measurement_delay", "plant", "recorder"]
    assert nodes["command_delay"].parameters["delay"] == 0.0403
    assert nodes["measurement_delay"].parameters["delay"] == 0.05
    assert nodes["command_delay"].remappings == {"input": "excitation", "output": "command"}
    for name in set(nodes) - {"plant"}:
        assert "hopper.yaml" not in json.dumps(nodes[name].parameters, default=str)


@pytest.mark.parametrize(
    ("before", "after", "line", "words"),
    [
        ("model: hopper.yaml\n", "", 1, "'model:' is missing"),
        ("excitation: {type", "#", 1, "'excitation:' is missing"),
        ("hopper.yaml", "walker.yaml", 1, "model: no such file: "),
        ("excitation:", "exitation:", 2, "exitation: unknown key; did you mean 'excitation'?"),
        ("type: chirp", "type: chrip", 2, "'chrip'"),
        ("sweep: 2.0", "sweep: -2.0", 2, "excitation.sweep: -2.0 is too small; more than 0 is expected"),
        ("{type: chirp, amplitude: 0.004, sweep: 2.0, repetitions: 1}", "chirp", 2, "a mapping with a 'type'"),
        ("amplitude: 0.004", "amplitude: 6.0", 2, "its peak of 6 N exceeds safety.max_effort = 5 N"),
        ("amplitude: 1.0", "amplitude: .inf", 3, "forcing.amplitude: must be finite"),
        ("frequency: 1.0", "frequency: 0", 3, "forcing.frequency: 0 is too small; at least 1e-06"),
        ("phase: 0.25", "fase: 0.25", 3, "forcing.fase: unknown key; did you mean 'phase'?"),
        ("input: 0.0403", "input: -0.0403", 4, "delays.input: -0.0403 s is outside [0, 10]"),
        ("input: 0.0403", "input: 40.3", 4, "a delay is in seconds"),
        ("input: 0.0403", "input: .nan", 4, "delays.input: is not a number (NaN)"),
        ("input: 0.0403", "input: 40 ms", 4, "delays.input: a number is expected, not '40 ms'"),
        ("input: 0.0403", "input: {file: x.csv}", 4, "delays.input.file: unknown key"),
        ("input: 0.0403", "input: {}", 4, "delays.input: 'profile:' is missing"),
        ("1.0e-5", "-1.0e-5", 5, "noise.measurement_std: -1e-05 is too small; at least 0"),
        ("mode: lockstep", "mode: fast", 6, "time.mode: 'fast' is none of lockstep, realtime"),
        ("rate: 1000", "rate: 1000.5", 6, "time.rate: a whole number is expected"),
        ("rate: 1000", "rate: 0", 6, "time.rate: 0 is too small; at least 1"),
        ("window: 50", "window: 1000", 6, "time.window: 1000 is too large; at most 100"),
        ("layout: processes", "layout: threads", 6, "'threads' is none of composed, processes"),
        ("duration: 1.5", "duration: 0", 7, "duration: 0 is too small; at least 1e-06"),
        ("seed: 7", "seed: 7.5", 8, "seed: a whole number is expected"),
        ("{position: 0.15, velocity: 0.0}", "somewhere", 9, "initial: limit_cycle or {position"),
        ("position: 0.15", "x: 0.15", 9, "initial.x: unknown key; known: position, velocity"),
        ("[0.0, 0.4]", "[0.4, 0.0]", 10, "safety.envelope: [0.4, 0] is no range: two numbers [low, high]"),
        ("ramp: 0.1", "ramp: -0.1", 10, "safety.ramp: -0.1 is too small; at least 0"),
        ("sqlite3", "bag", 11, "record.storage: 'bag' is none of mcap, sqlite3"),
        ("excitation, joint_states]", "excitation, joint_state]", 11, "'joint_state' is none of excitation"),
        ("/lab/hopper", "lab", 12, "namespace: 'lab' is no namespace"),
        ("/lab/hopper", "/my hopper", 12, "namespace: '/my hopper' is no namespace"),
        ("joint: knee", "joint: 3", 13, "joint: text is expected, not 3"),
    ],
)  # fmt: skip
def test_a_wrong_experiment_is_refused_with_line_and_key(before, after, line, words, folder):
    assert before in TEXT
    with pytest.raises(InputError) as refused:
        load(folder, TEXT.replace(before, after, 1))
    message = str(refused.value)
    assert message.startswith(f"{folder / 'run.yaml'}:{line}: "), message
    assert words in message and "\n" not in message


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file"),
        ("0,-0.1\n", "a delay cannot be negative (-0.1 s)"),
        ("0,0.1\n0,0.2\n", ":2: the times must increase"),
        ("0,0.1\n1,abc\n", ":2: two finite numbers are expected: time [s], delay [s]"),
        ("0\n", ":1: two finite numbers are expected"),
    ],
)
def test_a_wrong_delay_profile_is_refused_with_its_line(content, words, folder):
    if content is not None:
        (folder / "late.csv").write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load(folder, SHORT + "delays: {measurement: {profile: late.csv}}\n")
    assert f"{folder / 'late.csv'}" in str(refused.value) and words in str(refused.value)


def test_a_fault_in_the_model_file_names_the_model_file(folder):
    (folder / "hopper.yaml").write_text("inertia: {mass: -1}", encoding="utf-8")
    with pytest.raises(InputError, match=r"hopper\.yaml:1: inertia\.mass: -1 kg is outside"):
        load(folder, SHORT)


def test_a_run_too_long_to_keep_is_refused(folder):
    with pytest.raises(InputError, match="1000000000 samples are too many"):
        perform(load(folder, SHORT + "duration: 1000000\n"))


PENDULUM = """\
units: {force: N*m, position: rad}
inertia: {mass: 0.5}
force:
  - linear_spring: {stiffness: 5.0, rest_length: 0.0}
  - viscous_damper: {damping: 0.3}
"""


def test_nothing_acts_that_is_not_stated_where_the_model_is_not_in_newtons_and_metres(folder):
    (folder / "hopper.yaml").write_text(PENDULUM, encoding="utf-8")
    experiment = load(folder, SHORT)
    assert experiment.forcing.amplitude == 0.0 and not experiment.notes
    sent = perform(experiment)
    assert not np.any(sent["forcing"].effort)
    assert np.ptp(sent["plant/joint_states"].position) < 1e-9


def test_units_that_are_stated_to_be_newtons_and_metres_change_nothing(folder):
    said = "units: {force: N, position: m}\n" + PAPER.read_text(encoding="utf-8").replace("unit: kg,", "")
    (folder / "hopper.yaml").write_text(said, encoding="utf-8")
    assert load(folder, SHORT).forcing == Forcing()


def test_an_assumed_forcing_is_told_in_one_line_and_a_stated_one_is_not(folder):
    experiment = load(folder, SHORT)
    (note,) = experiment.notes
    assert note.startswith(
        "no forcing is stated, so one of 1 N at 1 Hz acts; state it in the experiment, or write  forcing: {amplitude: 0}"
    )
    stated = load(folder, SHORT + "forcing: {amplitude: 0}\n")
    assert not stated.notes and not stated.description()["forcing_assumed"]


def test_an_assumed_forcing_is_not_said_to_act_on_a_machine_that_replaces_the_plant(folder):
    assert load(folder, SHORT).as_stated.description()["forcing"]["amplitude"] == 0.0
    stated = load(folder, SHORT + "forcing: {amplitude: 2.0}\n")
    assert stated.as_stated is stated
