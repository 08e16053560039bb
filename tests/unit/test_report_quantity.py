"""Numbers as the report prints them."""

import math

import pytest

from rhythmid.report.quantity import (
    estimate,
    in_words,
    number,
    percent,
    plain,
    plus_minus,
    pretty_unit,
    scaled,
)


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (200.0123, 0.0346, "200.012 ± 0.035"),
        (0.0203067, 0.000043, "0.020307 ± 0.000043"),
        (-1.5, 0.2, "−1.50 ± 0.20"),
        (123456.0, 2345.0, "123500 ± 2300"),
        (1.1283e-3 / 10, 4.8e-4 / 10, "(1.13 ± 0.48) × 10⁻⁴"),
        (5.0, 0.0, "5"),
    ],
)
def test_a_value_is_printed_to_the_second_digit_of_its_interval(value: float, half: float, text: str) -> None:
    assert plus_minus(value, half).replace("\u00a0", " ") == text


def test_an_estimate_shows_its_95_percent_interval_with_the_unit() -> None:
    said = estimate(10.0, 0.5, "N*s/m").replace("\u00a0", " ").replace("\u202f", " ")
    assert said == "10.00 ± 0.98 N·s/m"


def test_an_estimate_that_the_records_do_not_determine_says_so() -> None:
    assert "not determined" in estimate(3.0, None, "N")
    assert "not determined" in estimate(3.0, math.inf, "N")
    assert "fixed" in estimate(9.81, 0.0, "m/s^2")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1234567.0, "1.235 × 10⁶"),
        (2.0e-7, "2 × 10⁻⁷"),
        (-0.25, "−0.25"),
        (math.nan, "—"),
        (math.inf, "∞"),
    ],
)
def test_numbers_are_written_for_people(value: float, text: str) -> None:
    assert number(value) == text


def test_sizes_choose_their_prefix() -> None:
    assert scaled(3.1e-5, "m") == (pytest.approx(1e6), "µm")
    assert scaled(0.02, "s") == (pytest.approx(1e3), "ms")
    assert scaled(0.02, "px") == (1.0, "px")
    assert scaled(0.0, "m") == (1.0, "m")


def test_a_model_that_diverges_has_no_percentage() -> None:
    assert percent(math.inf) == "diverges"
    assert percent(0.1165).startswith("11.7")


def test_units_are_set_as_in_print() -> None:
    assert pretty_unit("N*s/m^2") == "N·s/m²"
    assert pretty_unit("1") == ""


def test_names_of_the_command_line_become_words() -> None:
    said = plain("linear_spring.stiffness: 0 in the nominal model, 4.3e-05 by chi2 in run_2 of 1.5 s")
    assert said == "linear spring: stiffness: 0 in the nominal model, 4.3 × 10⁻⁵ by χ² in run 2 of 1.5 s"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("asymmetric_coulomb_friction", "asymmetric Coulomb friction"),
        ("bouc_wen_hysteresis", "Bouc-Wen hysteresis"),
        ("lugre_friction", "LuGre friction"),
        ("dc_motor", "DC motor"),
        ("sensor_lag", "sensor lag"),
    ],
)
def test_surnames_and_abbreviations_have_their_capitals(name: str, words: str) -> None:
    assert in_words(name) == words
