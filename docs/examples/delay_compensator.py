"""A controller that uses an identified latency: it predicts the machine's state over both delays before it acts.

    rhythmid identify bag --save latency.yaml
    python docs/examples/delay_compensator.py latency.yaml

A sensor reading is `measurement` old, and a command acts `input` later: the command given now meets the state that
follows the one measured last by the sum of the two. Only that sum matters here, so the controller works even where the
two could not be told apart. The prediction runs the identified model over the commands that are still on their way.
"""

import math
import sys

import numpy as np

from rhythmid.identify.latency import Latency
from rhythmid.model import Model
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate

PERIOD = 0.005  # s, of the controller


def undelayed(model: Model) -> Model:
    """The model without its transport delays."""
    return model.with_values({name: 0.0 for name in model.parameters if name.endswith("_delay.delay")})


def forcing(time: np.ndarray) -> np.ndarray:
    """The machine's own forcing [N]."""
    return np.cos(2.0 * np.pi * time)


class DelayCompensator:
    """State feedback on a predicted state.

    `gain` = (position [N/m], velocity [N s/m]) acts on the deviation from `target` [m]; `delay` [s] is looked ahead.
    """

    def __init__(self, model: Model, delay: float, gain: tuple[float, float], target: float) -> None:
        self.model, self.gain, self.target = undelayed(model), gain, target
        self.underway = [0.0] * max(1, round(delay / PERIOD))
        self.ahead = delay

    def command(self, position: float, velocity: float, taken: float) -> float:
        """Command [N] from the newest measurement, which was taken at time `taken` [s]."""
        if self.ahead > 0.0:
            times = taken + np.linspace(0.0, self.ahead, 2)
            stamps = taken + PERIOD * np.arange(float(len(self.underway)))
            knots = np.arange(taken - 0.01, taken + self.ahead + 0.01, 1e-3)
            reached = simulate(
                self.model, times, zero_order_hold(stamps, np.array(self.underway)), spline(knots, forcing(knots)),
                (position, velocity), 1e-3,
            )  # fmt: skip
            position, velocity = float(reached.position[-1]), float(reached.velocity[-1])
        effort = -self.gain[0] * (position - self.target) - self.gain[1] * velocity
        self.underway = [*self.underway[1:], effort]
        return effort


def ring_down(machine: Model, controller: DelayCompensator, delay: float, duration: float = 6.0) -> float:
    """Largest speed [m/s] in the last second after a push, with `controller` in a loop of this true delay.

    Infinite where the motion grows without limit.
    """
    plant = undelayed(machine)
    late = round(delay / PERIOD)
    commands = [0.0] * late
    state = np.array([controller.target + 0.03, 0.0])
    speeds, past = [], []
    for step in range(round(duration / PERIOD)):
        now = step * PERIOD
        past.append(state.copy())
        seen = past[max(0, step - late)]  # all delay on the measuring side: the loop cannot tell
        taken = max(0.0, now - late * PERIOD)
        acting = controller.command(float(seen[0]), float(seen[1]), taken)
        commands.append(acting)
        knots = np.arange(now - 0.002, now + PERIOD + 0.003, 1e-3)
        moved = simulate(
            plant, np.array([now, now + PERIOD]), zero_order_hold(np.array([now]), np.array([acting])),
            spline(knots, forcing(knots)), tuple(state), 1e-3,
        )  # fmt: skip
        state = moved.states[-1]
        speeds.append(abs(float(state[1])))
        if speeds[-1] > 10.0:
            return math.inf  # it runs away
    return max(speeds[-round(1.0 / PERIOD) :])


def main(path: str) -> tuple[float, float]:
    """Largest late speed without and with compensation."""
    latency = Latency.load(path)
    target = latency.model.value("linear_spring.rest_length") - 9.81 / latency.model.value(
        "linear_spring.stiffness"
    )
    gain = (0.0, 40.0)  # damping injection: stable without delay, unstable with it
    plain = DelayCompensator(latency.model, 0.0, gain, target)
    ahead = DelayCompensator(latency.model, latency.sum, gain, target)
    late = latency.sum
    return ring_down(latency.model, plain, late), ring_down(latency.model, ahead, late)


if __name__ == "__main__":
    without, compensated = main(sys.argv[1])
    print(f"largest speed after 5 s: {without:.3f} m/s without compensation, {compensated:.3f} m/s with it")
