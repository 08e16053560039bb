"""The recordings of real machines as cases of the bench; docs/real.md gives their sources and what is known about them.

They are searched in `$RHYTHMID_DATA`, else in `../shared/data` beside the checkout; a set that is absent yields no cases.
"""

import gzip
import json
import math
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from bench_case import COULOMB_FAMILY, Array, Case, write_model, write_signals, write_table
from leg_inertia import JOINTS, LEGS, joint_models

from rhythmid.elements.catalogue import load_catalogue


def data_folder() -> Path:
    """Where the recordings are looked for."""
    return Path(os.environ.get("RHYTHMID_DATA") or Path(__file__).parents[2] / "shared" / "data").resolve()


# --- Silverbox: an electronic mass on a damped, hardening spring (docs/silverbox.md) ---
SILVERBOX_RATE = 1e7 / 2**14  # Hz, SOURCE.md
SILVERBOX_TRAINING = (40650, 105712)  # samples, the official split
SILVERBOX_PIECES, SILVERBOX_LENGTH = 5, 2000
SILVERBOX_MODEL = """
units: {force: V, position: V}
inertia: {mass: {value: 5.0e-6, unit: V*s^2/V}}
force:
  - linear_spring: {stiffness: {value: 1.0, unit: V/V}, rest_length: {value: 0.0, unit: V}}
  - viscous_damper: {damping: {value: 2.0e-4, unit: V*s/V}}
"""


def silverbox_cases(data: Path, folder: Path) -> list[Case]:
    """Three pieces of the official training part for the fit, two held out."""
    channels = [
        f"time: {{sample_rate: {SILVERBOX_RATE}}}", "input: {column: V1, unit: V, hold: zero}", "output: {column: V2, unit: V}",
    ]  # fmt: skip
    firsts = np.linspace(
        SILVERBOX_TRAINING[0], SILVERBOX_TRAINING[1] - SILVERBOX_LENGTH, SILVERBOX_PIECES
    ).astype(int)
    pieces = [
        write_signals(
            folder, f"silverbox{number}", data / "SNLS80mV.mat", channels,
            ((int(first) - 0.1) / SILVERBOX_RATE, (int(first) + SILVERBOX_LENGTH - 0.1) / SILVERBOX_RATE),
        )
        for number, first in enumerate(firsts, 1)
    ]  # fmt: skip
    model = write_model(folder, "silverbox", SILVERBOX_MODEL)
    known = frozenset({"cubic_stiffness"})
    return [Case("silverbox", "linear", tuple(pieces[::2]), tuple(pieces[1::2]), model, known, {})]


# --- DFKI: a pendulum on a torque-controlled motor ---
PENDULUM_FILES = {
    "tracking": "system_identification_measured.csv.gz",
    "swing_up": "control_method_energy_shaping_measured.csv.gz",
    "constant": "1nm_torque_limited_swingup_failure_measured.csv.gz",
}
PENDULUM_CHANNELS = (
    "time: {column: time}", "input: {column: torque, unit: N*m, hold: linear}", "output: {column: position, unit: rad}",
)  # fmt: skip
UNTOUCHED = {  # s: windows in which no hand pushes the pendulum (docs/real.md)
    "swing_up1": ("swing_up", (0.0, 4.6)),
    "decay": ("constant", (11.85, 17.3)),
    "whirl": ("swing_up", (16.25, 17.6)),
}
# by hand from the first window, docs/real.md: the published constants do not describe these files
PENDULUM_TRUTH = {"inertia.mass": 0.1805, "pendulum_gravity.moment": 0.360 * 9.81}
# 0.6755 kg at 0.5 m are the values in the owners' own controller files (data/parameters/sp_parameters_energy.yaml)
PENDULUM_MODEL = """
units: {force: N*m, position: rad}
inertia: {mass: {value: 0.169, unit: N*m*s^2/rad, prior: {mean: 0.169, std: 0.05}}}
force:
  - pendulum_gravity: {moment: {value: 3.3, unit: N*m}, reference: {value: 0.0, unit: rad, fixed: true}}
"""


def pendulum_cases(data: Path, folder: Path) -> list[Case]:
    """With a frictionless pendulum as nominal model: the windows without pushes by hand, then all three files as they are."""
    model = write_model(folder, "pendulum", PENDULUM_MODEL)
    clean = {
        name: write_signals(folder, f"pendulum_{name}", data / PENDULUM_FILES[file], PENDULUM_CHANNELS, use)
        for name, (file, use) in UNTOUCHED.items()
    }
    whole = [
        write_signals(folder, f"pendulum_{name}", data / file, PENDULUM_CHANNELS)
        for name, file in PENDULUM_FILES.items()
    ]
    return [
        Case(
            "pendulum untouched", "frictionless", (clean["swing_up1"], clean["decay"]), (clean["whirl"],), model,
            COULOMB_FAMILY, PENDULUM_TRUTH,
        ),
        Case("pendulum whole files", "frictionless", tuple(whole), (), model, COULOMB_FAMILY, PENDULUM_TRUTH),
    ]  # fmt: skip


# --- XL330: a hobby servo that lifts a pendulum, four firmware gains ---
FULL_DUTY = 885.0  # counts of `load` at full pulse width: the XL330's PWM limit in its e-manual
SUPPLY = 7.4  # V
XL330_HELD_OUT = "sin_sin"  # one of the four trajectories, at every gain
# Forces in volts, that is, torques divided by kt/R: neither constant has to be known, and back-EMF is viscous. 0.49 kg at 0.1 m.
XL330_MODEL = """
units: {force: V, position: rad}
inertia: {mass: {value: 0.07, unit: V*s^2/rad}}
force:
  - pendulum_gravity: {moment: {value: 5.0, unit: V}, reference: {value: 0.0, unit: rad}}
  - viscous_damper: {damping: {value: 0.4, unit: V*s/rad}}
"""
# The same in N m: the torque constant lies near the three published ones (0.300, 0.304, 0.323), the load is what the logs say, 0.49 kg at 0.1 m
# (0.0049 kg m^2, 0.4805 N m), and the rotor adds to its inertia.
XL330_MOTOR_MODEL = """
units: {force: N*m, position: rad}
inertia: {mass: {value: 0.0065, unit: N*m*s^2/rad, prior: {mean: 0.0065, std: 0.001}}}
actuator:
  - dc_motor: {torque_constant: {value: 0.305, prior: {mean: 0.305, std: 0.02}}, resistance: {value: 4.0}, supply: {value: 1.0, fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 0.4805, unit: N*m, fixed: true}, reference: {value: 0.0, unit: rad}}
  - viscous_damper: {damping: {value: 0.01, unit: N*m*s/rad}}
"""
XL330_TRUTH = {"inertia.mass": 0.0069}  # the load's and the rotor's by the published m6, 0.0049 + 0.0020
LOAD_FRICTION = frozenset({"load_dependent_friction", "transmitted_load_friction"})


def xl330_log(path: Path) -> tuple[dict[str, float | str], dict[str, Array]]:
    """What one .json.gz log says of its run, and its columns [n]: t s, goal rad, position rad, speed rad/s, duty 1, volts V, on 1."""
    with gzip.open(path, "rt") as file:
        found = json.load(file)
    entries = found.pop("entries")

    def column(name: str) -> Array:
        return np.array([float(entry[name]) for entry in entries])

    count = column("load")
    duty = np.where(count >= 2**15, count - 2**16, count) / FULL_DUTY
    columns = {
        "t": column("timestamp"), "goal": column("goal_position"), "position": column("position"),
        "speed": column("speed"), "duty": duty, "volts": SUPPLY * duty, "on": column("torque_enable"),
    }  # fmt: skip
    return found, columns


def torque_span(columns: Mapping[str, Array]) -> tuple[float, float]:
    """The first span of time [s] in which the motor is switched on."""
    on = columns["on"] > 0.5
    first = int(np.argmax(on))
    off = np.flatnonzero(~on[first:])
    last = first + int(off[0]) - 1 if len(off) else len(on) - 1
    return float(columns["t"][first]), float(columns["t"][last])


def xl330_cases(data: Path, folder: Path) -> list[Case]:
    """All records whose motor stays on, three trajectories for the fit at each gain and one held out."""
    channels = [
        "time: {column: t}", "input: {column: volts, unit: V, hold: linear}", "output: {column: position, unit: rad}",
    ]  # fmt: skip
    train: list[Path] = []
    holdout: list[Path] = []
    for path in sorted(data.glob("*.json.gz")):
        told, columns = xl330_log(path)
        name = f"xl330_{told['kp']}_{told['trajectory']}"
        span = torque_span(columns)
        use = None if math.isclose(span[1], columns["t"][-1]) else (span[0], span[1] - 0.01)
        record = write_signals(folder, name, write_table(folder / f"{name}.csv", columns), channels, use)
        (holdout if told["trajectory"] == XL330_HELD_OUT else train).append(record)
    model = write_model(folder, "xl330", XL330_MODEL)
    known = (tuple(train), tuple(holdout))
    coulomb = write_model(folder, "xl330_coulomb", XL330_MODEL + COULOMB)
    cases = [
        Case("xl330", "inertia, gravity, viscous", *known, model, LOAD_FRICTION, {}),
        Case("xl330 with Coulomb", "... and Coulomb", *known, coulomb, LOAD_FRICTION, {}),
    ]
    if "dc_motor" in load_catalogue():
        motor = write_model(folder, "xl330_motor", XL330_MOTOR_MODEL)
        cases.append(Case("xl330 as a motor", "... in N m", *known, motor, LOAD_FRICTION, XL330_TRUTH))
    return cases


COULOMB = "  - coulomb_friction: {force: {value: 0.1, unit: V}}"

# --- Go2: one joint at a time as a servo, the base fixed, the legs in the air ---
GO2_RATE, GO2_CUT = 200.0, (0.0, 16.0, 23.5)  # Hz; s, learnt from and held out
GO2_MODEL = """
units: {{force: N*m, position: rad}}
inertia: {{mass: {{value: {inertia:.5f}, unit: N*m*s^2/rad, prior: {{mean: {inertia:.5f}, std: {spread:.5f}}}}}}}
command:
  - position_control: {{proportional: {{value: 20.0, unit: N*m/rad, fixed: true}}, derivative: {{value: 1.5, unit: N*m*s/rad, fixed: true}}}}
force:
  - pendulum_gravity: {{moment: {{value: {moment:.5f}, unit: N*m}}, reference: {{value: {reference:.5f}, unit: rad, fixed: true}}}}
  - viscous_damper: {{damping: {{value: 0.6, unit: N*m*s/rad}}}}
"""
SPREAD = 0.3  # of the inertia: the other joints move, and the rotor's share (armature) is a guess


def go2_cases(data: Path, folder: Path) -> list[Case]:
    """Twelve joints, each a servo of which only reference and motion are known."""
    models = joint_models(data / "go2.xml", np.load(data / "traj_0.npz")["dof_pos"].mean(axis=0))
    cases: list[Case] = []
    for number, name in enumerate(f"{leg}_{joint}" for leg in LEGS for joint in JOINTS):
        channels = [
            f"time: {{sample_rate: {GO2_RATE}}}",
            f'input: {{column: "des_dof_pos[{number}]", unit: rad, kind: reference, hold: zero}}',
            f'output: {{column: "dof_pos[{number}]", unit: rad}}',
        ]
        seen, unseen = (
            write_signals(folder, f"go2_{name}_{part}", data / "traj_0.npz", channels, (start, end))
            for part, start, end in zip(("seen", "unseen"), GO2_CUT, GO2_CUT[1:])
        )
        one = models[number]
        model = write_model(
            folder, f"go2_{name}",
            GO2_MODEL.format(inertia=one.inertia, spread=SPREAD * one.inertia, moment=one.moment, reference=one.reference),
        )  # fmt: skip
        cases.append(Case(f"go2 {name}", "servo, viscous", (seen,), (unseen,), model, None, {}))
    return cases


SETS = {
    "silverbox": silverbox_cases, "pendulum": pendulum_cases, "xl330": xl330_cases, "go2": go2_cases,
}  # fmt: skip


def real_cases(folder: Path, data: Path | None = None) -> list[Case]:
    """The cases of all sets that are present, their files written to `folder`."""
    place = data or data_folder()
    return [
        case for name, make in SETS.items() if (place / name).is_dir() for case in make(place / name, folder)
    ]
