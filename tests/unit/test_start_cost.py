"""States of elements that start where they like are no advantage over a model that has none."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.multiple_shooting import windows
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import Series, prepare
from rhythmid.identify.start_cost import felt_starts, start_cost, start_freedom
from rhythmid.model import INERTIA, Model

NOISE = NoiseModel(np.empty(0), 0.5e-4)  # of averages of four samples
DELAYS = {"input_delay.delay": 0.0203, "measurement_delay.delay": 0.0151}


def started(model: Model, series: list[Series]) -> Fit:
    """The model with its values as they are, its starts fitted."""
    return minimise(model, prepare_run(model, series, 1e-3), (), NOISE)


def cost_of(fit: Fit) -> float:
    return start_cost(
        felt_starts(fit.model, fit.run, fit.noise, fit.starts, fit.residuals, fit.differences[1])
    )


def freedom_of(fit: Fit) -> float:
    return start_freedom(
        felt_starts(fit.model, fit.run, fit.noise, fit.starts, fit.residuals, fit.differences[1])
    )


def test_a_model_without_states_of_elements_pays_nothing():
    series = prepare(records(hopper(), SHORT[:1]), 4)
    plain = started(hopper().with_values(DELAYS), series)
    assert cost_of(plain) == freedom_of(plain) == 0.0


def test_starts_that_are_felt_are_parameters_and_those_that_are_not_are_none():
    lag = hopper().with_values(DELAYS).with_element(CATALOGUE["actuator_lag"], {"time_constant": 0.03})
    series = prepare(records(lag, SHORT), 4)
    assert freedom_of(started(lag, series)) == pytest.approx(len(series), abs=0.2)
    fast = lag.with_values({"actuator_lag.time_constant": 1e-6})
    assert freedom_of(started(fast, series)) == pytest.approx(0.0, abs=0.01)


def test_the_cost_is_that_of_the_likelihood_averaged_over_the_starts_by_brute_force():
    lagging = hopper().with_element(CATALOGUE["actuator_lag"], {"time_constant": 0.03})
    series = prepare(records(lagging, SHORT[:1]), 4)
    fit = started(lagging.with_values(DELAYS), series)
    problem = Problem(fit.run, (), NOISE, None)
    problem.learn_hidden(fit.model, fit.starts)
    mean, scatter = (float(one[0]) for one in problem.hidden[0])

    def white(start: np.ndarray) -> np.ndarray:
        outputs = fit.run.outputs(fit.model, [start])
        assert outputs is not None
        return problem.whitened(0, outputs[0] - series[0].averaged)

    here = white(fit.starts[0])
    moves = fit.differences[1]
    turned = np.column_stack([(white(fit.starts[0] + row) - here) for row in np.diag(moves)[:2]])
    others, _ = np.linalg.qr(turned)

    def exponent(hidden: float) -> float:
        start = fit.starts[0].copy()
        start[2] = hidden
        error = white(start)
        error = error - others @ (others.T @ error)
        return float(np.sum(error**2)) + ((hidden - mean) / scatter) ** 2

    grid = mean + scatter * np.linspace(-4.0, 4.0, 801)
    values = np.array([exponent(hidden) for hidden in grid])
    average = np.trapezoid(np.exp(-0.5 * (values - fit.chi2)), grid) / (scatter * np.sqrt(2.0 * np.pi))
    assert cost_of(fit) == pytest.approx(-2.0 * np.log(average), abs=0.2)


def test_over_many_windows_a_loose_mass_that_is_not_there_gains_by_its_starts_but_not_in_the_criterion():
    cut = windows(prepare(records(hopper(), SHORT), 4), 0.25)
    model = hopper().with_values(DELAYS)
    mass = 0.005 * model.mass.value
    lighter = model.with_parameters({INERTIA: replace(model.mass, value=model.mass.value - mass)})
    # the weight of what is loose rests on the spring all the same
    sunk = mass * model.value("gravity.acceleration") / model.value("linear_spring.stiffness")
    lighter = lighter.with_values({"linear_spring.rest_length": 0.2 - sunk})
    mode = {"mass": mass, "frequency": 40.0, "damping_ratio": 0.01}
    loose = started(lighter.with_element(CATALOGUE["second_mode"], mode), cut)
    hidden = 2 * len(cut)
    assert hidden > 100
    gained = started(model, cut).chi2 - loose.chi2
    assert 0.2 * hidden < gained < 1.2 * hidden  # about one a start that is felt
    assert cost_of(loose) > gained
