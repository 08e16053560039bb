"""Diagnosis of records and models that cannot carry one: undecided with the reason and the experiment that would help, or one line."""

import re
from dataclasses import replace

import numpy as np
import pytest
from json_schema import conforming

from machines import CATALOGUE, hopper, only, records
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.messages import Messages
from rhythmid.record.record import Record

FEW = ("coulomb_friction", "cubic_stiffness")
SMALL = only(*FEW)
WEAK = ({"type": "chirp", "amplitude": 0.3, "sweep": 8.0, "band": [0.0, 7.0]}, 1.0)
STRONG = ({"type": "chirp", "amplitude": 1.2, "sweep": 8.0, "band": [7.0, 0.0]}, 1.0)
CYCLE = ({"type": "silence", "length": 8.0}, 1.0)
TINY = ({"type": "chirp", "amplitude": 0.004, "sweep": 8.0, "band": [0.0, 7.0]}, 1.0)


def run(
    given: list[Record], model: Model | None = None, catalogue: Catalogue = SMALL, **options
) -> Diagnosis:
    return conforming(diagnose(given, model or hopper(), catalogue=catalogue, **options).diagnosis)


@pytest.fixture(scope="module")
def plain() -> list[Record]:
    return records(hopper(), (WEAK, STRONG), seed=1)


@pytest.fixture(scope="module")
def brief(plain) -> list[Record]:
    """Half of them."""
    return [one.cut(2.0, 6.0) for one in plain]


@pytest.fixture(scope="module")
def rubbing() -> list[Record]:
    friction = CATALOGUE["coulomb_friction"]
    return records(
        hopper().with_element(friction, {"force": 0.03, "transition": 0.002}), (WEAK, STRONG), seed=2
    )


def scaled(record: Record, role: str, factor: float) -> Record:
    channel = getattr(record, role)
    return replace(record, **{role: replace(channel, value=factor * channel.value)})


def limited(record: Record, share: float) -> Record:
    """The record of a sensor that goes no further than this quantile."""
    value = record.output.value
    return replace(record, output=replace(record.output, value=np.minimum(value, np.quantile(value, share))))


# poor records


@pytest.mark.parametrize("length", [0.6, pytest.param(2.0, marks=pytest.mark.long)])
def test_short_records_of_a_machine_that_lacks_nothing_get_no_name(plain, length):
    found = run([one.cut(2.0, 2.0 + length) for one in plain])
    assert found.verdict != "missing_physics" and found.missing == ()


@pytest.mark.parametrize("length", [pytest.param(0.6, marks=pytest.mark.long), 2.0])
def test_short_records_get_no_wrong_name(rubbing, length):
    found = run([one.cut(2.0, 2.0 + length) for one in rubbing])
    assert {effect.element for effect in found.missing} <= {"coulomb_friction"}


@pytest.mark.parametrize("protocol", [(CYCLE,), (TINY,)])
def test_one_amplitude_forbids_no_answer(protocol):
    found = run(records(hopper(), protocol, seed=3))
    assert found.verdict in ("consistent", "undecided") and found.missing == ()


@pytest.mark.usefixtures("processors")  # the same answer in several processes
def test_what_one_amplitude_shows_clearly_is_named():
    machine = hopper().with_element(CATALOGUE["coulomb_friction"], {"force": 0.03, "transition": 0.002})
    found = run(records(machine, (CYCLE,), seed=4))
    assert [effect.element for effect in found.missing] == ["coulomb_friction"]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_records_that_are_mostly_noise_decide_nothing_and_ask_for_more():
    quiet = ({"type": "chirp", "amplitude": 1e-3, "sweep": 8.0, "band": [0.0, 7.0]}, 1e-3)
    found = run(records(hopper(), (quiet,), seed=5))
    assert (found.verdict, found.missing) == ("undecided", ())
    assert re.search(r"misses \d+ % of what was measured", found.summary)
    assert "larger" in found.next_experiment


def test_records_of_different_machines_get_no_name(plain):
    other = records(hopper().with_values({"linear_spring.stiffness": 400.0}), (STRONG,), seed=6)
    found = run([plain[0], *other])
    assert (found.verdict, found.missing) == ("undecided", ())
    assert "the structure of the model are wrong" in found.summary


@pytest.mark.long
def test_a_strong_effect_is_not_mistaken_for_two_machines():
    machine = hopper().with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 1e4})
    found = run(records(machine, (WEAK, STRONG), seed=7))
    assert found.verdict == "missing_physics"
    assert [effect.element for effect in found.missing] == ["cubic_stiffness"]


# one line


def refused(given: list[Record], *words: str, model: Model | None = None, **options) -> None:
    with pytest.raises(InputError) as refusal:
        run(given, model, **options)
    message = str(refusal.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


@pytest.mark.parametrize(
    ("role", "factor"),
    [
        pytest.param("output", 1000.0, marks=pytest.mark.long),
        ("output", 0.001),
        ("input", 1000.0),
        ("forcing", 1000.0),
    ],
)
def test_a_unit_that_is_off_by_a_thousand_is_named_with_the_channel_and_the_scale(brief, role, factor):
    wrong = [scaled(one, role, factor) for one in brief]
    refused(wrong, f"the {role} looks like", f"scale: {1.0 / factor:g} under '{role}:'")


def test_records_in_different_units_are_refused_by_name(brief):
    refused(
        [brief[0], scaled(brief[1], "output", 1000.0)],
        "do not look like one machine in one unit",
        "check units",
    )
    refused(brief, "do not look like one machine", holdout=[scaled(brief[0], "output", 1000.0)])


def test_right_units_are_not_suspected_although_the_model_is_far_off(plain):
    wrong = hopper().with_values({"linear_spring.stiffness": 330.0, "switched_damper.stance": 0.8})
    assert run(plain, wrong).verdict == "consistent"


def test_a_missing_input_beside_a_forcing_is_noted(brief):
    found = run([replace(brief[0], input=None)])
    assert found.verdict != "consistent"
    assert any("no record has an input channel" in note for note in found.notes)


def test_a_sensor_that_is_clipped_most_of_the_time_is_refused(plain):
    refused([limited(one, 0.3) for one in plain], "% of the output is clipped at", "wider range")


def test_a_model_without_anything_to_fit_is_refused_with_the_mend(plain):
    model = hopper()
    fixed = model.with_parameters({n: replace(v, fixed=True) for n, v in model.parameters.items()})
    refused(plain, "every parameter", "drop 'fixed: true'", model=fixed)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_nominal_model_that_diverges_is_refused(plain):
    stiff = hopper().with_values({"linear_spring.stiffness": 1e13})
    refused(plain, "diverges", "check its parameters and units", model=stiff)


def test_no_record_at_all_is_refused():
    refused([], "no record is given")


# reported exclusions


def test_clipped_samples_are_left_out_and_counted(rubbing):
    clipped = [limited(one, 0.97) for one in rubbing]
    found = run(clipped)
    assert found.verdict == "missing_physics"
    assert [effect.element for effect in found.missing] == ["coulomb_friction"]
    said = [note for note in found.notes if "clipped" in note]
    assert len(said) == 2 and all(int(note.split(" left out, ")[1].split()[0]) > 100 for note in said)


@pytest.mark.parametrize("flaw", ["outliers", "repeats"])
def test_a_sensors_flaws_do_not_pass_for_physics_and_are_told(rubbing, flaw):
    given = []
    for one in rubbing:
        value = one.output.value.copy()
        if flaw == "outliers":
            value[500::700] += 0.5
        else:
            value = np.repeat(value[::5], 5)[: len(value)]
        given.append(replace(one, output=replace(one.output, value=value)))
    found = run(given)
    assert found.verdict == "missing_physics"
    assert [effect.element for effect in found.missing] == ["coulomb_friction"]
    said = {"outliers": "stand far off their neighbours", "repeats": "repeat the one before"}[flaw]
    assert sum(said in note for note in found.notes) == len(rubbing)


EXPLOSIVE = '''
"""A spring that pushes the further it is stretched, without limit."""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient):
    return coefficient * math.sinh(1e9 * x)


ELEMENT = Element(
    name="explosive_spring",
    slot="force",
    title="Explosive spring",
    equation="F = κ sinh x",
    parameters=(Parameter("coefficient", "N", "strength κ", bounds=(0.0, math.inf)),),
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [{"coefficient": 1.0}, {"coefficient": 10.0}],
    reference="none",
)
'''


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_candidate_that_blows_the_simulation_up_is_reported_as_excluded(plain, tmp_path):
    (tmp_path / "explosive_spring.py").write_text(EXPLOSIVE)
    known = load_catalogue([tmp_path])
    few = known.without(*[n for n, e in known.items() if e.candidate and n not in (*FEW, "explosive_spring")])
    found = run(plain, catalogue=few)
    assert found.verdict == "consistent"
    assert any("explosive_spring" in one.name and "diverges" in one.reason for one in found.excluded)


# the command


@pytest.mark.parametrize(
    ("spoilt", "said"),
    [
        (
            lambda topics: topics | {"joint_states": still(topics["joint_states"])},
            "the machine stands still: its position never changes, though the input reaches",
        ),
    ],
)
def test_records_that_cannot_be_judged_get_one_line_exit_code_2_and_no_file(
    refused, bag, topics, tmp_path, spoilt, said
):
    model, answer = tmp_path / "nominal.yaml", tmp_path / "answer.json"
    hopper().save(model)
    signals = tmp_path / "signals.yaml"
    made = spoilt(topics)
    lines = ["output: {topic: /hopper/joint_states, field: 'position[leg]'}"]
    if "excitation" in made:
        lines.append("input: {topic: /hopper/excitation, field: 'effort[leg]'}")
    signals.write_text("\n".join(lines) + "\n")
    line = refused("diagnose", bag(made), "--model", model, "--signals", signals, "--json", answer)
    assert said in line and not answer.exists()


def still(messages: Messages) -> Messages:
    """A joint that does not move."""
    return Messages(messages.stamp_ns, position=np.full(len(messages.stamp_ns), 0.15))
