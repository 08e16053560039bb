"""What the live twin is told: how its signals are to be read, and how often it may be wrong."""

from dataclasses import dataclass

from rhythmid.errors import InputError
from rhythmid.record.record import Record
from rhythmid.simulation.generated_source import DRIVES, InputKind, OutputKind
from rhythmid.simulation.signal import Hold

SHORTEST_HEALTHY = (
    20.0  # s; four of the longest window, below which the scatter of its statistic is not known
)


@dataclass(frozen=True)
class Settings:
    """How a twin reads its signals and judges them.

    Attributes
    ----------
    input_kind, output_kind, hold : as in signals.yaml.
    healthy : length [s] of the stretch at the beginning that is taken for healthy operation, where there is no calibration.
    false_alarms : how many a day of healthy operation are allowed on average.
    """

    input_kind: InputKind = "force"
    output_kind: OutputKind = "position"
    hold: Hold = "zero"
    healthy: float = 60.0
    false_alarms: float = 1.0

    def __post_init__(self) -> None:
        if not self.healthy >= SHORTEST_HEALTHY:
            raise InputError(
                f"the healthy stretch lasts {self.healthy:g} s; at least {SHORTEST_HEALTHY:g} s are needed"
            )
        if not 0.0 < self.false_alarms <= 1e3:
            raise InputError(f"{self.false_alarms:g} false alarms a day: between 0 and 1000 are expected")
        if self.input_kind not in DRIVES:
            raise InputError(
                f"a twin of a machine whose input is a {self.input_kind.replace('_', ' ')} cannot be run"
            )

    @classmethod
    def of(cls, record: Record, healthy: float = 60.0, false_alarms: float = 1.0) -> "Settings":
        """Settings for what a record holds."""
        return cls(record.input_kind, record.output_kind, record.hold, healthy, false_alarms)
