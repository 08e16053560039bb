"""A law at the limit of its range, where it is another law that was fitted, too, gives way to that law in a search."""

from dataclasses import replace

import numpy as np

from machines import CATALOGUE
from rhythmid.diagnose.search.limit_law import without_limits
from rhythmid.diagnose.search.trial import Trial
from rhythmid.identify.descent import WHITE
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.model import Model

TIME = 5e-3 * np.arange(2000)
SERIES = [Series("made", TIME, np.sin(6.0 * TIME), None, None, 1, np.ones(len(TIME), bool), 5e-3)]
BARE = Model.from_text("inertia: {mass: 1.0}\nforce: [{viscous_damper: {damping: 1.0}}]", catalogue=CATALOGUE)
KNOWN = CATALOGUE.within(scales(SERIES, BARE))


def fitted(name: str, chi2: float, **values: float) -> Trial:
    """A trial with this element more."""
    return Trial((name,), BARE.with_element(KNOWN[name], values), (), chi2, 2000, 3, True, WHITE)


SPRING = fitted("linear_spring", 101.0, stiffness=40.0)
YIELDING = fitted("elastoplastic_hysteresis", 100.0, stiffness=40.0, yield_displacement=0.3)
MOST = KNOWN["elastoplastic_hysteresis"].parameter("yield_displacement").bounds[1]
NEVER_YIELDING = fitted("elastoplastic_hysteresis", 100.0, stiffness=40.0, yield_displacement=MOST)


def test_a_hysteresis_that_never_yields_gives_way_to_the_spring_that_it_is():
    assert without_limits([NEVER_YIELDING, SPRING], SERIES) == [SPRING]


def test_a_hysteresis_that_yields_or_has_no_rival_stays():
    assert without_limits([YIELDING, SPRING], SERIES) == [YIELDING, SPRING]
    assert without_limits([NEVER_YIELDING], SERIES) == [NEVER_YIELDING]


def test_only_models_with_the_same_other_effects_are_compared():
    other = replace(SPRING, added=("quadratic_drag", "linear_spring"))
    assert without_limits([NEVER_YIELDING, other], SERIES) == [NEVER_YIELDING, other]
