"""The verdict: what the records cannot tell apart, and which lines in a residual are unknown physics."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.heldout import HeldOut
from rhythmid.diagnose.location import Dependence
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.refit import Trial
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.diagnose.twins import twins_of
from rhythmid.diagnose.verdict import verdict_of
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, normalised_error
from rhythmid.identify.series import Series
from rhythmid.model import Model

QUIET = NoiseModel(np.empty(0), 1.0)
TIME = 5e-3 * np.arange(2000)
SERIES = Series("made", TIME, np.sin(2 * np.pi * TIME), None, None, 1, np.ones(2000, bool), 5e-3)


def trial(base: Model, name: str, **values: float) -> Trial:
    """A model with one more element, as if it had been fitted."""
    model = base.with_element(CATALOGUE[name], values)
    return Trial((name,), model, (), 100.0, 2000, len(model.free), True, QUIET)


def test_flight_damping_beside_a_free_switched_damper_is_a_viscous_damper_too():
    assert twins_of(trial(hopper(), "flight_damping", damping=0.1), []) == [
        ("flight_damping", "viscous_damper")
    ]


def test_flight_damping_has_no_twin_where_the_switched_damper_is_known_or_absent():
    stance = replace(hopper().parameters["switched_damper.stance"], fixed=True)
    known = hopper().with_parameters({"switched_damper.stance": stance})
    for base in (known, hopper().without("switched_damper")):
        assert twins_of(trial(base, "flight_damping", damping=0.1), []) == []


def test_a_rival_that_replaces_an_effect_is_its_twin_once_and_never_one_that_contains_it():
    best = trial(hopper(), "flight_damping", damping=0.1)
    rivals = [
        trial(hopper(), "viscous_damper", damping=0.1),
        trial(hopper(), "quadratic_drag", coefficient=0.1),
        trial(hopper(), "viscoelastic_relaxation", stiffness=1.0, time_constant=0.1),
    ]
    assert twins_of(best, rivals) == [("flight_damping", "viscous_damper", "quadratic_drag")]


@pytest.mark.parametrize(
    ("chi2", "expected"), [(95.0, []), (90.0, [("coulomb_friction", "asymmetric_coulomb_friction")])]
)
def test_what_contains_an_effect_is_its_twin_where_it_does_better_by_more_than_its_parameters_cost(
    chi2, expected
):
    best = trial(hopper(), "coulomb_friction", force=0.1, transition=0.01)
    wider = trial(hopper(), "asymmetric_coulomb_friction", force=0.1, asymmetry=0.01, transition=0.01)
    assert wider.free == best.free + 1  # worth 7.6
    assert twins_of(best, [replace(wider, chi2=chi2)]) == expected


def several(base: Model, chi2: float = 100.0, **elements: dict[str, float]) -> Trial:
    """A model with several more elements, as if it had been fitted."""
    for name, values in elements.items():
        base = base.with_element(CATALOGUE[name], values)
    return Trial(tuple(elements), base, (), chi2, 2000, len(base.free), True, QUIET)


CURVED = {
    "cubic_stiffness": {"coefficient": 10.0},
    "quadratic_stiffness": {"coefficient": 10.0},
    "quintic_stiffness": {"coefficient": 10.0},
    "position_ripple": {"amplitude": 5.0, "wavelength": 0.5, "phase": 0.0},
}


CURVED_AND_DRY = {
    "cubic_stiffness": CURVED["cubic_stiffness"],
    "coulomb_friction": {"force": 0.1, "transition": 0.01},
}


def test_effects_that_one_element_can_replace_each_are_one_family_and_too_many_models_to_name_one():
    terms = {name: CURVED[name] for name in ("quadratic_stiffness", "quintic_stiffness")}
    best = several(hopper(), **terms)
    ripple = CURVED["position_ripple"]
    rivals = [several(hopper(), **{name: terms[name]}, position_ripple=ripple) for name in terms]
    twins = twins_of(best, rivals)
    assert twins == [("quadratic_stiffness", "quintic_stiffness", "position_ripple")]
    found = replace(explained(0.1, 0.01), best=best, trials=(best, *rivals))
    assert verdict_of(found, 1e-9, [], twins, None, [SERIES], 0.0)[0] == "undecided"
    # one replacement for one of two effects leaves two models: that is an answer
    twins = twins_of(best, rivals[:1])
    assert twins == [("quintic_stiffness", "position_ripple")]
    found = replace(found, best=several(hopper(), **CURVED_AND_DRY))
    twins = [("cubic_stiffness", "position_ripple")]
    assert verdict_of(found, 1e-9, [], twins, None, [SERIES], 0.0)[0] == "missing_physics"


@pytest.mark.parametrize(
    ("terms", "better", "expected"),
    [
        (("quadratic_stiffness", "quintic_stiffness"), 0.0, "undecided"),
        (
            ("quadratic_stiffness", "position_ripple"),
            0.0,
            "undecided",
        ),  # of two families: one law all the same
        (("quadratic_stiffness", "quintic_stiffness"), 100.0, "unknown_physics"),
        (("quadratic_stiffness", "quintic_stiffness", "position_ripple"), 0.0, "unknown_physics"),
        (("cubic_stiffness", "coulomb_friction"), 100.0, "missing_physics"),
        (("cubic_stiffness", "faint_quadratic"), 100.0, "missing_physics"),  # which corrects the cubic one
    ],
)
def test_laws_of_one_quantity_that_leave_more_to_say_or_are_many_are_a_series_and_not_named(
    terms, better, expected
):
    values = CURVED | {"coulomb_friction": {"force": 0.1, "transition": 0.01}}
    given = {name: values[name] for name in terms if name in values}
    if "faint_quadratic" in terms:
        given["quadratic_stiffness"] = {"coefficient": 1.0}
    best = several(hopper(), **given)
    kink = {"change": 1.0, "kink": 0.5}  # two parameters more cost 15
    richer = several(hopper(), best.chi2 - better, **given, bilinear_stiffness=kink)
    found = replace(explained(0.1, 0.01), best=best, trials=(best, richer))
    verdict, why = verdict_of(found, 1e-9, [], [], None, [SERIES], 0.0)
    assert verdict == expected
    assert ("a series for one law of the position" in why) is (expected == "unknown_physics")
    assert ("one law of the position that the catalogue does not have" in why) is (expected == "undecided")


@pytest.mark.parametrize(("size", "expected"), [(0.25, "missing_physics"), (1.0, "unknown_physics")])
def test_a_leading_law_with_more_than_one_correction_is_named_only_where_these_are_faint(size, expected):
    """Of the sum of the three the corrections together are 5 % and 24 %: of one correction both would be borne."""
    best = several(
        hopper(),
        cubic_stiffness=CURVED["cubic_stiffness"],
        quadratic_stiffness={"coefficient": size},
        quintic_stiffness={"coefficient": -0.5 * size},
    )
    found = replace(explained(0.1, 0.01), best=best, trials=(best,))
    assert verdict_of(found, 1e-9, [], [], None, [SERIES], 0.0)[0] == expected


def fit_of(rest: float, line: float) -> Fit:
    """A fit that leaves noise of size `rest`, as a share of the motion, and in it a line of this size, at 3.7 Hz."""
    noise = rest * np.random.default_rng(2).standard_normal(len(TIME))
    residuals = (np.std(SERIES.value) * (noise + np.sqrt(2.0) * line * np.sin(2 * np.pi * 3.7 * TIME)),)
    run, power = SimpleNamespace(series=(SERIES,)), float(np.sum(residuals[0] ** 2))
    made = SimpleNamespace(
        run=run,
        residuals=residuals,
        chi2=power,
        std={},
        nrmse=lambda: normalised_error(residuals, run.series),
    )
    return cast(Fit, made)


@pytest.mark.parametrize(("unexplained", "expected"), [(0.1, "missing_physics"), (0.0125, "unknown_physics")])
def test_a_line_is_unknown_physics_unless_it_is_faint_beside_what_was_explained(unexplained, expected):
    best = trial(hopper(), "coulomb_friction", force=0.1, transition=0.01)
    found = Search(fit_of(unexplained, 0.0), best, fit_of(0.01, 0.005), QUIET, (best,), (), ())
    verdict, why = verdict_of(found, 1e-9, [], [], None, [SERIES], 0.0)
    assert verdict == expected
    assert ("a line at 3.7 Hz remains" in why) is (expected == "unknown_physics")


def explained(nominal: float, left: float, held: float = 0.0) -> Search:
    """A search whose one effect takes the error from `nominal` to `left`; both leave a line of size `held` where nothing was fitted."""
    best = trial(hopper(), "coulomb_friction", force=0.1, transition=0.01)
    fits = []
    for size in (nominal, left):
        residual = np.std(SERIES.value) * size * np.random.default_rng(3).standard_normal(len(TIME))
        used = TIME < 7.0
        residual[~used] += (
            np.std(SERIES.value) * (held + nominal - left) * np.sqrt(2) * np.sin(6 * TIME[~used])
        )
        series = replace(SERIES, used=used, hidden=~used)
        chi2 = float(np.sum((residual[used] / (0.01 * np.std(SERIES.value))) ** 2))
        run = SimpleNamespace(series=(series,))
        made = {
            "run": run,
            "residuals": (residual,),
            "chi2": chi2,
            "nrmse": lambda size=size: size,
            "std": {},
        }
        fits.append(SimpleNamespace(**made))
    return Search(cast(Fit, fits[0]), best, cast(Fit, fits[1]), QUIET, (best,), (), ())


@pytest.mark.parametrize(("share", "expected"), [(0.002, "missing_physics"), (0.02, "unknown_physics")])
def test_effects_that_leave_a_structured_remainder_are_not_named_unless_it_is_faint(share, expected):
    found = explained(0.1, 0.01)
    gain = share * (found.nominal.chi2 - found.fit.chi2)
    remains = [Dependence("position", 0.5, 1e-30, gain, np.empty(0), np.empty(0))]
    verdict, why = verdict_of(found, 1e-9, remains, [], None, [SERIES], 0.0)
    assert verdict == expected
    assert ("structured remainder" in why) is (expected == "unknown_physics")


@pytest.mark.parametrize(
    ("share", "p_value", "added", "expected"),
    [
        (0.004, 1e-6, ("coulomb_friction",), "unknown_physics"),
        (0.001, 1e-6, ("coulomb_friction",), "missing_physics"),  # no more than real machines leave
        (0.004, 0.02, ("coulomb_friction",), "missing_physics"),  # may be chance
        (0.004, 1e-6, (), "missing_physics"),  # from before the effect was there
        (0.004, 1e-6, ("second_mode", "bilinear_stiffness"), "missing_physics"),  # that stood in its place
    ],
)
def test_effects_that_leave_what_a_further_one_explains_in_part_are_not_named(
    share, p_value, added, expected
):
    found = explained(0.1, 0.01)
    statistic = share * (found.nominal.chi2 - found.fit.chi2)
    score = Score(0, CATALOGUE["quadratic_drag"], {"coefficient": 0.1}, statistic, 1.0)
    found = replace(found, rounds=(Round((score,), p_value), Round((score,), p_value, added)))
    assert verdict_of(found, 1e-9, [], [], None, [SERIES], 0.0)[0] == expected


def test_effects_that_do_not_hold_on_held_out_data_are_not_named():
    verdict, why = verdict_of(explained(0.1, 0.01), 1e-9, [], [], None, [SERIES], 0.2)
    assert verdict == "unknown_physics"
    assert "20 % of what is missing on held-out data remains" in why


def test_what_noise_leaves_on_held_out_data_is_nothing_and_what_stays_is_told_as_a_share():
    found = explained(0.1, 0.01)
    calm = replace(found, fit=explained(0.01, 0.01).fit)
    assert HeldOut(calm, None).uncarried() == 0.0
    left = replace(found, fit=explained(0.01, 0.01, 0.05).fit)
    assert HeldOut(left, None).uncarried() == pytest.approx(0.05**2 / (0.1**2 + 0.09**2), rel=0.2)


@pytest.mark.parametrize(("p_value", "expected"), [(3e-3, "undecided"), (1e-9, "unknown_physics")])
def test_more_than_repeats_show_is_unknown_physics_only_where_the_catalogue_sees_it_too(p_value, expected):
    """Rounding repeats with the motion, so that repeats can show less noise than there is."""
    nothing = replace(
        explained(0.01, 0.01),
        best=replace(trial(hopper(), "coulomb_friction", force=0.1, transition=0.01), added=()),
    )
    repeats = NoiseModel(np.empty(0), 0.8 * 0.01 * float(np.std(SERIES.value)))
    verdict, _ = verdict_of(nothing, p_value, [], [], repeats, [SERIES], 0.0)
    assert verdict == expected


@pytest.mark.parametrize(("rounded", "expected"), [(False, "unknown_physics"), (True, "missing_physics")])
def test_what_rounding_may_leave_is_no_unknown_physics(rounded, expected):
    """A remainder of a hundredth of the motion, of which repeats show a quarter; rounding to 4 % leaves as much."""
    step = 0.04 * float(np.std(SERIES.value))
    value = step * np.round(SERIES.value / step) if rounded else SERIES.value
    repeats = NoiseModel(np.empty(0), 0.25 * 0.01 * float(np.std(SERIES.value)))
    seen = [replace(SERIES, value=value, used=TIME < 7.0)]
    assert verdict_of(explained(0.1, 0.01), 1e-9, [], [], repeats, seen, 0.0)[0] == expected


@pytest.mark.parametrize(
    ("share", "worth", "expected"),
    [
        (0.003, 180.0, "unknown_physics"),
        (0.003, 1e4, "missing_physics"),
        (0.001, 180.0, "missing_physics"),  # as a real machine leaves
    ],
)
def test_effects_are_not_named_where_a_tenth_remains_of_what_the_least_of_them_explains(
    share, worth, expected
):
    found = explained(0.1, 0.01)
    two = replace(
        found.best,
        added=("coulomb_friction", "freeplay"),
        model=found.best.model.with_element(CATALOGUE["freeplay"], {"gap": 1e-3}),
    )
    one = replace(found.best, chi2=two.chi2 + worth)
    found = replace(found, best=two, trials=(two, one))
    gain = share * (found.nominal.chi2 - found.fit.chi2)
    remains = [Dependence("position", 0.2, 1e-30, gain, np.empty(0), np.empty(0))]
    assert verdict_of(found, 1e-9, remains, [], None, [SERIES], 0.0)[0] == expected
