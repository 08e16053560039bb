"""The user's requirements of an experiment to be designed."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from rhythmid.errors import InputError
from rhythmid.ltp.htf import transport_delays
from rhythmid.model import Model
from rhythmid.settings import Forcing
from rhythmid.unstated_forcing import NO_FORCING, forcing_of

Kind = Literal["comb", "multisine"]
KINDS: tuple[Kind, ...] = ("comb", "multisine")


@dataclass(frozen=True)
class Requirements:
    """Length, limits and conditions of the run to be designed.

    Attributes
    ----------
    duration
        Length of the run [s].
    band
        Lowest and highest frequency of the command [Hz].
    max_effort
        Largest |u| [N].
    envelope
        Lowest and highest measured position [m].
    noise_std
        Standard deviation of a single measured sample [m].
    kind
        A comb of shifted chirps or an interleaved multisine.
    rate
        Samples per second [Hz].
    harmonics
        M: the responses at ω + mω_p, |m| ≤ M, must not coincide; 0 without forcing.
    forcing
        Periodic force made on the robot. An amplitude of 0 with `harmonics` 0 means a machine without forcing.
    input_delay, measurement_delay
        Expected delays [s].
    longest_delay
        Upper limit of either delay [s].
    max_distortion
        Largest share of the response that its nonlinear part may reach; None for any.
    shifts
        K start phases of a comb; chosen where None.
    period, spacing
        Period [s] and spacing of the lines [Hz] of a multisine; chosen where None.
    seed
        Seed of the random phases.
    forcing_assumed
        Whether neither the model nor the user states the forcing, and one acts.

    Raises
    ------
    InputError
        Naming the option, for requirements that contradict one another.
    """

    duration: float
    band: tuple[float, float]
    max_effort: float
    envelope: tuple[float, float]
    noise_std: float
    kind: Kind = "multisine"
    rate: int = 1000
    harmonics: int = 3
    forcing: Forcing = Forcing()
    input_delay: float = 0.0
    measurement_delay: float = 0.0
    longest_delay: float = 0.3
    max_distortion: float | None = None
    shifts: int | None = None
    period: float | None = None
    spacing: float | None = None
    seed: int = 0
    forcing_assumed: bool = False

    @property
    def forced(self) -> bool:
        """Whether a forcing acts, so that the machine moves in a limit cycle."""
        return self.forcing.amplitude != 0.0

    @property
    def grid(self) -> float:
        """Frequency [Hz] an even number of whose periods is the period of a multisine: that of the forcing, or else half the rate."""
        return self.forcing.frequency if self.forced else 0.5 * self.rate

    @classmethod
    def of(
        cls,
        model: Model,
        duration: float,
        band: tuple[float, float],
        max_effort: float,
        envelope: tuple[float, float],
        noise_std: float,
        *,
        forcing: Forcing | None = None,
        unforced: bool = False,
        delays: tuple[float, float] | None = None,
        **further: Any,
    ) -> "Requirements":
        """Requirements whose forcing and delays are the model's own where they are not given.

        Where neither states a forcing, 1 N at 1 Hz is assumed for a machine in N and m, and none for any other.

        Parameters
        ----------
        model
            The machine.
        duration, band, max_effort, envelope, noise_std, forcing, further
            The attributes of these names.
        delays
            Of command and measurement, as expected [s].
        unforced
            Whether no forcing acts on the machine.

        Raises
        ------
        InputError
            For a forcing of a machine that is said to have none.
        """
        own, assumed = forcing_of(model)
        if unforced:
            if forcing is not None or model.term("periodic_forcing") is not None:
                raise InputError("--no-forcing contradicts the model's periodic_forcing or --forcing")
            forcing = NO_FORCING
        assumed = assumed and forcing is None
        unforced = unforced or (forcing is None and own == NO_FORCING)
        if unforced:
            further = {"harmonics": 0} | further
        late = transport_delays(model) if delays is None else delays
        return cls(
            duration, band, max_effort, envelope, noise_std, input_delay=late[0], measurement_delay=late[1],
            forcing=own if forcing is None else forcing, forcing_assumed=assumed, **further,
        )  # fmt: skip

    def __post_init__(self) -> None:
        for name, value in (
            ("duration", self.duration),
            ("max-effort", self.max_effort),
            ("noise-std", self.noise_std),
        ):
            if not (value > 0.0 and math.isfinite(value)):
                raise InputError(f"--{name} {value:g}: a finite number greater than 0 is expected")
        if self.kind not in KINDS:
            raise InputError(f"--kind {self.kind}: one of {', '.join(KINDS)} is expected")
        low, high = self.band
        if not 0.0 <= low < high < math.inf:
            raise InputError(f"--band {low:g} {high:g}: two frequencies in Hz are expected, 0 ≤ low < high")
        if not self.envelope[0] < self.envelope[1]:
            raise InputError(
                f"--envelope {self.envelope[0]:g} {self.envelope[1]:g}: two positions low < high are expected"
            )
        if self.max_distortion is not None and not self.max_distortion > 0.0:
            raise InputError(
                f"--max-distortion {self.max_distortion:g}: a share of the response greater than 0 is expected"
            )
        if self.rate < 1 or self.harmonics < (1 if self.forced else 0):
            raise InputError("--rate and --harmonics are whole numbers greater than 0")
        if not self.forced and self.harmonics > 0:
            raise InputError(
                "without forcing there is no limit cycle to excite about; give --forcing AMPLITUDE FREQUENCY, or --no-forcing "
                "for a machine that rests without a command"
            )
        if not self.forced and self.kind == "comb":
            raise InputError(
                "--kind comb shifts its chirps along the forcing; without forcing use --kind multisine"
            )
        for name, value in (("input", self.input_delay), ("measurement", self.measurement_delay)):
            if not 0.0 <= value <= self.longest_delay:
                raise InputError(
                    f"the {name} delay of {value:g} s is outside 0 to {self.longest_delay:g} s; "
                    "give --delays and --longest-delay that agree"
                )
        self._sampled()
        foreign = {
            "comb": {"period": self.period, "spacing": self.spacing},
            "multisine": {"shifts": self.shifts},
        }
        for name, value in foreign[self.kind].items():
            if value is not None:
                raise InputError(f"--{name} is none of a {self.kind}'s options")

    def _sampled(self) -> None:
        """Refuse a band, or sidebands of it, beyond the Nyquist frequency."""
        high, nyquist = self.band[1], 0.5 * self.rate
        if high >= nyquist:
            raise InputError(
                f"--band up to {high:g} Hz aliases: at {self.rate} Hz nothing beyond {nyquist:g} Hz is sampled"
            )
        top = high + self.harmonics * self.grid
        if top >= nyquist:
            raise InputError(
                f"sideband +{self.harmonics} of {high:g} Hz lies at {top:g} Hz and aliases: at {self.rate} Hz nothing beyond "
                f"{nyquist:g} Hz is sampled; lower --band or --harmonics, or raise --rate"
            )
