"""What a plant with an element records is what the estimators simulate with it: one law on both ways."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.elements.element import Scales
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import start_only
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import prepare

# without forcing, and of single samples: the models are those that test_element_catalogue compiles
PROTOCOL, DELAYS = ((SHORT[1][0], 0.0),), (0.0203, 0.0151)
WHITE = NoiseModel(np.empty(0), 1e-4)
ADDABLE = [
    name
    for name, element in CATALOGUE.items()
    if element.candidate and not (element.rotational or element.controlled or element.displaced_base)
]


@pytest.fixture(scope="module")
def sizes() -> Scales:
    return replace(scales(prepare(records(hopper(), PROTOCOL), 1), hopper()), residual_frequency=2.3)


@pytest.mark.parametrize("name", ADDABLE)
def test_records_of_a_plant_with_an_element_are_explained_to_the_noise_by_the_model_with_it(name, sizes):
    element = CATALOGUE[name].within(sizes)
    assert element.starts is not None
    machine = hopper().with_element(element, element.starts(sizes)[0])
    series = prepare(records(machine, PROTOCOL, delays=DELAYS), 1)
    late = machine.with_values({"input_delay.delay": DELAYS[0], "measurement_delay.delay": DELAYS[1]})
    fit = start_only(late, series, WHITE, max_step=1e-3)
    assert fit.chi2 / fit.samples == pytest.approx(1.0, abs=0.1)
