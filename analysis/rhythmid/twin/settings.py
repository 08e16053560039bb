"""Settings of the live twin: the meaning of its signals, and the allowed false-alarm rate."""

from dataclasses import dataclass

from rhythmid.errors import InputError
from rhythmid.record.record import Record
from rhythmid.simulation.right_hand_side import DRIVES, InputKind, OutputKind
from rhythmid.simulation.signal import Hold

# [s]; four of the longest window, below which the scatter of its statistic is not known
SHORTEST_HEALTHY = 20.0


@dataclass(frozen=True)
class Settings:
    """Settings for reading and judging the signals of a twin.

    Attributes
    ----------
    input_kind, output_kind, hold : as in signals.yaml.
    healthy : length [s] of the initial stretch that is taken for healthy operation, where there is no calibration.
    false_alarms : average number allowed a day of healthy operation.
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
        """Settings for the content of a record."""
        return cls(record.input_kind, record.output_kind, record.hold, healthy, false_alarms)
