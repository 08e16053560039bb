"""The sentences in which a verdict is told."""

from contests import NOMINAL, contest, decided, predicted, supposed

from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.answer.wording import summary_of


def test_what_nearly_all_of_the_evidence_has_is_told_beside_a_freed_value_that_is_open():
    values = [
        supposed(
            f"second_mode value_{k}",
            predicted(0.1, 700.0, seed=k),
            "freed_value",
            family={"second_mode": "mode"},
        )
        for k in range(3)
    ]
    alone = [supposed(f"value_{k}", predicted(0.2, 10.0, seed=k), "freed_value") for k in range(3)]
    mode = supposed("second_mode", predicted(0.8), family={"second_mode": "mode"})
    made = contest(NOMINAL, mode, *alone, *values)
    _, decision = decided(made)
    assert decision.verdict == "undecided" and decision.agreed == ("second_mode",)
    assert [one.family for one in decision.families] == ["mode"]
    said = summary_of(
        decision, [], FitQuality(0.1, 0.1), FitQuality(0.1, 0.1), "effort", "the mass of toe is held at 1 kg"
    )
    assert said.startswith(
        "Nearly all of the evidence contains second mode, whatever else is missing. The mass of toe"
    )


def test_what_a_consistent_model_leaves_is_called_noise_only_where_the_noise_is_known():
    _, decision = decided(contest(NOMINAL))
    left = FitQuality(0.1, 0.108)
    assert summary_of(decision, [], left, left, "effort").endswith("down to the noise.")
    said = summary_of(decision, [], left, left, "effort", noise_known=False)
    assert said.endswith("but for 11 % of the effort, in which no test finds a cause.")
