"""A friction that acts in one direction only is told as the constant force and the friction that it is made of."""

from contests import contest, decided, predicted, supposed

from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.diagnose.selection import Contest, select

PARTS = ("constant_force", "coulomb_friction")


def law(gain: float, within: float) -> Hypothesis:
    """Asymmetric friction with this score, whose asymmetry has this distance from the end of its range."""
    made = supposed("asymmetric_coulomb_friction", predicted(0.1, gain), shape={"within_bounds": within})
    return Hypothesis(**{**vars(made), "beyond": {"asymmetric_coulomb_friction": PARTS}})


def rivals(gain: float, within: float) -> Contest:
    """A constant force, which leaves a friction that is too small to be accepted as a further effect, and the law that is both."""
    nominal = supposed("", predicted(1.0, 0.0))
    alone = supposed("constant_force", predicted(0.17, 93.0))
    both = supposed(" ".join(PARTS), predicted(0.12, 96.5))
    made = contest(nominal, alone, both)
    return Contest(**{**vars(made), "ruled_out": (law(gain, within),)})


def test_parts_of_a_law_at_the_end_of_its_range_are_both_told_where_the_law_is_decisively_better_than_one_of_them():
    selection, decision = decided(rivals(100.0, 0.0))
    assert selection.chosen.names == PARTS
    assert {row.name for row in selection.rejections if "asymmetric_coulomb_friction" in row.hypothesis} == {
        "within_bounds"
    }
    assert set(decision.named) == set(PARTS)


def test_one_part_is_enough_where_the_law_is_not_decisively_better():
    assert select(rivals(95.0, 0.0)).chosen.names == ("constant_force",)
