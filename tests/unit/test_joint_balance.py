"""The effort of each of several joints, and what it tells of paths and links."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from legged import MODELS, fixed_leg, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, size_of
from rhythmid.identify.joints.base_parameters import from_cholesky, to_cholesky
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.joints.joint_stretch import joint_stretches

MIDDLES = {"hip": (0.4, 0.3), "knee": (-1.2, 0.3)}


@pytest.fixture(scope="module")
def air(tmp_path_factory) -> Machine:
    return Machine.load(fixed_leg(tmp_path_factory.mktemp("air")))


def swung(machine: Machine, seconds: float = 6.0, **clutter):
    rng = np.random.default_rng(5)
    time = np.arange(0.0, seconds, 0.002)
    return recorded(machine, references(MIDDLES, time, rng, (0.4, 4.0)), time, rng, **clutter)


def test_friction_and_inertia_of_each_joint_come_out_of_its_effort(air: Machine):
    plant = air.with_element("knee", load_catalogue()["coulomb_friction"], {"force": 0.3, "transition": 0.02})
    plant = plant.with_inertial({"hip.armature": 0.009})
    balances = JointBalances.of(plant.with_inertial({"hip.armature": 0.006}), [swung(plant)])
    knee = fit_effort(balances.balance("knee"), balances.models["knee"])
    assert knee.model.value("coulomb_friction.force") == pytest.approx(0.3, abs=0.01)
    assert knee.error < 0.05 * size_of(balances.balance("knee"))
    model = balances.models["hip"]
    hip = fit_effort(balances.balance("hip"), replace(model, mass=replace(model.mass, fixed=False)))
    assert hip.model.mass.value - model.mass.value == pytest.approx(0.003, abs=2e-4)


def test_what_is_recorded_in_contact_is_left_out():
    machine = Machine.load(MODELS / "leg.yaml")
    time = np.arange(0.0, 3.0, 0.002)
    rng = np.random.default_rng(1)
    wave = 0.33 * np.sin(12.0 * time)
    record = recorded(machine, {"hip": 0.6 + wave, "knee": -1.2 - 2.0 * wave}, time, rng)
    found = joint_stretches(machine, [record])
    assert len(found) > 1
    poses = np.concatenate([one.pose for one in found])
    assert not machine.body.touches(poses).any()
    with pytest.raises(InputError, match="'rail', which is not recorded"):
        joint_stretches(machine, [replace(record, base=None)])


def test_without_a_recorded_effort_the_controllers_gains_make_it(air: Machine):
    plant = air.with_values({"hip.input_delay.delay": 0.012, "knee.input_delay.delay": 0.012})
    plant = plant.with_values({"knee.viscous_damper.damping": 0.12})
    found = identify_machine([swung(plant, with_effort=False)], air)
    assert found.parameters["knee.viscous_damper.damping"].value == pytest.approx(0.12, abs=0.03)
    assert found.parameters["knee.input_delay.delay"].value == pytest.approx(0.012, abs=0.002)
    assert max(found.free_run["identified"].values()) < 0.02 < max(found.free_run["given"].values())
    assert any("armature and delay" in line for line in found.not_separable)


def test_samples_at_a_limit_of_one_joints_sensor_are_left_out_and_told(air: Machine):
    record = swung(air)
    knee = record.joints["knee"]
    limit = float(np.quantile(knee.output.value, 0.93))
    clipped = replace(knee, output=replace(knee.output, value=np.minimum(knee.output.value, limit)))
    record = replace(record, joints={**record.joints, "knee": clipped})
    found = identify_machine([record], air)
    assert sum("knee: samples of the output that are clipped at" in note for note in found.notes) == 1
    damping = found.parameters["knee.viscous_damper.damping"]
    assert damping.value == pytest.approx(air.value("knee.viscous_damper.damping"), abs=3.0 * damping.std)


@given(st.lists(st.floats(-2.0, 2.0), min_size=10, max_size=10))
def test_every_factor_is_a_link_that_can_be_and_comes_back(entries: list[float]):
    inertial = from_cholesky(np.array(entries))
    mass, about = inertial[0], inertial[4:7]
    assert mass > 0.0 and (about > 0.0).all()
    assert 2.0 * about.max() <= about.sum() * (1.0 + 1e-9)  # moments of inertia obey the triangle inequality
    np.testing.assert_allclose(from_cholesky(to_cholesky(inertial)), inertial, rtol=1e-4, atol=1e-5)
