"""A simpler law at the values that a richer one has found."""

from dataclasses import replace

import pytest
from axes import CATALOGUE, axis, axis_model
from contests import contest, predicted, supposed

from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.kin import at_values_of, represented
from rhythmid.diagnose.effort.search import EffortSearch, search_effort

KEPT = ("coulomb_friction", "asymmetric_coulomb_friction", "quadratic_drag", "viscous_damper")
FEW = CATALOGUE.without(*(name for name in CATALOGUE if name not in KEPT))


@pytest.fixture(scope="module")
def found() -> EffortSearch:
    return search_effort([axis()], axis_model(), FEW, most=1)


def alone(found: EffortSearch, name: str) -> Fitted:
    (one,) = [one for one in found.hypotheses if one.elements == (name,)]
    return one


def test_a_special_case_takes_the_values_of_the_law_that_contains_it(found):
    rich, plain = (alone(found, name) for name in ("asymmetric_coulomb_friction", "coulomb_friction"))
    moved = rich.fit.model.with_values(
        {"asymmetric_coulomb_friction.transition": 0.123, "inertia.mass": 1.234}
    )
    model = at_values_of(replace(rich, fit=replace(rich.fit, model=moved)), plain)
    assert model is not None
    assert model.value("coulomb_friction.transition") == 0.123 and model.value("inertia.mass") == 1.234
    assert [term.label for term in model.terms] == [term.label for term in plain.fit.model.terms]


def test_no_values_are_taken_from_a_narrower_law(found):
    rich, plain = (alone(found, name) for name in ("asymmetric_coulomb_friction", "coulomb_friction"))
    assert at_values_of(plain, rich) is None


def test_a_special_case_fits_about_as_well_as_the_law_that_contains_it_where_both_are_true(found):
    rich, plain = (alone(found, name) for name in ("asymmetric_coulomb_friction", "coulomb_friction"))
    assert plain.fit.cost - rich.fit.cost < 3.0
    ratio = plain.model.value("coulomb_friction.transition") / rich.model.value(
        "asymmetric_coulomb_friction.transition"
    )
    assert 0.5 < ratio < 2.0


def test_related_laws_are_represented_by_one_that_replaces_the_simplest_though_another_predicts_more_blocks_better():
    nominal, richer = supposed("", predicted(1.0)), {"coulomb": ("asymmetric", "stribeck")}
    asymmetric = supposed(
        "asymmetric", predicted(0.055, 750.0), free=9
    )  # removes too little of what the plain one leaves
    stribeck = supposed("stribeck", predicted(0.01, 720.0), free=9)
    plain = supposed("coulomb", predicted(0.06, 500.0), richer=richer)
    made = contest(nominal, asymmetric, stribeck, plain)
    laws = [asymmetric, stribeck, plain]

    def of(*order: int) -> str:
        (name,) = laws[
            represented(laws, order, lambda index, *others: made.claim(laws[index], *others))
        ].names
        return name

    assert (of(0, 1, 2), of(0, 2), of(1, 2), of(2)) == ("stribeck", "coulomb", "stribeck", "coulomb")
