"""Zeros that differ from record to record: adopted where the records have them, told, and left alone where they do not."""

from functools import cache

import numpy as np
import pytest

from machines import CATALOGUE, hopper, only, records
from rhythmid.diagnose.baseline import calibrate
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.record_zeros import with_zeros
from rhythmid.identify.identify import identify
from rhythmid.identify.joint import best_fit
from rhythmid.identify.own_zeros import with_own_zeros
from rhythmid.identify.record_zero import RECORD_ZERO
from rhythmid.identify.series import hold_out_tail, prepare
from rhythmid.identify.zero_estimates import zeros_told
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.record.separate_zeros import separate_zeros_notes
from rhythmid.simulation.simulate import simulate

NOMINAL = """
units: {force: rad/s^2, position: rad}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 20.0}, rest_length: {value: 0.0}}
  - viscous_damper: {damping: {value: 0.3}}
"""
NOISE = 5e-3  # [rad]
ZEROS = {"first": 0.2, "second": 0.4, "third": 0.0}  # [rad]
FRICTION = only("coulomb_friction", "quadratic_drag", "cubic_stiffness", "quadratic_stiffness")
SAME = dict.fromkeys(ZEROS, 0.2)


def nominal() -> Model:
    return Model.from_text(NOMINAL, catalogue=CATALOGUE)


def decays(machine: Model, zeros: dict[str, float]) -> list[Record]:
    """Releases of a machine at 50 Hz, each with a zero of its own."""
    time = 0.02 * np.arange(500)
    made = []
    for seed, (name, zero) in enumerate(zeros.items()):
        start = (1.5 - 0.3 * seed, 0.0)
        value = simulate(machine, time, initial=start).output + zero
        value = value + NOISE * np.random.default_rng(seed).standard_normal(len(time))
        made.append(Record(name, Channel(time, value, "rad")))
    return made


def assert_told(note: str) -> None:
    """The note says the zeros within their standard deviations, and those are small."""
    for name in ("second", "third"):
        value, _, std = note.split(f" {name} ")[1].split()[:3]
        assert float(std) < 0.05
        assert abs(float(value) - (ZEROS[name] - ZEROS["first"])) < 4.0 * max(float(std), 1e-3)


@cache
def with_friction() -> Model:
    return (
        nominal()
        .with_values({"linear_spring.stiffness": 21.0, "viscous_damper.damping": 0.1})
        .with_element(CATALOGUE["coulomb_friction"], {"force": 1.5, "transition": 1e-3})
    )


def test_friction_is_named_beside_zeros_that_differ_and_the_zeros_are_told():
    held = decays(with_friction(), {"held": -0.1})
    few = only("coulomb_friction", "quadratic_stiffness")
    answer = diagnose(decays(with_friction(), ZEROS), nominal(), held, few)
    found = answer.diagnosis
    assert found.verdict == "missing_physics" and [one.element for one in found.missing] == [
        "coulomb_friction"
    ]
    assert found.missing[0].parameters["force"].value == pytest.approx(1.5, rel=0.05)
    (told,) = [note for note in found.calibration if "zero differs" in note]
    assert_told(told)
    assert answer.model.term(RECORD_ZERO.name) is None
    assert found.fit["augmented"].heldout_nrmse < 0.05


@pytest.mark.parametrize(
    ("machine", "zeros", "adopted"),
    [
        (with_friction, SAME, False),
        (with_friction, ZEROS, True),
        (nominal, SAME, False),
        (nominal, ZEROS, True),
    ],
)
def test_zeros_are_adopted_only_where_they_differ(machine, zeros, adopted):
    series, unseen = hold_out_tail(prepare(decays(machine(), zeros)))
    plain = calibrate(nominal(), series, CATALOGUE)
    found, others = with_zeros(plain, nominal(), unseen, FRICTION)
    assert (found is not plain) == adopted
    if not adopted:
        assert others == unseen
        return
    assert found.fit.nrmse() < plain.fit.nrmse()
    assert_told(*zeros_told(found.fit))
    for one, other in zip(found.series, others, strict=True):
        np.testing.assert_array_equal(one.value, other.value)


@pytest.mark.parametrize(("zeros", "count"), [(ZEROS, 1), (SAME, 0)])
def test_identify_tells_zeros_that_differ_and_its_model_is_that_of_the_first_record(zeros, count):
    machine = nominal().with_values({"linear_spring.stiffness": 21.0, "viscous_damper.damping": 0.25})
    found = identify(decays(machine, zeros), nominal())
    told = [note for note in found.notes if "zero differs" in note]
    assert len(told) == count
    for note in told:
        assert_told(note)
    assert found.usable and found.model.term(RECORD_ZERO.name) is None
    for name, truth in {"linear_spring.stiffness": 21.0, "linear_spring.rest_length": 0.2}.items():
        estimate = found.parameters[name]
        assert estimate.value is not None and estimate.std is not None
        assert abs(estimate.value - truth) < 4.0 * estimate.std < 0.1


def test_a_mean_that_shifts_with_the_amplitude_is_physics_and_no_zero():
    """A hopper whose spring is not symmetric, at two amplitudes."""
    machine = hopper().with_element(CATALOGUE["quadratic_stiffness"], {"coefficient": 600.0})
    protocol = [({"type": "silence", "length": 6.0}, amplitude) for amplitude in (1.0, 3.0)]
    series, unseen = hold_out_tail(prepare(records(machine, protocol)))
    plain = calibrate(hopper(), series, CATALOGUE)
    found, _ = with_zeros(plain, hopper(), unseen, only("quadratic_stiffness", "coulomb_friction"))
    assert found is plain
    alone = best_fit(records(machine, protocol), hopper())
    assert with_own_zeros(alone) == (alone, ())


PENDULUM = """
units: {force: rad/s^2, position: rad}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 20.0}, reference: {value: 0.0}}
  - viscous_damper: {damping: {value: 0.3}}
"""


@pytest.mark.parametrize("text", [NOMINAL, PENDULUM], ids=["spring", "pendulum"])
@pytest.mark.parametrize("zero", [0.0, 0.2, 3.1])
def test_a_held_out_record_that_was_zeroed_elsewhere_is_told(text, zero):
    machine = Model.from_text(text, catalogue=CATALOGUE)
    fitted, held = decays(machine, {"first": 0.0, "held": zero})
    answer = diagnose(fitted, machine, held, FRICTION)
    told = [note for note in answer.diagnosis.notes if "zero of the held-out held" in note]
    assert len(told) == (zero != 0.0)
    for note in told:
        value = float(note.split(" is ")[1].split()[0])
        assert value == pytest.approx(zero, abs=0.01) and f"offset: {-value:.3g}" in note


def test_a_held_out_record_that_the_model_does_not_explain_has_no_zero_to_be_told():
    held = decays(nominal().with_values({"linear_spring.stiffness": 40.0}), {"held": 0.0})
    answer = diagnose(decays(nominal(), {"first": 0.0}), nominal(), held, FRICTION)
    assert not any("zero of the held-out" in note for note in answer.diagnosis.notes)


def test_positions_that_lie_far_apart_are_told_and_others_are_not():
    first, near, far = decays(nominal(), {"first": 0.0, "near": 0.4, "far": 9.0})
    (note,) = separate_zeros_notes([first, near, far])
    assert note.startswith("the output of far is between ") and "offset:" in note


def test_a_machine_that_nothing_restores_and_that_never_comes_back_has_no_zero(monkeypatch):
    """Where it begins says the same as a zero; an end stop would take each place where a record ends for a zero."""
    cart = Model.from_text(
        "units: {force: rad/s^2, position: rad}\ninertia: {mass: {value: 1.0, fixed: true}}\n"
        "force: [{viscous_damper: {damping: {value: 0.3}}}]",
        catalogue=CATALOGUE,
    )
    time = 0.02 * np.arange(500)
    runs = [
        Record(name, Channel(time, zero + speed * (1.0 - np.exp(-0.3 * time)) / 0.3, "rad"))
        for (name, zero), speed in zip(ZEROS.items(), (1.0, 1.5, 2.0), strict=True)
    ]
    series, unseen = hold_out_tail(prepare(runs))
    plain = calibrate(cart, series, CATALOGUE)

    def looked_for(*_: object) -> None:
        raise AssertionError("a zero is looked for")

    monkeypatch.setattr("rhythmid.diagnose.record_zeros.Seen.of", looked_for)
    assert with_zeros(plain, cart, unseen, CATALOGUE) == (plain, unseen)
