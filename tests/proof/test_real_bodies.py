"""Real machines of one hinge as bodies: the diagnosis of several joints names what that of one axis names. Skipped without the recordings."""

from pathlib import Path

import pytest
from real_bodies import pendulum
from recording_sets import data_folder

from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine


@pytest.mark.skipif(not (data_folder() / "pendulum").is_dir(), reason="the recordings are not there")
def test_the_pendulums_friction_is_what_its_body_lacks(tmp_path: Path):
    case = pendulum(data_folder() / "pendulum", tmp_path)
    answer = diagnose_machine(case.train, case.machine, case.holdout)
    assert answer.diagnosis.joints["shoulder"].missing[0].element == "coulomb_friction"
    moment = 0.5 * 9.81 * answer.machine.body.parameters["rod.mass"]
    assert moment == pytest.approx(0.36 * 9.81, rel=0.1)  # by hand, docs/real.md
    inertia = answer.machine.paths["shoulder"].mass.value
    assert inertia == pytest.approx(0.1805, rel=0.1)
