"""What counts as a cause at a joint: values that have come out as they were do not, and hide none beside them."""

from types import SimpleNamespace
from typing import Any

import pytest

from rhythmid.diagnose.joints.joint_diagnosis import stated_at
from rhythmid.model import INERTIA
from rhythmid.simulation.transport import INPUT_DELAY

LATE = (INPUT_DELAY, INERTIA)


def searched(
    inertia: float, probability: dict[str, float], joint: float = 0.95, agreed: tuple[str, ...] = ()
) -> Any:
    """A joint at which a delay beside a freed inertia was chosen, of 1 in the model and of this in the records."""
    nominal = SimpleNamespace(parameters={INERTIA: None}, value=lambda _: 1.0)
    fitted = SimpleNamespace(value=lambda _: inertia, term=lambda _: None)
    chosen = SimpleNamespace(elements=LATE, names=LATE, kind="delay")
    result = SimpleNamespace(
        decision=SimpleNamespace(
            verdict="undecided",
            named=LATE,
            probability=probability,
            joint=joint,
            equivalent=(),
            weights={},
            agreed=agreed,
        ),
        selection=SimpleNamespace(chosen=chosen),
        chosen=SimpleNamespace(model=fitted, fit=SimpleNamespace(model=fitted)),
        contest=SimpleNamespace(hypotheses=()),
        search=SimpleNamespace(balance=SimpleNamespace(by_reference=False)),
    )
    return SimpleNamespace(joint="hip", case=SimpleNamespace(nominal=nominal), result=result, rotors=())


@pytest.mark.parametrize("inertia, chance", [(1.0, 0.25), (1.01, 0.95)])
def test_a_delay_is_stated_although_an_inertia_beside_it_came_out_as_it_was(inertia, chance):
    assert stated_at(searched(inertia, {INPUT_DELAY: 0.95, INERTIA: chance})) == (INPUT_DELAY,)


def test_an_inertia_that_differs_is_stated_beside_a_delay():
    assert stated_at(searched(1.3, {INPUT_DELAY: 0.95, INERTIA: 0.9})) == LATE


def test_an_effect_that_all_good_explanations_have_is_stated_although_the_value_beside_it_is_open():
    one = searched(1.3, {INPUT_DELAY: 0.3, INERTIA: 0.3}, 0.3, ("second_mode",))
    assert stated_at(one) == ("second_mode",)
    assert stated_at(searched(1.3, {INPUT_DELAY: 0.3, INERTIA: 0.3}, 0.3)) == ()
