"""Location: free maps beside a fit tell which quantity a missing force goes with, and draw it."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose.contenders import Rows, linearised, rows_of
from rhythmid.diagnose.evidence import cross_validate
from rhythmid.diagnose.free_functions import free_functions, stretched
from rhythmid.diagnose.location import Dependence, beside, dependences, following, reach_of
from rhythmid.diagnose.search.score_tests import Trajectories, trajectories
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import hold_out_tail, prepare

NOISE = NoiseModel(np.empty(0), 0.5e-4)
LACKING = {
    "cubic_stiffness": ("position", {"coefficient": 2e3}),
    "coulomb_friction": ("velocity", {"force": 0.05, "transition": 0.01}),
    "actuator_saturation": ("actuator force", {"limit": 1.7}),
    "bouc_wen_hysteresis": ("past position", {"stiffness": 30.0, "yield_displacement": 3e-3}),
    "second_mode": ("past velocity", {"mass": 0.2, "frequency": 5.0, "damping_ratio": 0.15}),
    "": ("nothing", {}),
}


@dataclass(frozen=True)
class Left:
    """What a hopper without an effect leaves of records of one with it."""

    name: str
    known: Trajectories
    rows: Rows
    found: list[Dependence]

    @property
    def quantity(self) -> str:
        return LACKING[self.name][0]

    def of(self, quantity: str) -> Dependence:
        return next(one for one in self.found if one.quantity == quantity)


@cache
def left_by(name: str) -> Left:
    machine = hopper().with_element(CATALOGUE[name], LACKING[name][1]) if name else hopper()
    series = hold_out_tail(prepare(records(machine, SHORT), 4))[0]
    known = trajectories(estimate(hopper(), series, noise=NOISE, max_step=1e-3))
    rows = rows_of(series, [], NOISE)
    return Left(name, known, rows, dependences(known, rows))


@pytest.fixture(scope="module", params=["cubic_stiffness", "coulomb_friction", "actuator_saturation"])
def left(request) -> Left:
    return left_by(request.param)


def test_the_quantity_on_which_the_missing_force_depends_explains_most(left):
    # springs that slip at once are dry friction
    near = {"velocity": "past position"}.get(left.quantity, left.quantity)
    others = [
        one.explained for one in left.found if left.quantity not in one.quantity and one.quantity != near
    ]
    assert left.found[0].quantity == left.quantity
    assert left.of(left.quantity).explained > max(0.8, max(others) + 0.3)
    ranked = [one.explained for one in left.found]
    assert ranked == sorted(ranked, reverse=True)


def test_what_a_part_on_a_spring_does_depends_on_past_velocity():
    one = left_by("second_mode")
    assert one.of("past velocity").explained > 0.9
    assert one.of("velocity").explained < 0.3  # of the instant alone it does not


def test_what_slips_after_a_while_depends_on_past_position():
    one = left_by("bouc_wen_hysteresis")
    assert one.found[0].quantity == "past position" and one.found[0].explained > 0.8
    assert one.of("position").explained < 0.8 and one.of("velocity").explained < 0.8


@given(
    st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=50).map(np.array),
    st.floats(0.01, 5.0),
)
def test_a_spring_slips_at_its_limit_and_follows_the_signal_below_it(values, most):
    stretch = stretched(values, most)
    assert stretch[0] == 0.0 and (np.abs(stretch) <= most + 1e-12).all()
    slips = np.abs(stretch) >= most - 1e-12
    np.testing.assert_allclose(np.diff(stretch)[~slips[1:]], np.diff(values)[~slips[1:]], atol=1e-12)


def test_a_free_map_predicts_rows_that_no_fit_has_seen_as_well_as_those_left_out_in_turn(left):
    plain = linearised(left.known.fit, left.rows).residual
    found = left.of(left.quantity).found.error
    for rows in (left.rows.heldout, ~left.rows.heldout):
        assert np.sum(found[rows] ** 2) < 0.3 * np.sum(plain[rows] ** 2)


def test_a_free_map_predicts_separate_records_as_well_as_those_that_the_fit_saw(left):
    seen, machine = (
        left.known.fit.run.series,
        hopper().with_element(CATALOGUE[left.name], LACKING[left.name][1]),
    )
    other = [replace(one, name=f"{one.name} again") for one in prepare(records(machine, SHORT), 4)]
    rows = rows_of(seen, other, NOISE)
    found = next(one for one in dependences(left.known, rows) if one.quantity == left.quantity).found
    alone = linearised(left.known.fit, rows).residual
    separate = np.zeros(len(alone), bool)
    separate[len(left.rows.record) :] = True
    assert separate.any() and np.sum(found.error[separate] ** 2) < 0.3 * np.sum(alone[separate] ** 2)


def test_where_nothing_is_missing_nothing_is_explained():
    assert max(one.explained for one in left_by("").found) < 0.3


def test_the_law_of_the_missing_force_is_drawn():
    one = left_by("coulomb_friction").of("velocity")
    fast = 0.1 * np.abs(one.grid).max()
    # a constant part is the rest length's, which is free beside the map
    back, forth = np.median(one.force[one.grid < -fast]), np.median(one.force[one.grid > fast])
    assert 0.5 * (back - forth) == pytest.approx(0.05, rel=0.5)
    assert np.corrcoef(one.force, -np.tanh(one.grid / 0.05))[0, 1] > 0.8


def test_a_free_map_is_one_more_hypothesis_on_the_same_rows():
    left = left_by("cubic_stiffness")
    fit, rows = left.known.fit, left.rows
    reach = reach_of(fit, rows)
    base = following(linearised(fit, rows), rows, reach)
    position = next(one for one in free_functions(left.known) if one.quantity == "position")
    wide, count = beside(fit, base, position, rows, reach), len(position.columns)
    assert wide.jacobian.shape == (len(base.residual), base.jacobian.shape[1] + count)
    np.testing.assert_array_equal(wide.residual, base.residual)
    assert (wide.precision[-count:] > 0.0).all()
    # both the map and the parameters that make room for it reach the hidden ends of the records
    hidden = wide.jacobian[rows.fitted :]
    assert np.abs(hidden[:, -count:]).max() > 0.0 and np.abs(hidden[:, :-count]).max() > 0.0
    np.testing.assert_array_equal(
        cross_validate(wide, rows.blocks).error,
        next(d for d in left.found if d.quantity == "position").found.error,
    )


def test_what_parameters_do_to_hidden_rows_is_what_they_do_to_seen_ones():
    # a record whose hidden half repeats the seen one: the same change by the same parameter
    left = left_by("")
    fit, rows = left.known.fit, left.rows
    name = fit.names.index("linear_spring.rest_length")
    for one, seen in zip(reach_of(fit, rows), fit.linearisation.pieces):
        hidden, told = one.parameters[:, name], fit.linearisation.jacobian[seen, name]
        assert np.median(hidden) == pytest.approx(
            np.median(told), rel=0.05
        )  # the rest length lifts all alike
