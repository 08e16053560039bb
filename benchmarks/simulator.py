"""The simulator compared with scipy's solve_ivp and MuJoCo on the paper's hopper: `make benchmark`.

    python benchmarks/simulator.py [--duration 270] [--json FILE]

Printed: times real time, ratio to ours, largest deviation from a reference at a 16 times finer step; the gain of two
threads for sensitivities; and the time to the first answer for a combination of elements that was never compiled before.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import rhythmid
from rhythmid.experiment import Forcing, Noise, plant_model
from rhythmid.model import Model
from rhythmid.simulation.signal import PPoly, zero_order_hold
from rhythmid.simulation.simulate import MAX_STEP, simulate

PERIOD = 1e-3
START = (0.15, 0.0)
INPUT_DELAY, MEASUREMENT_DELAY = 0.0403, 0.05
MJCF = """
<mujoco>
  <option timestep="0.00025" integrator="RK4" gravity="0 0 -9.81"><flag contact="disable"/></option>
  <worldbody><body>
    <joint name="leg" type="slide" axis="0 0 1" stiffness="200" springref="0.2"/>
    <geom type="sphere" size="0.05" mass="1"/>
  </body></worldbody>
</mujoco>
"""


@dataclass(frozen=True)
class Row:
    """One simulator's run."""

    name: str
    seconds: float
    times_real_time: float
    deviation_m: float


def hopper() -> Model:
    """The paper's hopper with its forcing and both delays."""
    paper = Model.load(Path(rhythmid.__file__).parent / "models" / "paper_hopper.yaml")
    delays = {"input_delay.delay": INPUT_DELAY, "measurement_delay.delay": MEASUREMENT_DELAY}
    return plant_model(paper, Forcing(), Noise()).with_values(delays)


def grid(duration: float) -> np.ndarray:
    """Sample times [s] at 1 kHz."""
    return np.arange(round(duration / PERIOD), dtype=float) * PERIOD


def chirps(time: np.ndarray) -> np.ndarray:
    """Equation (14) of the paper, a chirp every 30 s [N]."""
    return 0.004 * np.sin(7 * np.pi * (time % 30.0) ** 2 / 30.0)


def best(run: Callable[[], np.ndarray], repeats: int) -> tuple[float, np.ndarray]:
    """Shortest wall time [s] of several runs, and the result."""
    seconds, result = math.inf, np.empty(0)
    for _ in range(repeats):
        begin = time.perf_counter()
        result = run()
        seconds = min(seconds, time.perf_counter() - begin)
    return seconds, result


def by_scipy(times: np.ndarray, efforts: np.ndarray, smooth: bool) -> np.ndarray:
    """solve_ivp (RK45, rtol 1e-8) with the held command looked up, or with the chirp's formula half a sample late."""
    held = [0.0, *efforts.tolist()]

    def looked_up(t: float) -> float:
        return held[int((t - INPUT_DELAY) / PERIOD) + 1 if t >= INPUT_DELAY else 0]

    def formula(t: float) -> float:
        local = t - INPUT_DELAY - PERIOD / 2
        return 0.004 * math.sin(7 * math.pi * (local % 30.0) ** 2 / 30.0) if local >= 0.0 else 0.0

    command = formula if smooth else looked_up

    def rates(t: float, state: np.ndarray) -> tuple[float, float]:
        x, v = state
        damping = 2.0 if v > 0.0 else 0.0
        return v, math.cos(2 * math.pi * t) + command(t) - 200.0 * (x - 0.2) - damping * v - 9.81

    return solve_ivp(rates, (0.0, times[-1]), START, "RK45", t_eval=times, rtol=1e-8, atol=1e-10).y[0]


def by_mujoco(times: np.ndarray, efforts: np.ndarray) -> np.ndarray:
    """mj_step, RK4, four steps a sample; the switch and the drive are set from Python before each step."""
    import mujoco as library

    mujoco: Any = library  # its names are made at run time
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = START
    held = [0.0, *efforts.tolist()]
    step, out = float(model.opt.timestep), np.empty(len(times))
    force, damping, speed, mj_step = data.qfrc_applied, model.dof_damping, data.qvel, mujoco.mj_step
    for k in range(len(times)):
        out[k] = data.qpos[0]
        for substep in range(4):
            t = k * PERIOD + (substep + 0.5) * step
            u = held[int((t - INPUT_DELAY) / PERIOD) + 1 if t >= INPUT_DELAY else 0]
            force[0] = math.cos(2 * math.pi * t) + u
            damping[0] = 2.0 if speed[0] > 0.0 else 0.0
            mj_step(model, data)
    return out


def side_by_side(duration: float) -> list[Row]:
    """All simulators over the same commands; the measurement is taken at the same physical times."""
    model = hopper()
    times = grid(duration)
    efforts = chirps(times)
    command: PPoly = zero_order_hold(times, efforts)
    stamps = times + MEASUREMENT_DELAY

    def ours(max_step: float) -> np.ndarray:
        return simulate(model, stamps, command, initial=START, max_step=max_step).position

    ours(MAX_STEP)  # compiles
    reference = ours(MAX_STEP / 16)
    contenders: list[tuple[str, Callable[[], np.ndarray], int]] = [
        ("rhythmid, RK4, 4 substeps", lambda: ours(MAX_STEP), 5),
        ("scipy solve_ivp, RK45, rtol 1e-8", lambda: by_scipy(times, efforts, False), 1),
        ("same, command smoothed by hand", lambda: by_scipy(times, efforts, True), 1),
    ]
    try:
        import mujoco  # noqa: F401

        contenders.append(("MuJoCo mj_step, RK4, 4 substeps", lambda: by_mujoco(times, efforts), 1))
    except ImportError:
        print("MuJoCo is not installed and left out: pip install 'rhythmid[benchmarks]'", file=sys.stderr)
    rows = []
    for name, run, repeats in contenders:
        seconds, position = best(run, repeats)
        rows.append(Row(name, seconds, duration / seconds, float(np.max(np.abs(position - reference)))))
    return rows


def two_threads(duration: float, runs: int = 16) -> tuple[float, float]:
    """Wall time [s] of perturbed runs one after another, and on two threads."""
    model = hopper()
    times = grid(duration)
    command = zero_order_hold(times, chirps(times))
    models = [model.with_values({"linear_spring.stiffness": 200.0 + 0.01 * i}) for i in range(runs)]

    def run(one: Model) -> float:
        return simulate(one, times, command, initial=START).position[-1]

    def threaded() -> np.ndarray:
        with ThreadPoolExecutor(2) as pool:
            return np.array(list(pool.map(run, models)))

    serial, one = best(lambda: np.array([run(each) for each in models]), 3)
    parallel, two = best(threaded, 3)
    assert np.array_equal(one, two)
    return serial, parallel


FIRST = """
import time
begin = time.perf_counter()
import numpy as np
from rhythmid.model import Model
from rhythmid.simulation.simulate import simulate
text = '''{text}'''
imported = time.perf_counter()
model = Model.from_text(text)
simulate(model, np.arange(10) * 1e-3, initial=(0.15, 0.0))
print(imported - begin, time.perf_counter() - imported)
"""


def first_answer() -> tuple[float, float, float]:
    """Seconds in a new process: for the imports; for a combination never compiled before; and for it once more."""
    text = """
inertia: {mass: 1.0}
actuator: [{actuator_lag: {time_constant: 0.01}}]
force:
  - gravity: {acceleration: 9.81}
  - linear_spring: {stiffness: 200.0, rest_length: 0.2}
  - switched_damper: {stance: 2.0}
  - cubic_stiffness: {coefficient: 10.0}
  - coulomb_friction: {force: 0.01}
  - periodic_forcing: {amplitude: 1.0, frequency: 1.0}
sensor: [{sensor_lag: {time_constant: 0.01}}]
"""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "RHYTHMID_CACHE": folder}
        line = [sys.executable, "-c", FIRST.format(text=text)]
        found = [
            tuple(map(float, subprocess.check_output(line, env=environment, text=True).split()))
            for _ in range(2)
        ]
    return found[1][0], found[0][1], found[1][1]


def main() -> None:
    parser = argparse.ArgumentParser(description="The simulator beside scipy and MuJoCo.")
    parser.add_argument("--duration", type=float, default=270.0, help="simulated seconds")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    arguments = parser.parse_args()
    rows = side_by_side(arguments.duration)
    print(f"the paper's hopper, {arguments.duration:g} s at 1 kHz, delays of 40.3 and 50 ms, one thread")
    print(f"{'':34}{'seconds':>10}{'x real time':>13}{'ours is faster':>16}{'deviation':>12}")
    for row in rows:
        ratio = row.seconds / rows[0].seconds
        print(
            f"{row.name:34}{row.seconds:10.3f}{row.times_real_time:13.0f}{ratio:16.1f}{row.deviation_m:10.1e} m"
        )
    serial, parallel = two_threads(arguments.duration)
    print(
        f"16 perturbed runs: {serial:.2f} s one after another, {parallel:.2f} s on two threads: x{serial / parallel:.2f}"
    )
    imports, compiled, again = first_answer()
    print(
        f"a combination of elements never seen before: first answer after {compiled:.2f} s (once compiled: {again:.2f} s)"
    )
    print(f"(a new process needs {imports:.2f} s for its imports)")
    if arguments.json:
        figures = {
            "rows": [asdict(row) for row in rows],
            "threads": {"serial_s": serial, "parallel_s": parallel},
            "first_answer": {"imports_s": imports, "never_compiled_s": compiled, "compiled_s": again},
        }
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
