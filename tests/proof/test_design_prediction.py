"""What a design predicts is what its file then gives: scatter of the joint fit over noise drawn anew.

`benchmarks/design_prediction.py` does the same with more runs, for combs of tones too, and on larger designs.
"""

import pytest

from machines import HOPPER, hopper
from rhythmid.design.design_folder import EXPERIMENT, save_design
from rhythmid.design.designer import design
from rhythmid.design.requirements import Requirements
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import planned_record
from rhythmid.identify.joint import fit_from
from rhythmid.identify.monte_carlo import Drawn, noisy, scatter

WANTED = Requirements(
    duration=40.0, band=(0.3, 5.0), max_effort=0.05, envelope=(0.12, 0.18), noise_std=2e-5, rate=250, harmonics=2,
    input_delay=0.0403, measurement_delay=0.0551,
)  # fmt: skip
RUNS = 100  # the scatter of a scatter is 7 % then; the draws are fixed
OFF = {
    "linear_spring.stiffness": 202.0,
    "switched_damper.stance": 2.05,
    "input_delay.delay": 0.043,
    "measurement_delay.delay": 0.054,
}


def test_the_predicted_standard_deviations_are_within_a_fifth_of_monte_carlo(tmp_path):
    made = design(hopper(), WANTED)
    save_design(made, HOPPER, tmp_path / "design")
    record = planned_record(Experiment.load(tmp_path / "design" / EXPERIMENT))
    machine = made.prediction.fit.model
    start = machine.with_values(OFF)
    found = [
        Drawn.of(fit_from(start, noisy(record, WANTED.noise_std, seed)), machine.free) for seed in range(RUNS)
    ]
    predicted = made.prediction.parameters | {
        f"{which}_delay.delay": estimate
        for which, estimate in made.prediction.delays.items()
        if which != "sum"
    }
    assert sorted(predicted) == sorted(machine.free)
    for name, estimate in predicted.items():
        scattered = scatter(found, name, machine.value(name))
        assert scattered.std == pytest.approx(estimate.std, rel=0.2), name
        assert abs(scattered.bias) < 0.5 * estimate.std, name
