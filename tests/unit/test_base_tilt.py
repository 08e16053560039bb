"""A tilt of the base is one cause of all joints, found from their efforts together, and not a law of each of them."""

from dataclasses import replace

import numpy as np
import pytest
from legged import recorded, references, two_links

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.base_tilt import BaseTilt, directions_of, turned
from rhythmid.diagnose.joints.joint_diagnosis import MachineAnswer, diagnose_machine
from rhythmid.diagnose.joints.joint_rows import in_units_of_noise
from rhythmid.elements.catalogue import Catalogue, load_catalogue

LAWS = ("viscous_damper", "coulomb_friction", "constant_force", "pendulum_gravity")
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return two_links(tmp_path_factory.mktemp("arm"))


def diagnosed(plant: Machine, nominal: Machine) -> MachineAnswer:
    known, time, rng = load_catalogue(), np.arange(0.0, 4.0, 0.002), np.random.default_rng(4)
    asked = references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0))
    few = Catalogue({name: known[name] for name in LAWS})
    record = replace(recorded(plant, asked, time, rng), sampled="mean")
    return diagnose_machine([record], nominal, catalogue=few)


def test_a_tilted_base_is_named_once_beside_a_friction_and_not_as_a_law_of_each_joint(arm: Machine):
    plant = arm.with_gravity(turned(GRAVITY, np.array([[1.0, 0.0, 0.0]]), np.radians([4.0])))
    plant = plant.with_element(
        "one", load_catalogue()["coulomb_friction"], {"force": 1.0, "transition": 0.03}
    )
    answer = diagnosed(plant, arm)
    found = answer.diagnosis
    assert {(one.joint, one.element) for one in found.missing} == {
        (None, "base_tilt"),
        ("one", "coulomb_friction"),
    }
    (tilt,) = [one for one in found.missing if one.joint is None]
    angle = tilt.parameters["angle"]
    assert angle.std is not None and angle.std < 0.2
    assert angle.value == pytest.approx(4.0, abs=max(4.0 * angle.std, 0.1))
    assert answer.machine.body.gravity == pytest.approx(plant.body.gravity, abs=0.03)
    # the joints turn about y, so that no effort says how far the base leans that way
    assert tilt.parameters["y"].std is None
    assert "a tilt towards [0, 1, 0] is not determined" in found.summary
    assert found.summary.startswith("The base is tilted by ") and "write  gravity: [" in found.summary
    # the errors before are those of the model as it was given
    two = found.joints["two"]
    before, after = (two.fit[name].heldout_nrmse for name in ("refitted_nominal", "augmented"))
    assert two.verdict == "consistent" and before is not None and after is not None and before > 2.0 * after


def test_an_upright_base_is_not_named(arm: Machine):
    assert not diagnosed(arm, arm).diagnosis.missing


def test_joints_that_feel_gravity_only_along_itself_determine_no_tilt():
    rng = np.random.default_rng(1)
    residual = rng.normal(size=300)
    record = np.zeros(300, dtype=np.int64)

    def found(weight: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        return directions_of([in_units_of_noise(residual, weight, np.ones((300, 1)), record)], GRAVITY)

    directions, _ = found(np.tile([0.0, 0.0, 5.0], (300, 1)))
    assert not len(directions)
    directions, unknown = found(np.column_stack([rng.normal(size=300), np.zeros(300), rng.normal(size=300)]))
    assert np.abs(directions) == pytest.approx(np.array([[1.0, 0.0, 0.0]]))
    assert unknown is not None and np.abs(unknown) == pytest.approx(np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize(("degrees", "cause"), [(2.0, True), (0.2, False)])
def test_a_tilt_within_its_interval_is_no_cause(degrees: float, cause: bool):
    covariance = np.array([[np.radians(0.1) ** 2]])
    tilt = BaseTilt(GRAVITY, np.array([[1.0, 0.0, 0.0]]), np.radians([degrees]), covariance, None, 100.0)
    assert tilt.moved is cause
    assert np.linalg.norm(tilt.gravity) == pytest.approx(9.81)
    assert tilt.angle.std == pytest.approx(0.1)
