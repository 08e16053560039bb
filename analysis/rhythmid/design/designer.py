"""Design an experiment: a signal with separable responses, as large as the machine allows, and its predicted accuracy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.design.amplitude import Amplitude, largest_amplitude
from rhythmid.design.chirp_comb import chirp_comb
from rhythmid.design.distortion import Distortion, distortion, linearised_bias
from rhythmid.design.interleaved_multisine import interleaved_multisine
from rhythmid.design.prediction import Prediction, predict, require_unambiguous_delays
from rhythmid.design.rehearsal import Rehearsal
from rhythmid.design.requirements import Requirements
from rhythmid.design.signal_plan import SignalPlan
from rhythmid.design.waveform import Waveform, sampled
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.harmonic_likelihood import DELAYS, INPUT_DELAY, MEASUREMENT_DELAY, visible_sidebands
from rhythmid.identify.joint import without_forcing
from rhythmid.identify.joint_covariance import JointCovariance
from rhythmid.ltp.htf import LinearisedModel, linearised
from rhythmid.ltp.pumping import Pumping
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.result import Result, Row, axis_or_new
from rhythmid.settings import Delay, Noise, TimeMode

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

Array = NDArray[np.float64]
LOOKED_AT = range(1, 9)  # harmonics whose visibility above the noise is checked
STRONG = 0.05  # distortion, as a share of the response, from which a note is given
BIASED = 1.0  # bias [standard deviations] from which a note is given


@dataclass(frozen=True, eq=False)
class Design(Result):
    """An experiment ready to run, with its predictions.

    Attributes
    ----------
    requirements
        The given requirements.
    plan
        Frequencies and phases of the signal.
    command
        The samples that the file will hold.
    amplitude
        The size of the command, and which limit set it.
    experiment
        The run, as `rhythmid run` and `rhythmid simulate` play it.
    machine
        The model linearised about its limit cycle, without delays.
    prediction
        Standard deviations of all parameters and delays (Cramér-Rao bound).
    distortion
        Nonlinear part of the response, as a share of it.
    bias
        Bias of a fit to transfer functions, in standard deviations of each parameter.
    visible
        Harmonics |m| of the response that will be visible above the noise.
    output, still
        Measured position without noise, with and without command; float64[n], [m].
    """

    requirements: Requirements
    plan: SignalPlan
    command: Waveform
    amplitude: Amplitude
    experiment: Experiment
    machine: LinearisedModel
    prediction: Prediction
    distortion: Distortion
    bias: Mapping[str, float]
    visible: Sequence[int]
    output: Array
    still: Array

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user, one line each."""
        found = []
        if not self.requirements.forced:
            found.append(
                "without forcing only the sum of the two delays acts on the record: it is predicted as the input delay, and the "
                "measurement delay is fixed"
            )
        if self.requirements.forcing_assumed:
            forcing = self.requirements.forcing
            found.append(
                f"the model has no forcing: one of {forcing.amplitude:g} N at {forcing.frequency:g} Hz is "
                "assumed and part of the plan. The prediction, that of the two delays above all, holds only if it acts during the run; "
                "state it with --forcing, or --no-forcing where there is none"
            )
        if self.distortion.total > STRONG:
            found.append(
                f"the response departs from a linear one by {self.distortion.total:.1%}: transfer functions are distorted; "
                "--max-distortion bounds it"
            )
        worst = max(self.bias, key=lambda name: abs(self.bias[name]), default=None)
        if worst is not None and abs(self.bias[worst]) > BIASED:
            found.append(
                f"a fit to transfer functions would be biased, {worst} by {abs(self.bias[worst]):.3g} standard deviations; the "
                "joint fit of `rhythmid identify` simulates the nonlinear machine and is not"
            )
        apart = self.requirements.harmonics + self.plan.facts.get("empty_classes", 0)
        beyond = [m for m in self.visible if m > apart]
        if beyond:
            found.append(
                f"harmonics up to ±{beyond[-1]} of the response stand out of the noise, and those beyond ±{apart} fall on others; "
                f"--harmonics {beyond[-1]} would keep them apart"
            )
        return tuple(found)

    @property
    def headline(self) -> str:
        """Kind, length and size of the command."""
        unit = self.experiment.model.units.force
        return (
            f"{self.requirements.kind} of {self.command.duration:.4g} s with {len(self.plan.response.lines)} lines, peak "
            f"{self.command.peak:.4g} {unit} (limit: {self.amplitude.limited_by})"
        )

    @property
    def covariance(self) -> JointCovariance:
        """Predicted covariance of all free parameters, delays included."""
        return self.prediction.fit.joint_covariance

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`estimates`: each parameter and delay with its predicted standard deviation."""
        delays = {f"delay: {name}": one for name, one in self.prediction.delays.items()}
        known = {**self.prediction.parameters, **delays}
        return {"estimates": [{"name": name} | one.to_dict() for name, one in known.items()]}

    def show(self, console: "Console") -> None:
        """Print the prediction and a description of the run."""
        from rhythmid.design.printed import show

        show(self.to_dict(), console)

    def plot(self, axis: "Axes | None" = None) -> "Axes":
        """Draw the command over its first repetition; on a new figure where no axis is given."""
        from rhythmid.design.figure import draw_command

        axis = axis_or_new(axis)
        draw_command(axis, self)
        return axis

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `design --json`; plain numbers, lists and strings."""
        lines = self.plan.response
        return {
            "kind": self.requirements.kind,
            "duration": self.command.duration,
            "rate": self.requirements.rate,
            "amplitude": {
                "peak": self.command.peak,
                "rms": float(np.sqrt(np.mean(self.command.values**2))),
                "crest_factor": self.command.crest_factor,
                "limited_by": self.amplitude.limited_by,
                "unit": self.experiment.model.units.force,
            },
            "position": {
                "low": self.amplitude.low,
                "high": self.amplitude.high,
                "cycle": [float(self.still.min()), float(self.still.max())],
                "unit": self.experiment.model.units.position,
            },
            "signal": {
                **self.plan.facts,
                "lead_in": self.plan.lead_in,
                "window": self.plan.window,
                "harmonics": lines.harmonics,
                "frequencies": lines.frequency.tolist(),
            },
            "forcing": {
                "amplitude": self.requirements.forcing.amplitude,
                "frequency": self.requirements.forcing.frequency,
                "phase": self.requirements.forcing.phase,
                "assumed": self.requirements.forcing_assumed,
            },
            "parameters": {name: e.to_dict() for name, e in self.prediction.parameters.items()},
            "delays": {name: e.to_dict() for name, e in self.prediction.delays.items()},
            "distortion": {"even": self.distortion.even, "odd": self.distortion.odd},
            "bias_of_transfer_functions": dict(self.bias),
            "visible_harmonics": list(self.visible),
            "notes": list(self.notes),
        }


def with_delays(model: Model, requirements: Requirements, catalogue: Catalogue) -> Model:
    """The model with both delays at their expected values."""
    for name, value in (
        (INPUT_DELAY, requirements.input_delay),
        (MEASUREMENT_DELAY, requirements.measurement_delay),
    ):
        label = name.split(".")[0]
        if model.term(label) is None:
            model = model.with_element(catalogue[label], {"delay": value})
        else:
            model = model.with_values({name: value})
    return model


def _with_sum_of_delays(model: Model) -> Model:
    """The model with a fixed measurement delay: without a limit cycle only the sum of both delays has an effect."""
    late = model.parameters[MEASUREMENT_DELAY]
    return model.with_parameters({MEASUREMENT_DELAY: replace(late, fixed=True)})


def planned_experiment(model: Model, command: Waveform, requirements: Requirements) -> Experiment:
    """The run of this command in simulated time, as the experiment file will describe it."""
    return Experiment(
        without_forcing(model), Path("model.yaml"), command, {"type": "samples"},
        forcing=requirements.forcing, input_delay=Delay(requirements.input_delay),
        measurement_delay=Delay(requirements.measurement_delay), noise=Noise(requirements.noise_std),
        time=TimeMode(rate=requirements.rate), duration=command.duration,
    )  # fmt: skip


def design(
    model: Model,
    requirements: Requirements,
    catalogue: Catalogue | None = None,
    progress: Tell | None = None,
) -> Design:
    """Design a run of the `model`, whose values are assumed to be true.

    Parameters
    ----------
    model
        The machine; every parameter that is not fixed is to be determined.
    requirements
        Length, limits and circumstances of the run; `Requirements.of(model, …)` takes forcing and delays from the
        model.
    catalogue
        Elements beside the built-in ones.
    progress
        Called with a sentence at the beginning of each step.

    Raises
    ------
    InputError
        In one line, for a design that aliases, does not fit into its duration or envelope, or could not determine a free parameter.

    Examples
    --------
    >>> import rhythmid as rh
    >>> machine = rh.paper_hopper()
    >>> wanted = rh.Requirements.of(
    ...     machine, duration=24.0, band=(0.0, 5.0), max_effort=0.02, envelope=(0.1, 0.2), noise_std=1e-5, harmonics=1
    ... )
    >>> plan = rh.design(machine, wanted)
    >>> plan.command.peak <= 0.02
    True
    """
    told = progress or (lambda _: None)
    machine = with_delays(model, requirements, load_catalogue() if catalogue is None else catalogue)
    forcing = requirements.forcing
    pumping = Pumping.cosine(forcing.amplitude, forcing.frequency, forcing.phase)
    if not requirements.forced:
        machine = _with_sum_of_delays(machine)
    told("finding the limit cycle" if requirements.forced else "finding the rest position")
    plain = without_forcing(machine).with_values(dict.fromkeys(DELAYS, 0.0))
    linear = linearised(plain, pumping)
    ring_down = linear.cycle.ring_down
    if not np.isfinite(ring_down):
        raise InputError(
            f"the {'limit cycle' if requirements.forced else 'rest position'} is not stable: a command would not die out, and no run "
            "is long enough"
        )
    if requirements.forced:
        require_unambiguous_delays(linear.cycle, requirements.longest_delay)
    if requirements.kind == "comb":
        plan = chirp_comb(requirements, ring_down)
    else:
        plan = interleaved_multisine(requirements, ring_down, progress)
    shape = sampled(plan.excitation, requirements.duration, requirements.rate)
    settled = round(plan.lead_in * requirements.rate)
    told("simulating the run without a command")
    rehearsal = Rehearsal(planned_experiment(machine, shape, requirements), shape)
    amplitude = largest_amplitude(rehearsal, requirements, settled, progress)
    command = shape.with_peak(amplitude.peak)
    experiment = planned_experiment(machine, command, requirements)
    told("predicting the standard deviations")
    prediction = predict(machine, experiment, requirements.noise_std)
    told("predicting the distortion")
    bent = distortion(rehearsal, amplitude.peak, settled)
    record = prediction.record
    density = requirements.noise_std**2 / requirements.rate
    seen = visible_sidebands(record, plain, pumping, density, LOOKED_AT) if requirements.forced else ()
    return Design(
        requirements, plan, command, amplitude, experiment, linear, prediction, bent,
        linearised_bias(prediction.fit, bent.signal), seen,
        rehearsal.output(amplitude.peak), rehearsal.output(0.0),
    )  # fmt: skip
