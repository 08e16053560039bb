"""A link's mass and centre of mass are causes only where the records contradict the file's."""

import numpy as np
import pytest

from rhythmid.body.link_inertia import Principal
from rhythmid.diagnose.joints.link_centre import Load, fitted_body

OWN = Principal(2.0, np.full(3, 0.01), np.array([0.0, 0.0, -0.2]), np.array([1.0, 0.0, 0.0, 0.0]))
# what a joint feels of a link that hangs from it and turns about x: mass times distance, and inertia about the joint
GRAVITY, TURNING = 3, 4


@pytest.mark.parametrize(("shift", "cause"), [(0.05, True), (0.02, False), (0.0, False)])
def test_a_centre_that_the_records_do_not_move_is_no_cause_whatever_the_evidence(shift, cause):
    moved = Principal(OWN.mass, OWN.moments, np.array([0.0, 0.0, -0.2 + shift]), OWN.turn)
    found = Load(moved.ten, np.diag([0.0, *(3 * [1e-4])]), OWN, np.zeros(3), 100.0)
    assert found.moved == found.better == found.as_good == cause


def felt(heavier: Principal, above: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Residuals and columns, in units of the noise, of the joint of a link, and of a joint one metre `above` it."""
    rng = np.random.default_rng(1)
    change = heavier.ten - OWN.ten
    made = []
    for arm in (0.0, 1.0)[: 2 if above else 1]:
        columns = np.zeros((400, 10))
        angle, acceleration = rng.uniform(-1.0, 1.0, (2, 400))
        columns[:, GRAVITY] = 100.0 * np.sin(angle) - 200.0 * arm * acceleration
        columns[:, 0] = arm * (100.0 * np.sin(angle) + 100.0 * acceleration)
        columns[:, TURNING] = 100.0 * acceleration
        made.append((rng.normal(size=400) - columns @ change, columns))
    return made


def fitted(heavier: Principal, above: bool) -> Load:
    ten = OWN.ten
    for _ in range(3):
        rows = [(left + columns @ (ten - OWN.ten), columns) for left, columns in felt(heavier, above)]
        ten, covariance = fitted_body(rows, OWN, ten)
    return Load(ten, covariance, OWN, np.zeros(3), 0.0)


def test_one_joint_tells_the_first_moment_of_a_heavier_link_and_not_its_mass_which_the_joint_above_tells():
    heavier = Principal(5.0, np.full(3, 0.04), np.array([0.0, 0.0, -0.3]), OWN.turn)
    one, two = fitted(heavier, above=False), fitted(heavier, above=True)
    assert one.first_moment.value == pytest.approx(1.5, abs=0.03)
    assert one.mass_value.std / one.mass > 50.0 * one.first_moment.std / one.first_moment.value
    assert one.mass_value.std > 20.0 * two.mass_value.std
    assert abs(one.mass - 5.0) < 2.0 * one.mass_value.std
    assert two.mass == pytest.approx(5.0, abs=0.05) and two.mass_moved and two.moved
    assert two.place[2] == pytest.approx(-0.3, abs=0.01)


def test_joints_that_disagree_about_a_mass_widen_its_interval():
    heavier = Principal(5.0, np.full(3, 0.04), np.array([0.0, 0.0, -0.3]), OWN.turn)
    rows = felt(heavier, above=True)
    louder = [rows[0], (1.3 * rows[1][0], rows[1][1])]
    third = felt(heavier, above=True)[1]
    stds = [np.sqrt(fitted_body(one, OWN, OWN.ten)[1][0, 0]) for one in ([*rows, third], [*louder, third])]
    assert stds[1] > 3.0 * stds[0]


def test_a_fitted_body_is_one_that_can_exist():
    heavier = Principal(5.0, np.array([0.04, 0.04, 0.01]), np.array([0.0, 0.0, -0.3]), OWN.turn)
    assert Principal.from_ten(fitted(heavier, above=True).ten).possible
