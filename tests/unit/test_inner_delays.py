"""Dead times inside the machine are told where the records tell them, and refused with the sum and the reason where not."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.bound import cramer_rao
from rhythmid.identify.identifiability import delays_of
from rhythmid.identify.inner_delays import unnoticed
from rhythmid.identify.joint import JointFit, fit_from, joint_likelihood
from rhythmid.identify.search_quality import Search
from rhythmid.ltp.pumping import pumping_of
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate

CATALOGUE = load_catalogue()
MACHINE = """
inertia: {{mass: {{value: 1.0, unit: kg, fixed: true}}}}
command:
  - input_delay: {{delay: {{value: 0.02, unit: s}}}}
{controller}
force:
  - linear_spring: {{stiffness: {{value: 200.0, unit: N/m}}, rest_length: {{value: 0.0, unit: m, fixed: true}}}}
  - viscous_damper: {{damping: {{value: 3.0, unit: N*s/m}}}}
sensor: [{{measurement_delay: {{delay: {{value: 0.03, unit: s}}}}}}]
"""
LATE_SERVO = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command:
  - input_delay: {delay: {value: 0.0254, unit: s}}
  - position_control: {proportional: {value: 77.0, unit: N/m, fixed: true}, derivative: {value: 10.5, unit: N*s/m, fixed: true}}
  - feedback_delay: {delay: {value: 0.0129, unit: s}}
force:
  - linear_spring: {stiffness: {value: 12.7, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.5, unit: N*s/m}}
sensor: [{measurement_delay: {delay: {value: 0.0, unit: s, fixed: true}}}]
"""
CONTROLLER = "  - position_control: {proportional: {value: 300.0, fixed: true}, derivative: {value: 14.0, fixed: true}}"
TIME = np.arange(0.0, 5.0, 5e-3)
COMMAND = np.cos(2.0 * np.pi * np.multiply.outer(TIME, np.geomspace(0.3, 5.0, 8)) + np.arange(8.0) ** 2).sum(
    axis=1
)
NOISE = 1e-4
INSIDE = {"actuator_delay": 0.012, "feedback_delay": 0.008}


def forcing(time: np.ndarray) -> np.ndarray:
    return 3.0 * np.cos(2.0 * np.pi * 1.3 * time)


def fitted(controlled: bool, names: tuple[str, ...], forced: bool) -> tuple[JointFit, Model, Record]:
    """A machine with these dead times, its record, and the fit from values that are a little off."""
    machine = Model.from_text(
        MACHINE.format(controller=CONTROLLER if controlled else ""), catalogue=CATALOGUE
    )
    for name in names:
        machine = machine.with_element(CATALOGUE[name], {"delay": INSIDE[name]})
    command = COMMAND * (0.03 if controlled else 2.0)
    dense = np.arange(-1.0, 9.0, 1e-3)
    pump: PPoly | None = spline(dense, forcing(dense)) if forced else None
    output = simulate(machine, TIME, zero_order_hold(TIME, command), pump).output
    measured = output + NOISE * np.random.default_rng(3).standard_normal(len(TIME))
    record = Record(
        "machine", Channel(TIME, measured, "m"), Channel(TIME, command, "m" if controlled else "N"),
        Channel(TIME, forcing(TIME), "N") if forced else None, input_kind="reference" if controlled else "force",
    )  # fmt: skip
    off = {f"{name}.delay": INSIDE[name] + 0.002 for name in names} | {"linear_spring.stiffness": 203.0}
    fit = fit_from(machine.with_values(off), record)
    return JointFit(fit, pumping_of(record), Search(0.0, 0.0, 1.0), (record,)), machine, record


@pytest.mark.parametrize(("name", "forced"), [("actuator_delay", True), ("feedback_delay", False)])
def test_a_dead_time_in_a_controllers_loop_is_told_as_well_as_the_bound_says(name, forced):
    joint, machine, record = fitted(True, (name,), forced)
    delays = delays_of(joint, "on_robot" if forced else None)
    found = delays.inner[name]
    assert found.separable and delays.separable is forced
    assert found.delay.value == pytest.approx(INSIDE[name], abs=4.0 * found.delay.std)
    assert found.delay.std == pytest.approx(cramer_rao(machine, record, NOISE).std[f"{name}.delay"], rel=0.2)
    for known, value in (
        ((delays.input, 0.02), (delays.measurement, 0.03)) if forced else ((delays.sum, 0.05),)
    ):
        assert known.value == pytest.approx(value, abs=4.0 * known.std)


def test_without_a_controller_only_the_sum_with_the_measurement_delay_is_told():
    joint, _, _ = fitted(False, ("actuator_delay",), True)
    delays = delays_of(joint, "on_robot")
    found = delays.inner["actuator_delay"]
    assert not found.separable and not delays.separable
    assert found.delay.value is None and delays.measurement.value is None and delays.sum.value is None
    assert delays.input.value == pytest.approx(0.02, abs=4.0 * delays.input.std)
    assert set(found.sums) == {"measurement_delay"}
    total = found.sums["measurement_delay"]
    assert total.value == pytest.approx(0.042, abs=4.0 * total.std) and total.std < 1e-3
    assert found.reason == delays.assumption
    assert found.reason == "only the sum of actuator_delay with measurement_delay is identifiable"
    assert delays.to_dict()["inner"]["actuator_delay"]["sums"]["measurement_delay"]["value"] == total.value


def test_without_forcing_or_controller_only_the_sum_of_all_delays_is_told():
    joint, _, _ = fitted(False, ("actuator_delay",), False)
    joint_with_both = delays_of(joint)
    found = joint_with_both.inner["actuator_delay"]
    assert not found.separable and joint_with_both.input.value is None
    names = [name for name in joint.fit.names if name.endswith("delay.delay")]
    assert len(unnoticed(joint.fit, names)) == len(names) - 1
    (total,) = found.sums.values()
    assert total.value == pytest.approx(0.062, abs=4.0 * total.std)


def test_two_dead_times_in_one_loop_show_their_sum():
    joint, _, _ = fitted(True, ("actuator_delay", "feedback_delay"), True)
    delays = delays_of(joint, "on_robot")
    assert set(delays.inner["actuator_delay"].sums) == {"feedback_delay", "measurement_delay"}
    assert delays.inner["actuator_delay"].sums["feedback_delay"].value == pytest.approx(0.02, abs=2e-4)
    assert delays.inner["feedback_delay"].reason == (
        "only the sum of feedback_delay with actuator_delay is identifiable"
    )
    assert delays.input.value == pytest.approx(0.02, abs=4.0 * delays.input.std)


def test_a_late_feedback_is_found_from_values_that_know_of_no_delay():
    """From zero delays a search used to end where damping and a far longer dead time stand in for the true ones."""
    machine = Model.from_text(LATE_SERVO, catalogue=CATALOGUE)
    time = np.arange(0.0, 10.0, 5e-3)
    tones = 1.4 * np.geomspace(0.1, 1.6, 8)
    asked = 0.1 * np.cos(2.0 * np.pi * np.multiply.outer(time, tones) + np.arange(8.0) ** 2).sum(axis=1)
    run = simulate(machine, time, zero_order_hold(time, asked), max_step=1e-3)
    noise = 2e-3 * float(np.std(run.output))
    measured = run.output + noise * np.random.default_rng(3).standard_normal(len(time))
    record = Record("servo", Channel(time, measured, "m"), Channel(time, asked, "m"), input_kind="reference")
    ignorant = machine.with_values(
        {"feedback_delay.delay": 0.0, "input_delay.delay": 0.0, "measurement_delay.delay": 0.0, "linear_spring.stiffness": 16.0,
         "viscous_damper.damping": 1.9}
    )  # fmt: skip
    found = joint_likelihood(record, ignorant)
    told = delays_of(found, None).inner["feedback_delay"].delay
    bound = cramer_rao(machine, record, noise).std["feedback_delay.delay"]
    assert told.value is not None and told.std is not None
    assert abs(told.value - 0.0129) < 4.0 * bound and told.std < 1.3 * bound
