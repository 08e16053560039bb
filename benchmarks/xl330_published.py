"""The published models of the XL330 servo (M. Duclusaud et al., ICRA 2025) on the recordings, by firmware gain.

    python benchmarks/xl330_published.py [--model SAVED.yaml ...] [--markdown]

Two errors of each model, in % (rms of the error / standard deviation of what was recorded):

- effort: the motor's voltage that the model needs for the recorded motion (low-passed at 12 Hz without phase), without samples at rest, saturated
  or switched off. A value below 100 % shows that motion and voltage are related.
- motion: the position when the model runs free in closed loop, from the recorded goal and the first recorded position on.

For comparison, a friction that is proportional to the torque that the joint transmits, mu |m l^2 a + m g l sin q| sgn v, is fitted to three
trajectories at all gains and evaluated, like the others, on the held-out one. The same fit is made with viscous or Coulomb friction instead.

`--model` runs models that `rhythmid diagnose --save-model` wrote in the same way; effects other than friction and the motor are left out, with a
message.

The firmware's law, duty = gain (goal - position) clipped to 1, was estimated from the recordings: `load` is 885 counts at full duty, gain = 2.545/885
per unit of the firmware's gain and rad. The published constants refer to the authors' 0.00246, measured with an oscilloscope on another servo, and
are run with this value.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bench_case import Array
from recording_sets import FULL_DUTY, SUPPLY, XL330_HELD_OUT, data_folder, xl330_log
from scipy.signal import butter, sosfiltfilt

from rhythmid.model import Model

MASS, LENGTH, GRAVITY = 0.49, 0.1, 9.80665  # kg, m of the logs; m/s^2
INERTIA, MOMENT = MASS * LENGTH**2, MASS * GRAVITY * LENGTH  # kg m^2, N m
RATE, CUT = 180.0, 12.0  # Hz: of the resampled logs; of the low-pass
REST = 0.12  # rad/s; slower, friction takes any value below its level
STEP = 1e-3  # s, of the closed-loop run
COUNTS = 2.545  # of load, per unit of the firmware's gain and rad
AUTHORS_GAIN = 0.00246  # duty per unit of the firmware's gain and rad, in the authors' code
NEGLIGIBLE = 1e-6  # N m/A, a torque constant whose back-EMF does not count


@dataclass(frozen=True)
class Log:
    """One record: firmware gain, trajectory, and columns [n] as `xl330_log` gives them."""

    gain: int
    trajectory: str
    columns: Mapping[str, Array]


@dataclass(frozen=True)
class Servo:
    """Constants of a motor and its friction, named as the authors' parameter files name them; `error_gain` is duty per rad and unit of gain."""

    error_gain: float
    kt: float
    R: float
    armature: float
    q_offset: float
    friction_base: float = 0.0
    friction_viscous: float = 0.0
    friction_stribeck: float = 0.0
    load_friction_motor: float = 0.0
    load_friction_external: float = 0.0
    load_friction_motor_stribeck: float = 0.0
    load_friction_external_stribeck: float = 0.0
    load_friction_motor_quad: float = 0.0
    load_friction_external_quad: float = 0.0
    dtheta_stribeck: float = 1.0
    alpha: float = 1.0
    transmitted: float = (
        0.0  # mu of the fitted friction, which counts the torque that inertia and gravity take
    )

    def friction(self, motor: Array, external: Array, speed: Array) -> Array:
        """Level of the friction torque [N m] under the motor's and the external torque, as the authors define it."""
        slow = np.exp(-(np.abs(speed / self.dtheta_stribeck) ** self.alpha))
        load = np.abs(external * self.load_friction_external - motor * self.load_friction_motor)
        load_slow = np.abs(
            external * self.load_friction_external_stribeck - motor * self.load_friction_motor_stribeck
        )
        driven = np.where(
            np.abs(external) < np.abs(motor),
            self.load_friction_external_quad * external**2,
            self.load_friction_motor_quad * motor**2,
        )
        opposed = np.sign(external) != np.sign(motor)
        return (
            self.friction_base + load + self.friction_viscous * np.abs(speed)
            + slow * (self.friction_stribeck + load_slow + driven * opposed)
        )  # fmt: skip

    def voltage(self, q: Array, v: Array, a: Array) -> Array:
        """Voltage [V] that the motion needs; the friction depends on the motor's torque, found by bisection."""
        external = -MOMENT * np.sin(q + self.q_offset)
        direction = np.sign(v)
        level = self.transmitted * np.abs(INERTIA * a - external)
        needed = (INERTIA + self.armature) * a - external + level * direction
        low, high = needed - 2.0, needed + 2.0  # N m
        for _ in range(50):
            middle = 0.5 * (low + high)
            short = middle - direction * self.friction(middle, external, v) < needed
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        return 0.5 * (low + high) * self.R / self.kt + self.kt * v

    def transmitted_level(self, net: float, external: float, direction: float) -> float:
        """Level [N m] of the friction mu |m l^2 a - external| under the torque `net` without it: a depends on it in turn."""
        part = INERTIA / (INERTIA + self.armature)
        free = part * net - external
        return self.transmitted * abs(free) / (1.0 + np.sign(direction * free) * self.transmitted * part)


def logs(folder: Path) -> list[Log]:
    """All records, by gain and trajectory."""
    found = [xl330_log(path) for path in sorted(folder.glob("*.json.gz"))]
    return [Log(int(told["kp"]), str(told["trajectory"]), columns) for told, columns in found]


def moving(log: Log, on: bool = True) -> tuple[Array, Array, Array, Array]:
    """Angle, speed, acceleration and duty [n] of a record's samples that count, all low-passed alike; with the motor `on` or off."""
    columns = log.columns
    grid = np.arange(columns["t"][0] + 0.01, columns["t"][-1] - 0.01, 1 / RATE)
    raw = {name: np.interp(grid, columns["t"], columns[name]) for name in ("position", "duty", "on")}
    low = butter(4, 2 * CUT / RATE, output="sos")
    q, duty = sosfiltfilt(low, raw["position"]), sosfiltfilt(low, raw["duty"])
    v = np.gradient(q, 1 / RATE)
    a = np.gradient(v, 1 / RATE)
    switched = raw["on"] if on else 1.0 - raw["on"]
    out = (np.abs(v) < REST) | (switched < 1.0) | (np.abs(raw["duty"]) > 0.99)
    kept = ~(np.convolve(out, np.ones(5), "same") > 0)
    kept[:8] = kept[-8:] = False
    return q[kept], v[kept], a[kept], duty[kept]


def damping_switched_off(log: Log) -> float:
    """Viscous damping [N m s/rad] while the motor is off, beside a friction by the transmitted torque: least squares of the motion's balance."""
    q, v, a, _ = moving(log, on=False)
    rotor, offset = 0.0020, 0.0207  # kg m^2, rad: published (m6) and fitted alike
    load = INERTIA * a + MOMENT * np.sin(q + offset)
    columns = np.stack([v, np.sign(v) * np.abs(load)], axis=1)
    return float(np.linalg.lstsq(columns, -(load + rotor * a), rcond=None)[0][0])


def effort_error(servo: Servo, log: Log) -> tuple[float, float, int]:
    """Sum of squared errors and of squared deviations of the voltage, and the number of samples."""
    q, v, a, duty = moving(log)
    volts = SUPPLY * duty * servo.error_gain * FULL_DUTY / COUNTS
    return (
        float(np.sum((servo.voltage(q, v, a) - volts) ** 2)),
        float(np.sum((volts - volts.mean()) ** 2)),
        len(q),
    )


def motion_error(servo: Servo, log: Log) -> tuple[float, float, int]:
    """The same of the position in closed loop; friction stops the joint within a step when it can."""
    columns = log.columns
    time = columns["t"]
    grid = np.arange(time[0], time[-1], STEP)
    goal, on = np.interp(grid, time, columns["goal"]), np.interp(grid, time, columns["on"]) > 0.5
    q, v = float(columns["position"][0]), float(columns["speed"][0])
    path = np.empty(len(grid))
    total = INERTIA + servo.armature
    for index in range(len(grid)):
        path[index] = q
        duty = float(np.clip(servo.error_gain * log.gain * (goal[index] - q), -1.0, 1.0))
        motor = servo.kt / servo.R * (SUPPLY * duty - servo.kt * v) if on[index] else 0.0
        external = -MOMENT * np.sin(q + servo.q_offset)
        net = motor + external
        level = float(servo.friction(np.array(motor), np.array(external), np.array(v)))
        stop = total / STEP * v + net
        level += servo.transmitted_level(net, external, float(np.sign(stop)))
        v += (net - np.sign(stop) * min(abs(stop), level)) / total * STEP
        q += v * STEP
    simulated = np.interp(time, grid, path)
    recorded = columns["position"]
    return (
        float(np.sum((simulated - recorded) ** 2)),
        float(np.sum((recorded - recorded.mean()) ** 2)),
        len(time),
    )


def fitted(seen: Sequence[Log], law: str) -> Servo:
    """Constants of a servo by inverse-dynamics least squares, robust (Student-t with 4 degrees of freedom); `law` is `viscous`, `coulomb` or
    `transmitted`. These data do not separate torque constant and winding resistance from friction: kt is the published one of m6."""
    rows, volts = [], []
    for log in seen:
        q, v, a, duty = moving(log)
        columns = [INERTIA * a + MOMENT * np.sin(q), a, MOMENT * np.cos(q), v]
        if law == "coulomb":
            columns.append(np.sign(v))
        if law == "transmitted":
            columns.append(np.sign(v) * np.abs(INERTIA * a + MOMENT * np.sin(q)))
        rows.append(np.stack(columns, axis=1))
        volts.append(SUPPLY * duty)
    x, y = np.concatenate(rows), np.concatenate(volts)
    weight = np.ones(len(y))
    theta = np.zeros(x.shape[1])
    for _ in range(30):
        root = np.sqrt(weight)
        theta = np.linalg.lstsq(x * root[:, None], y * root, rcond=None)[0]
        error = y - x @ theta
        weight = 5.0 / (4.0 + error**2 / np.mean(weight * error**2))
    kt = 0.3036
    resistance = kt * float(theta[0])
    return Servo(
        COUNTS / FULL_DUTY, kt, resistance, float(theta[1] / theta[0]), float(theta[2] / theta[0]),
        friction_base=float(theta[4] / theta[0]) if law == "coulomb" else 0.0,
        friction_viscous=float((theta[3] - kt) / theta[0]),
        transmitted=float(theta[4] / theta[0]) if law == "transmitted" else 0.0,
    )  # fmt: skip


def published(folder: Path, name: str) -> Servo:
    """The servo of the authors' `params_NAME.json`."""
    found = json.loads((folder / f"params_{name}.json").read_text())
    return Servo(
        AUTHORS_GAIN,
        **{key: float(value) for key, value in found.items() if key not in ("model", "actuator")},
    )


def of_model(model: Model) -> tuple[Servo, tuple[str, ...]]:
    """The servo that a saved model describes, in volts or in N m with a `dc_motor`, and the elements that are not counted here.

    In volts all torques are multiplied by k_t/R, which is known from gravity. The back-EMF is part of the damping; a torque constant close to
    zero leaves it there.
    """
    values = {name: value.value for name, value in model.parameters.items()}
    counted = {
        "pendulum_gravity", "viscous_damper", "coulomb_friction", "load_dependent_friction", "transmitted_load_friction", "dc_motor",
    }  # fmt: skip
    if "dc_motor.resistance" in values:
        scale, kt = 1.0, values["dc_motor.torque_constant"]
        resistance = values["dc_motor.resistance"] / values["dc_motor.supply"]
    else:
        scale, kt = values["pendulum_gravity.moment"] / MOMENT, NEGLIGIBLE
        resistance = scale * kt
    by_motor = values.get("load_dependent_friction.coefficient", 0.0)
    both = values.get("transmitted_load_friction.coefficient", 0.0)
    found = Servo(
        COUNTS / FULL_DUTY, kt, resistance, values["inertia.mass"] / scale - INERTIA,
        -values.get("pendulum_gravity.reference", 0.0),
        friction_base=values.get("coulomb_friction.force", 0.0) / scale,
        friction_viscous=values.get("viscous_damper.damping", 0.0) / scale,
        load_friction_motor=by_motor + both,
        load_friction_external=both * values.get("transmitted_load_friction.external_ratio", 1.0),
    )  # fmt: skip
    return found, tuple(term.label for term in model.terms if term.label not in counted)


def errors(servo: Servo, everything: Sequence[Log]) -> list[tuple[str, ...]]:
    """Kind of error, then the errors [%] on the held-out records by gain, on all of them, and on all records."""
    unseen = [log for log in everything if log.trajectory == XL330_HELD_OUT]
    lines: list[tuple[str, ...]] = []
    for kind, measure in (("effort", effort_error), ("motion", motion_error)):
        parts = {id(log): measure(servo, log) for log in everything}

        def relative(chosen: Sequence[Log], parts: dict[int, tuple[float, float, int]] = parts) -> str:
            error, spread = (sum(parts[id(log)][i] for log in chosen) for i in (0, 1))
            return f"{100 * np.sqrt(error / spread):.1f}"

        by_gain = [relative([log for log in unseen if log.gain == gain]) for gain in gains_of(everything)]
        lines.append((kind, *by_gain, relative(unseen), relative(everything)))
    return lines


def gains_of(everything: Sequence[Log]) -> list[int]:
    return sorted({log.gain for log in everything})


def constants(servo: Servo) -> str:
    """Constants of a servo in one line; R/kt in the volts of the recorded duty, whatever gain its constants refer to."""
    volts = servo.error_gain * FULL_DUTY / COUNTS
    return (
        f"R/kt {servo.R / servo.kt / volts:.2f} V/(N m), mu {servo.transmitted:.3f}, armature {servo.armature:.5f} kg m^2, "
        f"offset {servo.q_offset:.4f} rad, base {servo.friction_base:.4f} N m, viscous {servo.friction_viscous:.4f} N m s/rad"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--model",
        type=Path,
        nargs="*",
        default=[],
        help="models saved by a diagnosis, to be run the same way",
    )
    parser.add_argument("--markdown", action="store_true", help="print the table for a document")
    chosen = parser.parse_args()
    folder = data_folder() / "xl330"
    everything = logs(folder)
    seen = [log for log in everything if log.trajectory != XL330_HELD_OUT]
    servos = {f"published {name}": published(folder, name) for name in ("m1", "m2", "m6")}
    servos |= {f"fitted, {law}": fitted(seen, law) for law in ("viscous", "coulomb", "transmitted")}
    notes: list[str] = []
    for path in chosen.model:
        servos[path.stem], left_out = of_model(Model.load(path))
        notes += [f"{path.stem}: without {', '.join(left_out)}"] if left_out else []
    lines = [("model", "error of", *(f"gain {gain}" for gain in gains_of(everything)), "all", "all records")]
    lines += [(name, *line) for name, servo in servos.items() for line in errors(servo, everything)]
    if chosen.markdown:
        head, *rest = ["| " + " | ".join(line) + " |" for line in lines]
        print("\n".join([head, "|" + " --- |" * len(lines[0]), *rest]))
    else:
        widths = [max(len(line[index]) for line in lines) + 2 for index in range(len(lines[0]))]
        for line in lines:
            print("".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip())
    print("\n" + "\n".join([*(f"{name}: {constants(servo)}" for name, servo in servos.items()), *notes]))


if __name__ == "__main__":
    main()
