"""The mismatch that a concealed effect causes after refitting the nominal model, and the strength for a given mismatch.

This is the only place where the proof uses the estimator: to measure the size of a concealed effect before the case is sealed. Where
a free run is not meaningful, the mismatch is a force: what the effects add along the true motion, less what the nominal model's free
parameters absorb by linear least squares. The part that a relative shift of input and motion absorbs is excluded in both cases,
because no record separates it from an equally short lag.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import minimise
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.proof.machine import Machine, Observation
from rhythmid.proof.machines.rig import Rig
from rhythmid.proof.protocol import Run
from rhythmid.proof.sizes import drive_of
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
AVERAGED = 200  # [Hz] rate to which samples are averaged
STEP = 6.25e-4  # [s] step of the fit's integrator, so short that its error is no mismatch
SIZE_TOLERANCE = 1.25  # tolerance factor of a mismatch
TRIES = 7
SHIFT = 2.0  # samples by which the clocks of input and motion may differ: they are not known better
HELD = 0.5  # samples by which a held input is late, relative to the smooth one that the machine sees


def record_of(rig: Rig, run: Run, seen: Observation) -> Record:
    """The noise-free record of one run."""
    force, position = rig.units
    drive = {"command": run.command, "effort": seen.effort, "base": run.command, "reference": run.command}
    value = drive.get(rig.recorded)
    forcing = run.forcing * rig.forcing(run.time)
    moved = rig.recorded == "base"
    return Record(
        run.name,
        Channel(seen.stamps, seen.measured, f"{position}/s" if rig.velocity else position),
        None if value is None else Channel(run.time, value, force if rig.recorded in ("command", "effort") else position),
        forcing=Channel(run.time, forcing, force) if rig.forcing.amplitude else None,
        hold="band_limited" if moved else "zero",
        input_kind="base_displacement" if moved else "reference" if rig.recorded == "reference" else "force",
        output_kind="velocity" if rig.velocity else "position",
    )  # fmt: skip


def mismatch(nominal: Model, rig: Rig, seen: Sequence[Observation] | None, scale: float) -> float:
    """Rms residual [m] of the nominal model on the noise-free records `seen`, after a refit from its own values.

    Infinite where it cannot follow them. `scale` [m] is the accuracy needed.
    """
    if seen is None:
        return math.inf
    records = [record_of(rig, run, one) for run, one in zip(rig.runs, seen)]
    try:
        series = prepare(records, max(1, round(rig.runs[0].rate / AVERAGED)))
        run = prepare_run(nominal, series, STEP)
        samples = sum(one.blocks for one in series)
        fit = minimise(
            nominal,
            run,
            tuple(nominal.free),
            NoiseModel(np.empty(0), scale),
            None,
            10,
            tolerance=1e-3 * samples,
        )
    except InputError:
        return math.inf
    return math.sqrt(fit.chi2 / fit.samples) * scale


def with_shift(nominal: Model, rig: Rig, catalogue: Catalogue) -> Model:
    """The model with an input shift of up to `SHIFT` + `HELD` samples in either direction, unless it has an input delay."""
    if rig.recorded == "nothing" or nominal.term("input_delay") is not None:
        return nominal
    most = (SHIFT + HELD) / rig.runs[0].rate
    model = nominal.with_element(catalogue["input_delay"], {"delay": 0.0})
    shift = replace(model.parameters[INPUT_DELAY], bounds=(-most, most))
    return model.with_parameters({INPUT_DELAY: shift})


def plain_force(machine: Machine, x: Array, v: Array) -> Array:
    """Force [N] of spring, damper and a pendulum's gravity at positions and velocities (n,)."""
    damping = np.where(v > 0.0, machine.damping, machine.return_damping)
    spring = machine.stiffness * (x - machine.rest_length)
    return -spring - damping * v - machine.moment * np.sin(x - machine.hanging)


def force_share(rig: Rig, seen: Sequence[Observation] | None, free: Sequence[str]) -> float:
    """Rms of the force that the nominal model lacks in the records `seen`, relative to that of the driving force.

    The part that the model's `free` attributes can absorb is excluded. Where the effort is recorded, so is the part that a shift of
    the effort by up to `SHIFT` samples can absorb.
    """
    if seen is None:
        return math.inf
    x = np.concatenate([one.position for one in seen])
    v = np.concatenate([one.velocity for one in seen])
    a = np.concatenate([one.acceleration for one in seen])
    drive = np.concatenate([drive_of(rig.machine, rig.forcing, run, one) for run, one in zip(rig.runs, seen)])
    lacking = np.concatenate([one.added for one in seen])
    lacking = lacking + plain_force(rig.machine, x, v) - plain_force(rig.believed, x, v)
    columns = {
        "mass": a, "damping": v, "stiffness": x, "rest_length": np.ones(len(x)),
        "moment": np.sin(x - rig.believed.hanging),
    }  # fmt: skip
    absorbed = np.column_stack([columns[name] for name in free if getattr(rig.believed, name)])
    if rig.recorded == "effort":
        forces = np.split(drive, np.cumsum([len(one.position) for one in seen])[:-1])
        moved = [np.gradient(force) for force in forces]  # change by a shift of one sample
        shift = np.concatenate(moved)[:, None]
        size = np.linalg.lstsq(np.hstack([shift, absorbed]), lacking, rcond=None)[0][0]
        lacking = lacking - float(np.clip(size, -SHIFT, SHIFT)) * shift[:, 0]
    left = lacking - absorbed @ np.linalg.lstsq(absorbed, lacking, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2) / np.mean(drive**2)))


def strength_for(
    target: float, ratio_at: Callable[[float], float], close: float = SIZE_TOLERANCE, tries: int = TRIES
) -> tuple[float, float]:
    """Strength in (0, 1] at which `ratio_at` is close to `target`, and the ratio there.

    Effects grow with a power of their strength. The search therefore uses secants in logarithms, within the known bracket. If the
    target is out of reach, the nearest strength is returned; (0, 0) where there is none.
    """
    low, high = math.log(1e-7), 0.0
    place, power = math.log(0.05), 1.0
    points: list[tuple[float, float]] = []  # logarithms of strength and ratio
    for _ in range(tries):
        ratio = ratio_at(math.exp(place))
        usable = 0.0 < ratio < math.inf
        if usable:
            points.append((place, math.log(ratio)))
            if abs(math.log(ratio / target)) < math.log(close):
                break
        if ratio > target:
            high = place
        else:
            low = place
        if low >= 0.0:
            break
        if len(points) > 1 and points[-1][0] != points[-2][0]:
            slope = (points[-1][1] - points[-2][1]) / (points[-1][0] - points[-2][0])
            power = min(max(slope, 0.3), 4.0)
        step = math.log(target / ratio) / power if usable else math.copysign(1.5, target - ratio)
        if low < place + step < high:
            place += step
        else:
            place = 0.0 if high == 0.0 and step > 0.0 else 0.5 * (low + high)
    if not points:
        return 0.0, 0.0
    nearest = min(points, key=lambda point: abs(point[1] - math.log(target)))
    return math.exp(nearest[0]), math.exp(nearest[1])
