"""Dead times concealed inside random machines: how often the 95 % interval contains the true one, and the answer if it is not identifiable.

    python benchmarks/inner_delays.py [--seed 0] [--cases 50] [--only feedback_delay] [--workers 2]

Three kinds of machine, each with its own input and measurement delays: a position servo whose drive is late
(`actuator_delay`), one whose controller gets the motion late (`feedback_delay`), both with a forcing generated on the robot in every
other case; and a forced machine without a controller whose drive is late, where only the sum with the measurement delay is identifiable.
Records are simulated with a tenth of the step of the fit. Printed: coverage of the dead time, or of the sum; wrong claims of
separate delays; the largest error over its standard deviation; and the standard deviation relative to the bound that is
computed before the noise is drawn.
"""

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.bound import cramer_rao
from rhythmid.identify.identifiability import delays_of
from rhythmid.identify.joint import joint_likelihood
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import MAX_STEP, simulate
from rhythmid.statistics import NORMAL_95

SORTS = ("actuator_delay", "feedback_delay", "no controller")
RATE, DURATION = 200.0, 10.0  # [Hz], [s]
SERVO = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command:
  - input_delay: {delay: {value: 0.0, unit: s}}
  - position_control: {proportional: {value: 1.0, unit: N/m, fixed: true}, derivative: {value: 0.0, unit: N*s/m, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 1.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
sensor: [{measurement_delay: {delay: {value: 0.0, unit: s}}}]
"""
FORCED = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.0, unit: s}}}]
force:
  - linear_spring: {stiffness: {value: 1.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - switched_damper: {stance: {value: 1.0, unit: N*s/m}, flight: {value: 0.0, unit: N*s/m, fixed: true}}
sensor: [{measurement_delay: {delay: {value: 0.0, unit: s}}}]
"""


@dataclass(frozen=True)
class Case:
    """A machine with its dead time [s] and its record; `model` is what is known of it."""

    machine: Model
    model: Model
    record: Record
    noise: float
    label: str


@dataclass(frozen=True)
class Outcome:
    """Error of the estimate [s] with its standard deviation, None without an estimate; whether separate delays were claimed; the bound."""

    error: float | None
    std: float
    split: bool
    bound: float


def drawn(sort: str, seed: int, index: int) -> Case:
    """One random machine of a sort, and its record."""
    rng = np.random.default_rng([seed, SORTS.index(sort), index])
    catalogue = load_catalogue()
    controlled = sort != "no controller"
    label = sort if controlled else "actuator_delay"
    model = Model.from_text(SERVO if controlled else FORCED, catalogue=catalogue)
    model = model.with_element(catalogue[label], {"delay": 0.0})
    omega, ratio = rng.uniform(8.0, 25.0), rng.uniform(0.5, 0.9)
    if controlled:
        own = {
            "linear_spring.stiffness": rng.uniform(0.05, 0.3) * omega**2,
            "viscous_damper.damping": rng.uniform(0.02, 0.2) * omega,
        }
        known = {
            "position_control.proportional": omega**2,
            "position_control.derivative": 2.0 * ratio * omega,
        }
    else:
        own = {
            "linear_spring.stiffness": omega**2,
            "switched_damper.stance": 2.0 * rng.uniform(0.05, 0.2) * omega,
        }
        known = {}
    delays = {
        f"{label}.delay": rng.uniform(0.03, 0.3) / omega,
        "input_delay.delay": rng.uniform(0.0, 0.03),
        "measurement_delay.delay": rng.uniform(0.0, 0.03),
    }
    machine = model.with_values(own | known | delays)
    model = model.with_values(known | {name: value * rng.uniform(0.7, 1.4) for name, value in own.items()})
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    sizes, phases = rng.uniform(0.3, 1.0, 8), rng.uniform(0.0, 2.0 * np.pi, 8)
    tones = omega / (2.0 * np.pi) * np.geomspace(0.1, 1.6, 8)
    command = np.cos(2.0 * np.pi * np.multiply.outer(time, tones) + phases) @ sizes
    command *= 0.1 if controlled else 0.02 * omega**2
    forced = not controlled or index % 2 == 1
    frequency, phase = 0.4 * omega / (2.0 * np.pi), rng.uniform(-np.pi, np.pi)
    dense = np.arange(-1.5, DURATION + 0.5, 1e-3)
    strength = 0.05 * omega**2 if controlled else 0.1 * omega**2

    def forcing(t):
        return strength * np.cos(2.0 * np.pi * frequency * t + phase)

    run = simulate(
        machine, time, zero_order_hold(time, command), spline(dense, forcing(dense)) if forced else None,
        max_step=0.1 * MAX_STEP,
    )  # fmt: skip
    noise = 2e-3 * float(np.std(run.output))
    measured = run.output + noise * rng.standard_normal(len(time))
    record = Record(
        f"{sort} {index}", Channel(time, measured, "m"), Channel(time, command, "m" if controlled else "N"),
        Channel(time, forcing(time), "N") if forced else None, input_kind="reference" if controlled else "force",
    )  # fmt: skip
    return Case(machine, model, record, noise, label)


def examined(case: Case) -> Outcome:
    """The result of the identification of the case."""
    name = f"{case.label}.delay"
    truth = case.machine.value(name)
    joint = joint_likelihood(case.record, case.model)
    inner = delays_of(joint, "on_robot" if case.record.forcing is not None else None).inner[case.label]
    if inner.separable:
        assert inner.delay.value is not None and inner.delay.std is not None
        bound = cramer_rao(case.machine, case.record, case.noise).std[name]
        return Outcome(inner.delay.value - truth, inner.delay.std, True, bound)
    total = inner.sums.get("measurement_delay")
    if total is None or total.value is None or total.std is None:
        return Outcome(None, math.inf, False, math.inf)
    truth += case.machine.value("measurement_delay.delay")
    return Outcome(total.value - truth, total.std, False, math.nan)


def report(sort: str, outcomes: Sequence[Outcome], lost: Sequence[Exception], seconds: float) -> None:
    """Print one sort's figures."""
    told = [one for one in outcomes if one.error is not None]
    held = sum(abs(one.error or 0.0) < NORMAL_95 * one.std for one in told)
    worst = max((abs(one.error or 0.0) / one.std for one in told), default=math.nan)
    ratio = np.array([one.std / one.bound for one in told if math.isfinite(one.bound)])
    what = "the sum with the measurement delay" if sort == SORTS[-1] else "the dead time"
    print(f"{sort}: {len(outcomes) + len(lost)} machines, {seconds:.0f} s, {len(lost)} without an answer")
    for error in lost[:3]:
        print(f"  {error}")
    print(
        f"  95 % intervals of {what} that hold the true one: {held} of {len(told)}, the worst {worst:.2f} standard deviations off"
    )
    print(
        f"  splits: {sum(one.split for one in outcomes)}, refused: {sum(not one.split for one in outcomes)}"
    )
    if len(ratio):
        print(
            f"  standard deviation over the bound: median {np.median(ratio):.3f}, {ratio.min():.3f} to {ratio.max():.3f}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=50, help="machines of each sort")
    parser.add_argument("--only", choices=SORTS)
    parser.add_argument("--workers", type=int)
    given = parser.parse_args()

    threadpool_limits(1)  # the machines are distributed among processes
    for sort in SORTS if given.only is None else (given.only,):
        begin = time.monotonic()
        outcomes: list[Outcome] = []
        lost: list[Exception] = []
        cases = [(sort, given.seed, index) for index in range(given.cases)]
        for _, found in fork_map(lambda case: examined(drawn(*case)), cases, given.workers):
            if isinstance(found, InputError):
                lost.append(found)
            elif isinstance(found, Exception):
                raise found
            else:
                outcomes.append(found)
        report(sort, outcomes, lost, time.monotonic() - begin)


if __name__ == "__main__":
    main()
