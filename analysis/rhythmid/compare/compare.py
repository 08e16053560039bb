"""Compare a simulation's record directly with a real one: where do they differ?

The two are aligned by the command, interpolated at common times and subtracted. The difference is then located in time, in the cycle, in
the states, in frequency and among harmonics; `explain` finds the slot of the signal path where it arises. Nothing is refitted. If
the excitations differ, a given model replaces the simulation: it is fitted to the simulation and run with the recording's inputs.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.compare.align import Alignment, align
from rhythmid.compare.explain import Explanation, explain
from rhythmid.compare.pair import Pair, harmonic_columns, pair_of
from rhythmid.compare.place import HARMONICS, Place, place_of
from rhythmid.elements.places import SENTENCES
from rhythmid.errors import InputError
from rhythmid.identify.output_error import estimate, start_only
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.record.cleaning import cleaned
from rhythmid.record.record import Channel, Record
from rhythmid.report.comparison import LABELS
from rhythmid.report.quantity import number, pretty_unit
from rhythmid.report.run import Run
from rhythmid.result import Result, Row, axis_or_new, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HarmonicRatio:
    """Ratio of the recording's harmonic of the forcing to the simulation's: `gain`, and the delay `late` [s] from the phase."""

    number: int
    gain: float
    late: float


@dataclass(frozen=True, eq=False)
class Comparison(Result):
    """A simulation beside a recording.

    Attributes
    ----------
    simulation, recording
        Names of the two records.
    alignment
        Offset between their clocks, and the channel that it was found from.
    through_model
        Whether a model ran in the simulation's place.
    rates
        Sample rates of simulation and recording [Hz].
    pair
        Both motions at common times.
    nrmse
        Root mean square of the difference over the standard deviation of the recording.
    explanations
        Changes that reduce the difference, the largest share first.
    left
        Remainder of the difference after the explanations; float64[n], in `unit`.
    place
        Where in time, frequency, cycle and state the difference lies.
    harmonics
        Ratios of the forcing's harmonics, recording over simulation.
    unit
        Unit of the measured motion.
    notes
        Notes for the user, one line each.
    """

    simulation: str
    recording: str
    alignment: Alignment
    through_model: bool
    rates: tuple[float, float]
    pair: Pair
    nrmse: float
    explanations: tuple[Explanation, ...]
    left: Array
    place: Place
    harmonics: tuple[HarmonicRatio, ...]
    unit: str
    notes: tuple[str, ...]

    @property
    def parted(self) -> bool:
        """Whether they differ by more than noise."""
        return any(one.slot is not None for one in self.explanations)

    @property
    def slot(self) -> str | None:
        """Slot of the signal path in which most of the difference arises; None where they agree."""
        return next((one.slot for one in self.explanations if one.slot is not None), None)

    @property
    def comparable(self) -> bool:
        """Whether both had the same excitation, or a model has compensated for the difference."""
        return self.through_model or not self.alignment.mismatch

    def to_dict(self) -> dict[str, Any]:
        """The comparison as plain JSON data."""
        place = self.place
        return {
            "simulation": self.simulation,
            "recording": self.recording,
            "summary": self.headline,
            "comparable": self.comparable,
            "through_model": self.through_model,
            "parted": self.parted,
            "alignment": {
                "by": self.alignment.by,
                "offset": {"value": self.alignment.offset, "std": self.alignment.std, "unit": "s"},
                "forcing_turned": {"value": self.alignment.turn, "unit": "s"},
                "command_difference": self.alignment.difference,
                "mismatch": self.alignment.mismatch,
            },
            "rates": {"simulation": self.rates[0], "recording": self.rates[1], "unit": "Hz"},
            "overlap": {"value": float(self.pair.time[-1] - self.pair.time[0]), "unit": "s"},
            "nrmse": self.nrmse,
            "noise_nrmse": self.pair.noise / max(float(np.std(self.pair.recording)), 1e-300),
            "slot": self.slot,
            "explanations": [
                {
                    "name": one.name, "slot": one.slot, "explained": one.explained, "also": list(one.also),
                    "parameters": {name: {"value": v, "unit": unit} for name, (v, unit) in one.values.items()},
                }
                for one in self.explanations
            ],
            "time": {"first": place.first, "strongest": place.strongest, "growth": place.growth, "unit": "s"},
            "phase": None if place.phase is None else {"value": place.phase, "share": place.phase_share, "unit": "cycle"},
            "state": {"position": place.position, "velocity": place.velocity, "unit": self.unit},
            "frequency": {
                "value": place.frequency, "share": place.frequency_share, "harmonic": place.harmonic,
                "coherence_with_command": place.coherence, "unit": "Hz",
            },
            "harmonics": [{"number": h.number, "gain": h.gain, "late": h.late} for h in self.harmonics],
            "notes": list(self.notes),
        }  # fmt: skip

    @property
    def headline(self) -> str:
        """The answer in a few sentences; the JSON's `summary`."""
        if not self.comparable:
            return f"Not comparable: different excitation ({self.alignment.mismatch}); with --model the model is run in the simulation's place."
        size = f"{number(100 * self.nrmse, 3)} % of the motion"
        started = any(one.slot is None for one in self.explanations)
        if not self.parted:
            return (
                f"Simulation and recording agree within the noise: the difference of {size} is related to no signal."
                if not started
                else f"Simulation and recording agree but for another start, which dies out; the difference was {size}."
            )
        causes = [one for one in self.explanations if one.slot is not None]
        said = "; then ".join(_cause(one) for one in causes)
        return f"They part by {size}, {SENTENCES[causes[0].slot or 'force']}: {said}. {self._where()}"

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`explanations` of the difference, the largest first, and `harmonics` of the forcing, recording over simulation."""
        return {
            "explanations": [
                {"name": one.name, "slot": one.slot, "explained": one.explained, "also": ", ".join(one.also)}
                for one in self.explanations
            ],
            "harmonics": [{"number": h.number, "gain": h.gain, "late": h.late} for h in self.harmonics],
        }

    def show(self, console: "Console") -> None:
        """Print the alignment, the answer and its notes."""
        from rhythmid.compare.printed import show

        show(self.to_dict(), console)

    def plot(self, axis: "Axes | None" = None) -> "Axes":
        """Draw recording and simulation over time, their difference shaded; on a new figure where no axis is given."""
        axis, pair = axis_or_new(axis), self.pair
        axis.plot(pair.time, pair.recording, color="black", linewidth=1.0, label=self.recording)
        (simulated,) = axis.plot(
            pair.time, pair.simulation, linewidth=1.2, label=f"{self.simulation} (simulation)"
        )
        axis.fill_between(
            pair.time, pair.recording, pair.simulation, color=simulated.get_color(), alpha=0.25, linewidth=0.0,
            label="difference",
        )  # fmt: skip
        axis.set(xlabel="time [s]", ylabel=f"output [{pretty_unit(self.unit)}]")
        axis.margins(x=0.01)
        legend_above(axis)
        return axis

    def _where(self) -> str:
        place = self.place
        at = (
            "from the start"
            if place.first is None or place.first - self.pair.time[0] < 2.0 / self.pair.frequency
            else f"from {place.first:.4g} s on"
        )
        said = [f"The difference shows {at}"]
        if place.growth > 3.0:
            said.append("grows with time")
        if place.phase is not None and place.phase_share is not None and place.phase_share > 0.3:
            said.append(f"is greatest {place.phase:.2f} of a cycle after the forcing's peak")
        said.append(f"at x = {place.position:.4g} {self.unit}, v = {place.velocity:.3g} {self.unit}/s")
        line = f"harmonic {place.harmonic} of the forcing" if place.harmonic else "no harmonic of the forcing"
        if place.coherence is not None and not place.harmonic:
            line += ", " + (
                "it follows the command" if place.coherence > 0.6 else "it does not follow the command"
            )
        said.append(f"and is strongest at {place.frequency:.3g} Hz ({line})")
        return ", ".join(said) + "."


def _cause(one: Explanation) -> str:
    """An explanation in words."""
    share = f"{100 * one.explained:.0f} %"
    sizes = ", ".join(_size(v, unit) for v, unit in one.values.values())
    if one.name.replace("_", "").isalpha() and "_" in one.name:
        words = f"{one.name.replace('_', ' ')} {sizes}".strip()
    else:
        words = f"{'a force' if one.slot == 'force' else 'something'} that depends on {one.name}"
    if one.also:
        words += f" (or, seen from outside the same, {' or '.join(a.replace('_', ' ') for a in one.also)})"
    return f"{words} explains {share}"


def _size(value: float, unit: str) -> str:
    return f"{1e3 * value:.4g} ms" if unit == "s" else f"{value:.4g} {unit}".strip()


def run_of(found: Comparison) -> Run:
    """Recording and simulation in the form that figures need."""
    pair = found.pair
    return Run(
        name=found.recording,
        time=pair.time,
        measured=pair.recording,
        before=pair.simulation,
        after=pair.recording - found.left if found.explanations else None,
        position=pair.recording,
        velocity=pair.velocity,
        phase=pair.phase,
        used=pair.used,
        hidden=np.zeros_like(pair.used),
        labels=LABELS,
    )


def compare(
    simulation: Record,
    recordings: Record | Sequence[Record],
    model: Model | None = None,
    tell: Tell = lambda _: None,
) -> Comparison:
    """Compare a simulation with the recording of the same excitation, the best match of several.

    Parameters
    ----------
    simulation
        Record of the simulation.
    recordings
        One or more records of the machine.
    model
        Runs in the simulation's place, fitted to it, where the excitations differ.
    tell
        Called with a sentence at the beginning of each step.

    Raises
    ------
    InputError
        Where there is too little in common, or most of an output is clipped.

    Examples
    --------
    >>> import rhythmid as rh
    >>> run = {"excitation": {"type": "chirp", "amplitude": 0.02, "sweep": 3.0}, "noise": {"measurement_std": 1e-5}}
    >>> machine = rh.paper_hopper()
    >>> real = rh.simulate(machine.with_values({"linear_spring.stiffness": 190.0}), run).record
    >>> found = rh.compare(rh.simulate(machine, run).record, real)
    >>> found.parted
    True
    """
    recordings = [recordings] if isinstance(recordings, Record) else recordings
    for one in recordings:
        if one.output_kind != simulation.output_kind:
            raise InputError(
                f"{simulation.name} holds a {simulation.output_kind}, {one.name} a {one.output_kind}; name the same quantity under 'output:'"
            )
    tell("aligning simulation and recording")
    clean = [cleaned(one) for one in recordings]
    aligned = [(align(simulation, one.record), one.record, one.notes) for one in clean]
    alignment, recording, left_out = min(
        aligned, key=lambda case: (bool(case[0].mismatch), case[0].difference or 0.0)
    )
    known, through = simulation, False
    if model is not None and (alignment.mismatch or alignment.turn != 0.0):
        tell("fitting the model to the simulation and running it with the recording's inputs")
        known, through = in_its_place(simulation, recording, model), True
    pair, notes = pair_of(
        known, recording, replace(alignment, offset=0.0, turn=0.0) if through else alignment
    )
    notes = [*left_out, *notes, *_unit_notes(simulation, recording)]
    difference = pair.recording - pair.simulation
    tell("explaining the difference")
    if alignment.mismatch and not through:
        explanations, left = [], difference
    else:
        explanations, left = explain(
            pair,
            recording.output.unit,
            alignment.by == "output" and not through,
            alignment.turn != 0.0 and not through,
        )
    spread = float(np.std(pair.recording[pair.used]))
    return Comparison(
        simulation.name, recording.name, alignment, through,
        (1.0 / simulation.output.period, 1.0 / recording.output.period), pair,
        float(np.sqrt(np.mean(difference[pair.used] ** 2))) / max(spread, 1e-300),
        tuple(explanations), left, place_of(pair, difference), _ratios(pair), recording.output.unit, tuple(notes),
    )  # fmt: skip


def _unit_notes(simulation: Record, recording: Record) -> list[str]:
    a, b = simulation.output, recording.output
    if a.unit != b.unit:
        return [f"the simulation's output is in {a.unit}, the recording's in {b.unit}"]
    ratio = float(np.std(b.value)) / max(float(np.std(a.value)), 1e-300)
    if not 0.01 < ratio < 100.0:
        return [f"the recorded motion is {ratio:.3g} times the simulated one: check the units"]
    return []


def in_its_place(simulation: Record, recording: Record, model: Model) -> Record:
    """Response of the simulated machine to the recording's inputs: the model is fitted to the simulation and run with them."""
    fit = estimate(model, prepare([simulation]))
    series = prepare([recording])
    run = start_only(fit.model, series, fit.noise, fit.run.max_step)
    one = series[0]
    output = Channel(one.centres, one.averaged + run.residuals[0], simulation.output.unit, "model")
    return replace(recording, name=simulation.name, output=output)


def _ratios(pair: Pair) -> tuple[HarmonicRatio, ...]:
    if pair.pumping is None:
        return ()
    count = int(np.clip(0.4 / (pair.step * pair.pumping), 1, HARMONICS))
    columns = harmonic_columns(pair.time, pair.pumping, count)[pair.used]

    def harmonics(signal: Array) -> NDArray[np.complex128]:
        solution = np.linalg.lstsq(columns, signal[pair.used], rcond=1e-10)[0]
        return solution[1 : count + 1] - 1j * solution[count + 1 :]

    one, other = harmonics(pair.simulation), harmonics(pair.recording)
    found = []
    for index in range(count):
        if abs(one[index]) > max(10.0 * pair.noise / math.sqrt(len(columns)), 1e-3 * abs(one[0])):
            ratio = other[index] / one[index]
            late = -float(np.angle(ratio)) / (2.0 * np.pi * (index + 1) * pair.pumping)
            found.append(HarmonicRatio(index + 1, float(abs(ratio)), late))
    return tuple(found)
