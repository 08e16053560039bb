"""A link's centre of mass is a cause only where the records contradict the file's."""

import numpy as np
import pytest

from rhythmid.diagnose.joints.link_centre import Centre


@pytest.mark.parametrize(("shift", "cause"), [(0.05, True), (0.02, False), (0.0, False)])
def test_a_centre_that_the_records_do_not_move_is_no_cause_whatever_the_evidence(shift, cause):
    found = Centre(np.array([0.0, 0.0, -0.2 + shift]), np.full(3, 0.01), np.array([0.0, 0.0, -0.2]), 100.0)
    assert found.moved == found.better == found.as_good == cause
