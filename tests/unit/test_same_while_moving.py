"""What a stated effect may be instead, where only rests would tell."""

import numpy as np
import pytest

from rhythmid.diagnose.answer.effect_notes import same_while_moving
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.simulation.effect import Path, effect_along

CATALOGUE = load_catalogue()
BARE = Model.from_text("inertia: {mass: 1.0}\nunits: {force: N*m, position: rad}")
TIME = np.linspace(0.0, 4.0, 2001)
SPEED = np.where(TIME < 2.0, 1.5, -0.7)
TYPICAL = {"force": 0.2, "asymmetry": -0.5, "transition": 0.01}


@pytest.mark.parametrize(
    "element", [one for one in CATALOGUE.values() if one.moving_as is not None], ids=lambda one: one.name
)
def test_the_other_effects_give_the_same_force_while_the_machine_moves(element):
    zero = np.zeros(len(TIME))
    path = Path(TIME, np.cumsum(SPEED) * 2e-3, SPEED, zero, zero, zero)
    sum_of_others = sum(
        effect_along(
            CATALOGUE[name], {CATALOGUE[name].size: size, "transition": TYPICAL["transition"]}, BARE, path
        )
        for name, size in element.moving_as(**TYPICAL)
    )
    np.testing.assert_allclose(sum_of_others, effect_along(element, TYPICAL, BARE, path), atol=1e-9)


def test_the_sentence_gives_the_sizes_of_the_others_and_the_joint():
    model = BARE.with_element(CATALOGUE["asymmetric_coulomb_friction"], TYPICAL)
    (said,) = same_while_moving(model.term("asymmetric_coulomb_friction"), "elbow.")
    assert said.startswith("elbow.asymmetric_coulomb_friction: while the machine moves this is the same as ")
    assert "coulomb_friction of 0.2 N*m and constant_force of 0.1 N*m" in said


def test_of_other_effects_nothing_is_said():
    assert (
        same_while_moving(
            BARE.with_element(CATALOGUE["viscous_damper"], {"damping": 1.0}).term("viscous_damper")
        )
        == ()
    )
    assert same_while_moving(None) == ()
