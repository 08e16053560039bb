"""Bad input to every command, called as users call it: one line that says what is wrong, exit code 2, nothing written."""

import math
import shutil
from collections.abc import Iterable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from refusals import EXPERIMENT, needs_run

from rhythmid.record.bag_writer import add_topic, new_bag
from rhythmid.record.messages import Messages, string_message

MODEL = Path(str(files("rhythmid"))) / "models" / "paper_hopper.yaml"
READERS = {
    "check": ("check",),
    "identify": ("identify",),
    "diagnose": ("diagnose", "--model", str(MODEL)),
}
SECOND = 1_000_000_000


def in_turn(cases: Iterable[str]) -> list[tuple[str, str]]:
    """(reader, case): the first case with all readers, each other one with one of them in turn, as they read a file by one function."""
    first, *others = cases
    readers = list(READERS)
    return [
        *((reader, first) for reader in readers),
        *((readers[i % len(readers)], one) for i, one in enumerate(others)),
    ]


Y, U = "joint_states", "excitation"


def without(topic):
    return lambda topics: {name: messages for name, messages in topics.items() if name != topic}


def changed(topic, **columns):
    """The topics with columns of one replaced by functions of themselves."""

    def change(topics):
        old = topics[topic]
        new = {name: function(getattr(old, name)) for name, function in columns.items()}
        return {**topics, topic: replace(old, **new)}

    return change


def shortened(samples):
    def cut(topics):
        kept = {}
        for name, m in topics.items():
            columns = {f: v[:samples] for f in ("position", "effort") if (v := getattr(m, f)) is not None}
            kept[name] = Messages(m.stamp_ns[:samples], **columns)
        return kept

    return cut


def one_bad(value):
    def spoil(column):
        spoilt = column.copy()
        spoilt[1234] = value
        return spoilt

    return spoil


def mostly_nan(column):
    return np.where(np.arange(len(column)) < 0.6 * len(column), math.nan, column)


def set_back(stamps):
    late = stamps.copy()
    late[2000:] -= SECOND // 2
    return late


def arriving_in_order(topics):
    """Times of receipt for a topic whose stamps do not rise."""
    received = 1_000_000 * np.arange(len(topics[Y]), dtype=np.int64)
    return {**topics, Y: replace(topics[Y], stamp_ns=set_back(topics[Y].stamp_ns), receive_ns=received)}


SPOILT = {
    "the output's topic is missing": (without(Y), "topic /hopper/joint_states is not in"),
    "the excitation is absent": (without(U), "topic /hopper/excitation is not in"),
    "the output is NaN mostly": (changed(Y, position=mostly_nan), "1800 of 3000 samples are NaN or empty"),
    "the input is infinite once": (changed(U, effort=one_bad(math.inf)), "are infinite, the first at 1.234"),
    "time goes backwards": (arriving_in_order, "time goes backwards by 0.499 s at 1.999"),
    "two samples for many a time": (changed(Y, stamp_ns=set_back), "have the time of another one"),
    "time stands still": (changed(Y, stamp_ns=lambda t: 0 * t + SECOND), "all 3000 samples have the same time"),
    "less than a period is recorded": (shortened(700), "less than one period of the forcing (1 s)"),
    "five samples are recorded": (shortened(5), "has only 5 samples: too short"),
    "the output never changes": (changed(Y, position=lambda y: 0 * y + 0.15), "never changes"),
    "the output has another clock": (
        changed(Y, stamp_ns=lambda t: t + 1_700_000_000 * SECOND), "were not recorded at the same time",
    ),
    "no message was recorded": (shortened(0), "is empty: no message was recorded"),
}  # fmt: skip


# no refusal but a note, see test_standstill: that a machine stands still under a drive is what a record of stiction shows
NOTED = {("check", "the output never changes")}


@pytest.mark.parametrize(
    ("reader", "fault"),
    [(reader, fault) for fault in SPOILT for reader in READERS if (reader, fault) not in NOTED],
)
def test_a_spoilt_recording_is_refused_with_one_line(reader, fault, topics, bag, refused, monkeypatch):
    spoil, words = SPOILT[fault]
    monkeypatch.setattr(Messages, "check", lambda self, topic: None)  # other recorders write what they get
    path = bag(spoil(topics), run={"forcing": {"amplitude": 1.0, "frequency": 1.0}})
    assert words in refused(*READERS[reader], path)


def empty_folder(folder):
    (folder / "bag").mkdir()


def nothing(folder):
    pass


def texts(folder):
    with new_bag(folder / "bag") as writer:
        for name in (U, Y):
            topic = add_topic(writer, f"/hopper/{name}", "std_msgs/msg/String")
            for k in range(20):
                writer.write(topic, k * 1_000_000, string_message("0.3"))


def unused(folder):
    with new_bag(folder / "bag"):
        pass


NO_RECORDINGS = {
    "bag": (nothing, "no such file or directory"),
    "bag/": (empty_folder, "holds no recording (no .mcap or .db3 file)"),
    "bag.mcap": (lambda folder: (folder / "bag.mcap").touch(), "is not an MCAP file"),
    "pointer.mcap": (
        lambda folder: (folder / "pointer.mcap").write_text("version https://git-lfs.github.com/spec/v1\n"),
        "is a pointer of Git LFS, not the data",
    ),
    "bag.db3": (lambda folder: (folder / "bag.db3").touch(), "is not an sqlite3 bag"),
    "noise.mcap": (
        lambda folder: (folder / "noise.mcap").write_bytes(bytes(range(256))),
        "is not an MCAP file",
    ),
    "noise.db3": (
        lambda folder: (folder / "noise.db3").write_bytes(bytes(range(256))),
        "is not an sqlite3 bag",
    ),
    "notes.txt": (lambda folder: (folder / "notes.txt").write_text("u, y"), "is neither a bag"),
    "bag.": (unused, "no file says which of its topics is what; write one by rhythmid init"),
    "./bag": (texts, "topic /hopper/excitation: field 'effort[leg]': std_msgs/msg/String has no field"),
}


@pytest.mark.parametrize(("reader", "name"), in_turn(NO_RECORDINGS))
def test_what_is_no_recording_of_a_machine_is_refused_with_one_line(reader, name, tmp_path, refused):
    make, words = NO_RECORDINGS[name]
    make(tmp_path)
    assert words in refused(*READERS[reader], name.rstrip("."))


def test_a_silent_excitation_leaves_the_cycle_to_identify_and_no_transfer_function(
    topics, bag, refused, command
):
    silent = bag(changed(U, effort=lambda u: 0 * u)(topics))
    answer = command("identify", silent)
    assert answer.code == 0 and "the input is silent" in " ".join(answer.out.split())
    assert "the input is silent" in refused("identify", silent, "--method", "paper")


def test_check_reports_what_it_can_before_it_refuses(topics, bag, command, tmp_path):
    answer = command("check", bag(without(Y)(topics)), "--json", "quality.json")
    assert answer.code == 2 and "/hopper/excitation" in answer.out and "3000 messages" in answer.out
    assert (tmp_path / "quality.json").is_file()


SIGNALS = {
    'output: {topic: /hopper/joint_states, field: "position[leg]", unit: mm}': "signals.yaml:1: output.unit: mm is not an SI",
    'output: {topic: /nothing, field: "position[leg]"}': "signals.yaml:1: output: topic /nothing is not in",
    'output: {topic: /hopper/joint_states, field: "pos[leg]"}': "has no field 'pos'",
    'output: {topic: /hopper/joint_states, field: "position[7]"}': "position has 1 entries",
    'output: {topic: /hopper/joint_states, field: "position[knee]"}': "it names leg, but not knee",
    'output: {topic: /hopper/joint_states, field: "name[0]"}': "is not one number",
    'output: {topic: /hopper/joint_states, feild: "position[0]"}': "did you mean 'field'?",
    'input: {topic: /hopper/excitation, field: "effort[0]"}': "'output:' is missing",
    'output: {topic: /hopper/joint_states, field: "position[leg]"}\nuse: [50, 60]': "within use: [50, 60]",
    'output: {topic: /hopper/joint_states, field: "position[leg]"}\ntime: tomorrow': "signals.yaml:2: time: 'tomorrow' is none",
    "output: [": "is not valid YAML",
    "": "a mapping (key: value) is expected",
    "output: {file: t.csv, column: y}\ntime: {sample_rate: 10}": "names tables, so it takes the place of the bag",
}


@pytest.mark.parametrize(("reader", "text"), in_turn(SIGNALS))
def test_a_wrong_signals_file_is_refused_with_one_line(reader, text, topics, bag, refused, tmp_path):
    (tmp_path / "signals.yaml").write_text(text)
    assert SIGNALS[text] in refused(*READERS[reader], bag(topics), "--signals", "signals.yaml")


WRONG_MODELS = {
    "unknown element": (
        "linear_spring:",
        "linear_sprong:",
        "unknown element 'linear_sprong'; did you mean 'linear_spring'?",
    ),
    "out of range": (
        "stance: {value: 2.0",
        "stance: {value: -2.0",
        "switched_damper.stance: -2 N*s/m is outside [0, inf]",
    ),
    "not SI": ("unit: N/m}", "unit: N/mm}", "write the value in N/m (multiply it by 1000)"),
    "negative delay": (
        "{delay: {value: 0.0",
        "{delay: {value: -0.1",
        "input_delay.delay: -0.1 s is outside [0, inf]",
    ),
    "massless": ("mass: {value: 1.0", "mass: {value: 0.0", "inertia.mass: must be greater than 0"),
}


@pytest.fixture
def wrong_model(tmp_path):
    def write(fault: str) -> str:
        before, after, _ = WRONG_MODELS[fault]
        text = MODEL.read_text(encoding="utf-8")
        assert before in text
        (tmp_path / "wrong.yaml").write_text(text.replace(before, after, 1), encoding="utf-8")
        return "wrong.yaml"

    return write


@pytest.mark.parametrize("reader", ["identify", "diagnose"])
@pytest.mark.parametrize("fault", WRONG_MODELS)
def test_a_wrong_model_is_refused_with_one_line(reader, fault, topics, bag, refused, wrong_model):
    line = refused(reader, bag(topics), "--model", wrong_model(fault))
    assert line.startswith("wrong.yaml:") and WRONG_MODELS[fault][2] in line


WRONG_EXPERIMENTS = {
    "delays: {input: -0.1}": "experiment.yaml:3: delays.input: -0.1 s is outside [0, 10]; a delay is in seconds",
    "delays: {measurement: 40 ms}": "experiment.yaml:3: delays.measurement: a number is expected",
    "delays: {input: {profile: none.csv}}": "none.csv: cannot be read",
    "noise: {measurement_std: -1}": "noise.measurement_std: -1 is too small; at least 0",
    "forcing: {frequency: 0}": "forcing.frequency: 0 is too small",
    "time: {rate: 0}": "time.rate: 0 is too small; at least 1",
    "duration: .nan": "duration: is not a number (NaN)",
    "record: {topics: [everything]}": "'everything' is none of excitation",
    "namespace: my robot": "is no namespace",
    "safety: {max_effort: 0.1}": "its peak of 0.3 N exceeds safety.max_effort = 0.1 N",
    "dealys: {input: 0.1}": "unknown key; did you mean 'delays'?",
}


@pytest.fixture(params=["simulate", "run"])
def starts(request, tmp_path, refused):
    """starts(): the refusal of the experiment in experiment.yaml, which leaves nothing behind."""
    if request.param == "run":
        needs_run()
        arguments = ("run", "experiment.yaml", "--out", "bag")
    else:
        arguments = ("simulate", "hopper.yaml", "--experiment", "experiment.yaml", "--out", "bag")
    if not (tmp_path / "hopper.yaml").exists():
        shutil.copy(MODEL, tmp_path / "hopper.yaml")

    def start() -> str:
        before = sorted(tmp_path.iterdir())
        line = refused(*arguments)
        assert sorted(tmp_path.iterdir()) == before
        return line

    return start


@pytest.mark.parametrize("line", WRONG_EXPERIMENTS)
def test_a_wrong_experiment_is_refused_with_one_line(line, starts, tmp_path):
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT + line + "\n")
    assert WRONG_EXPERIMENTS[line] in starts()


@pytest.mark.parametrize(
    ("excitation", "words"),
    [
        ("{type: chrip, amplitude: 0.3}", "excitation.type: 'chrip' is none of chirp"),
        ("{type: chirp, amplitude: .nan, sweep: 2}", "excitation.amplitude: is not a number (NaN)"),
        ("{type: chirp, amplitude: 0.3, sweep: -2}", "excitation.sweep: -2 is too small; more than 0"),
        ("{type: samples, file: none.csv}", "none.csv: cannot be read"),
        ("chirp", "a mapping with a 'type' is expected"),
    ],
)
def test_a_wrong_excitation_is_refused_with_one_line(excitation, words, starts, tmp_path):
    (tmp_path / "experiment.yaml").write_text(f"model: hopper.yaml\nexcitation: {excitation}\n")
    assert words in starts()


@pytest.mark.parametrize("fault", WRONG_MODELS)
def test_a_machine_that_cannot_be_is_not_simulated_and_not_run(fault, starts, tmp_path, wrong_model):
    wrong_model(fault)
    (tmp_path / "wrong.yaml").replace(tmp_path / "hopper.yaml")
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT)
    assert WRONG_MODELS[fault][2] in starts()


def test_a_missing_experiment_is_refused_with_one_line(starts):
    assert starts() == "experiment.yaml: cannot be read: No such file or directory"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("diagnose", "bag", "--model", str(MODEL), "--holdout", "none"), "none: no such file or directory"),
        (("identify", "bag", "none"), "none: no such file or directory"),
        (("identify", "bag", "--method", "guess"), "--method guess: one of joint, paper is expected"),
        (("identify", "bag", "--forcing", "maybe"), "--forcing maybe: one of on_robot"),
        (("identify", "bag", "--model", "none.yaml"), "none.yaml: cannot be read"),
        (("identify",), "Missing argument"),
        (("check",), "Missing argument"),
        (("check", "bag", "none", "missing"), "none: no such file or directory; missing: no such"),
        (("check", "bag", "bag", "--report", "page.html"), "--report makes the page of one recording"),
        (("table1", "bag"), "unexpected extra argument"),
        (("table1", "--jsom", "out"), "No such option"),
    ],
)
def test_bad_usage_is_refused_with_one_line(arguments, words, refused, bag, topics):
    bag(topics)
    assert words in refused(*arguments)


def test_a_process_of_its_own_ends_with_2_and_says_the_same(rhythmid, refused, bag, topics):
    path = bag(without(Y)(topics))
    done = rhythmid(*READERS["diagnose"], path)
    assert done.returncode == 2
    assert done.stderr == f"error: {refused(*READERS['diagnose'], path)}\n"
