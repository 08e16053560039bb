"""What the page of a diagnosis shows of the answer."""

import re
from dataclasses import replace

from reported import REMAINDER, by_effort, findings, result, rows_with

from rhythmid.report.diagnosis import diagnosis_page
from rhythmid.report.page import render


def test_only_names_that_the_answer_stands_by_come_with_their_probability() -> None:
    named, nearest = (
        render(diagnosis_page(findings(result(v)))) for v in ("missing_physics", "unknown_physics")
    )
    for words in ("probability of this name", "the probability of the name is"):
        assert words in named and words not in nearest
    assert "weight of evidence" in named and "weight of evidence" in nearest


def test_hypotheses_stand_with_how_much_worse_they_predict_and_how_sure_that_is() -> None:
    html = render(diagnosis_page(findings(result())))
    (table,) = (one for one in re.findall("<table.*?</table>", html, re.DOTALL) if "Predicts worse by" in one)
    _, chosen, rival, freed, nominal = rows_with(table, "")
    assert "chosen" in chosen and "best" in chosen and "0.98" in chosen
    assert "as good as the chosen one" in rival and "Stribeck friction" in rival
    assert "12.0 ±" in rival and "1.2" in rival
    assert "a value held fixed is wrong" in freed and "0.00" in freed
    assert "400 ±" in nominal


def test_rejections_stand_with_statistic_threshold_and_reason() -> None:
    html = render(diagnosis_page(findings(result())))
    (row,) = rows_with(html, "only a limit of its parameters is identifiable, where it is another effect")
    assert "Stribeck friction" in row and "within bounds" in row and "0.001" in row


def test_a_small_remainder_is_told_beside_names_that_stand() -> None:
    html = render(diagnosis_page(findings(result() | {"remainder": REMAINDER})))
    assert "The final model leaves 7\u202f% of the mismatch, by more than chance" in html
    assert "The names stand all the same" in html


def test_where_nothing_is_missing_the_remainder_is_told_as_an_error() -> None:
    html = render(diagnosis_page(findings(result("consistent") | {"remainder": REMAINDER})))
    assert "of the mismatch, by more than chance" not in html
    assert "Nothing of practical size is left: the model misses 6 % of the motion." in html


def test_the_remainder_s_curve_is_drawn_where_no_free_function_was_simulated() -> None:
    html = render(diagnosis_page(replace(findings(result() | {"remainder": REMAINDER}), functions=())))
    assert "What is left over velocity" in html


def test_an_answer_by_effort_shows_efforts_and_nothing_of_free_runs() -> None:
    html = render(diagnosis_page(by_effort()))
    for shown in (
        "of the effort",
        "measured − predicted [",
        "Scored by effort",
        "below 12 Hz",
        "What is left over load",
    ):
        assert shown in html or shown in re.sub("<[^>]+>", "", html), shown
    for absent in (
        "free run",
        "simulated output",
        "Harmonics of the cycle",
        "best scores of",
        "Best score in each slot",
        "of the motion",
        "p-value",
    ):
        assert absent not in html, absent


def test_a_value_that_was_set_free_is_not_called_an_effect() -> None:
    told = result() | {"missing": [], "verdict": "undecided"}
    made = findings(result())
    runs = tuple(
        replace(run, labels=("refitted nominal model", "with the value set free")) for run in made.runs
    )
    html = render(diagnosis_page(replace(made, result=told, runs=runs, chosen=("inertia.mass",))))
    assert "with the value set free" in html and "added effect" not in html
    (row,) = rows_with(html, "a value held fixed is wrong")
    assert "chosen" in row


def test_the_diagnosis_shows_all_that_it_promises() -> None:
    html = render(diagnosis_page(findings(result())))
    for promised in (
        "Where model and machine differ", "What is missing", "How much better it fits", "What is left unexplained",
        "Harmonics of the cycle", "The hypotheses", "Rejected hypotheses, and why", "What was assumed", "Parameters", "Delays", "What remains unknown", "The next experiment",
        "Calibration", "Quality of the records", "How to reproduce this", "What was not tried", "dwell at low speed",
        "the forcing acts undelayed", "1 (3 samples lost)", "rhythmid diagnose run 1", "friction force F<sub>c</sub>",
    ):  # fmt: skip
        assert promised in html, promised


def test_the_parameters_table_shows_what_the_refit_had_bent() -> None:
    html = render(diagnosis_page(findings(result())))
    row = next(r for r in re.findall(r"<tr.*?</tr>", html) if "linear spring: stiffness" in r and "180" in r)
    text = re.sub("<[^>]+>", " ", row).replace("\u00a0", " ")
    assert "201.00 ± 0.20" in text and "200.00 ± 0.20" in text and "−0.5" in text
    new = next(r for r in re.findall(r"<tr.*?</tr>", html) if "Coulomb friction: force" in r and "new" in r)
    assert "marked" in new


def test_without_forcing_the_page_says_why_there_are_no_transfer_functions() -> None:
    assert "No periodic forcing was recorded." in render(diagnosis_page(findings(result(), forced=False)))


def test_a_noise_level_that_is_not_known_is_not_shown() -> None:
    known, unknown = findings(result("consistent")), replace(findings(result("consistent")), noise=None)
    assert "noise alone would make" in render(diagnosis_page(known))
    html = render(diagnosis_page(unknown))
    assert "noise alone" not in html
    assert "nothing repeats in these records" in html


def test_an_unknown_effect_is_never_said_to_be_explained() -> None:
    html = render(diagnosis_page(findings(result("unknown_physics"))))
    assert "leaves nothing that a free function" not in html
    assert "seems to be" in html


def test_of_an_undecided_answer_the_families_stand_with_their_probability() -> None:
    family = {
        "family": "friction",
        "laws": ["coulomb_friction", "stribeck_friction"],
        "share": 0.9,
        "probability": 0.93,
    }
    told = result("undecided") | {"families": [family]}
    (row,) = rows_with(render(diagnosis_page(findings(told))), "Coulomb friction, Stribeck friction")
    assert "friction" in row and "93" in row and "90" in row
