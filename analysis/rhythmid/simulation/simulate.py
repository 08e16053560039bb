"""The one simulator: every run of a model, in a node, offline or inside a fit, uses it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.compiled import Compiled, compile_model
from rhythmid.simulation.signal import pieces
from rhythmid.simulation.transport import MEASUREMENT, delayed_command, physical_times

Array = NDArray[np.float64]
MAX_STEP = 2.5e-4  # [s] four steps per sample at 1 kHz


@dataclass(frozen=True)
class Trajectory:
    """A simulated run; all arrays of shape (n,) except `states` (n, q).

    `time` [s] are the requested stamps, `physical` [s] the times of the machine: earlier by the measurement delay.
    `output` is the sensor's value; `effort` the total actuator force; `states` all states.
    """

    time: Array
    physical: Array
    position: Array
    velocity: Array
    effort: Array
    output: Array
    states: Array


def start_states(
    model: Model,
    compiled: Compiled,
    position: float,
    velocity: float,
    command: float = 0.0,
    forcing: float = 0.0,
) -> Array:
    """State vector at the start: position [m], velocity [m/s], and the elements' own states after a long time with
    this command and forcing [N]."""
    start = np.zeros(len(compiled.layout.states))
    start[:2] = position, velocity
    index = {name: i for i, name in enumerate(compiled.layout.states)}
    for term in model.terms:
        if term.element.own and term.element.initial is not None:
            borrowed = {
                n: model.borrowed(source, default) for n, (source, default) in term.element.borrows.items()
            }
            arguments = term.numbers | borrowed
            signal = command if term.element.slot == "command" else command + forcing
            for state, value in zip(
                term.element.own, term.element.initial(position, velocity, signal, **arguments)
            ):
                place = index.get(f"{term.label}.{state}")
                if place is not None:  # there is none in the command path of a machine driven by its base
                    start[place] = value
    return start


def simulate(
    model: Model,
    times: Array,
    command: PPoly | None = None,
    forcing: PPoly | None = None,
    initial: tuple[float, float] | Array = (0.0, 0.0),
    max_step: float = MAX_STEP,
    seed: int | None = None,
) -> Trajectory:
    """Simulate a model and sample it.

    `times` (n,) [s] are the stamps of the measurements, increasing; `command` u [N] over its stamps; `forcing` f0 [N]
    in physical time. `initial` is (position, velocity) or a full state vector at the first physical time. With a
    `seed` the model's noise and rounding are applied to the output, without one the output is deterministic.
    Raises InputError when the simulation diverges or the times do not increase.
    """
    times = np.ascontiguousarray(times, dtype=float)
    physical = np.ascontiguousarray(physical_times(model, times))
    if len(times) < 1 or not np.isfinite(physical).all() or np.any(np.diff(times) < 0):
        raise InputError("simulation times must increase")
    compiled = compile_model(model)
    start = np.asarray(initial, dtype=float)
    if start.shape == (2,):
        start = start_states(model, compiled, *start)
    knots_u, pieces_u = pieces(delayed_command(model, command))
    knots_w, pieces_w = pieces(forcing)
    n = len(compiled.layout.states)
    out = np.empty((len(times), n + 2))
    done = compiled.run(
        physical, knots_u, pieces_u, knots_w, pieces_w, *pieces(None),
        compiled.layout.vector(model), np.ascontiguousarray(start), max_step, out,
    )  # fmt: skip
    if done < len(times) or not np.isfinite(out[-1]).all():
        raise InputError(
            f"the simulation diverges at t = {times[min(done, len(times) - 1)]:.4g} s; check the parameters"
        )
    output = out[:, n]
    if seed is not None:
        for sample in samplers(model, seed):
            output = sample(times, output)
    return Trajectory(times, physical, out[:, 0], out[:, 1], out[:, n + 1], output, out[:, :n])


def samplers(model: Model, seed: int) -> list:
    """Operations on sampled outputs, in order: one function (stamps, samples) -> samples for each noise or rounding."""
    return [
        term.element.sampler(np.random.default_rng([seed, index]), **term.numbers)
        for index, term in enumerate(model.terms)
        if term.element.slot in MEASUREMENT and term.element.sampler is not None
    ]
