"""A motor's cogging with two wavelengths: both are found over many turns, named and told as two of one kind."""

from dataclasses import replace

import numpy as np
import pytest
from contests import contest, decided, predicted, supposed

from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.answer.wording import listed
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.probability import joint_probability, weights_of
from rhythmid.diagnose.selection import select
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.elements.element import Scales
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
POLES, SLOTS = 2.0 * np.pi / 7.0, 2.0 * np.pi / 12.0
MODEL = """
inertia: {mass: {value: 0.003, unit: kg*m^2}}
force:
  - viscous_damper: {damping: {value: 0.01, unit: N*m*s/rad}}
"""


def rotor(seed: int, sizes: tuple[float, ...], slots: float) -> Record:
    """A rotor of 2 g m² that swings by three sines [rad]; the torque along the motion in closed form, with noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 60.0, 0.005)
    angle, speed, acceleration = (np.zeros(len(time)) for _ in range(3))
    for frequency, size in zip((0.05, 0.13, 0.4), sizes, strict=True):
        turn, rate = 2.0 * np.pi * frequency * time + rng.uniform(0.0, 6.0), 2.0 * np.pi * frequency
        angle += size * np.sin(turn)
        speed += size * rate * np.cos(turn)
        acceleration -= size * rate**2 * np.sin(turn)
    cogging = 0.03 * np.sin(2.0 * np.pi * angle / POLES + 1.0) + slots * np.sin(2.0 * np.pi * angle / SLOTS)
    torque = 0.002 * acceleration + 0.012 * speed + cogging
    torque += 0.004 * rng.standard_normal(len(time))
    angle = angle + 1e-4 * rng.standard_normal(len(time))
    return Record("rotor", Channel(time, angle, "rad"), Channel(time, torque, "N*m"))


def diagnosed(sizes: tuple[float, ...], slots: float) -> Diagnosis:
    model = Model.from_text(MODEL, catalogue=CATALOGUE)
    return diagnose([rotor(1, sizes, slots)], model, [rotor(2, sizes, slots)], CATALOGUE).diagnosis


def test_a_ripple_is_named_although_the_rotor_turns_many_times():
    answer = diagnosed((20.0, 5.0, 1.0), 0.0)
    assert [one.element for one in answer.missing] == ["position_ripple"]
    assert answer.verdict == "missing_physics"
    assert answer.missing[0].parameters["wavelength"].value == pytest.approx(POLES, rel=1e-3)
    assert answer.missing[0].parameters["amplitude"].value == pytest.approx(0.03, rel=0.1)


def test_both_lines_of_a_motors_cogging_are_named_with_their_wavelengths():
    answer = diagnosed((4.0, 1.0, 0.2), 0.02)
    assert answer.verdict == "missing_physics"
    assert [one.element for one in answer.missing] == ["position_ripple", "position_ripple"]
    found = [one.parameters["wavelength"].value for one in answer.missing]
    np.testing.assert_allclose(found, [POLES, SLOTS], rtol=5e-3)


def test_a_second_ripple_is_a_candidate_and_a_second_friction_is_none():
    sizes = Scales(1.0, 1.0, 1.0, 0.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.01)
    model = Model.from_text(MODEL, catalogue=CATALOGUE)
    for name in ("position_ripple", "coulomb_friction"):
        element = CATALOGUE[name]
        model = model.with_element(element, element.first_guesses(sizes)[0])
    tried = {element.name for element, _ in candidates(CATALOGUE, model.setting, sizes).tried}
    assert "position_ripple" in tried and "coulomb_friction" not in tried


def test_the_second_of_two_alike_is_as_probable_as_hypotheses_with_both_of_them():
    def both(elements: str, prediction):
        return replace(
            supposed(elements, prediction), names=tuple(one.split("#")[0] for one in elements.split())
        )

    score = predicted(0.2).score
    nominal, one = supposed("", predicted(1.0)), both("ripple", predicted(0.2, seed=1))
    rivals = [
        both(f"ripple {other}", predicted(0.02, score + 300.0, seed=2)) for other in ("ripple#2", "drag")
    ]
    names = ["ripple", "ripple"]
    made = contest(nominal, one, *rivals)
    weights = weights_of(made, select(made))
    assert joint_probability(names[:1], made, rivals[0], weights) == pytest.approx(1.0, abs=0.01)
    assert joint_probability(names, made, rivals[0], weights) == pytest.approx(0.5, abs=0.2)
    clear = contest(
        supposed("", predicted(1.0)), both("ripple", predicted(0.2)), both("ripple ripple#2", predicted(0.02))
    )
    _, decision = decided(clear)
    assert decision.probability["ripple#2"] > 0.8
    assert decision.named == ("ripple", "ripple#2")


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["ripple"], "ripple"),
        (["a", "a", "b"], "a (2 of them) and b"),
        (["a", "b", "a"], "a (2 of them) and b"),
    ],
)
def test_effects_of_one_name_are_told_with_their_number(names, said):
    assert listed(names) == said
