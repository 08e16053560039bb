"""Generates the lines of an integration loop that store and look up past signals for elements with a dead time.

A model without such elements has none of these lines. `history` holds the functions that they call.
"""

from dataclasses import dataclass

from rhythmid.simulation.history import SIGNALS

POSITION = 0  # index of the position among the states; that of its velocity is 1

PADE = 4  # order of the Padé approximation of a dead time
FEWEST_STEPS_OF_DELAY = 4.0  # least number of integration steps in the dead time of this approximation


@dataclass(frozen=True)
class DelayedSignal:
    """A signal that an element needs at an earlier time. `delay` is the variable with the dead time in the
    generated code; `jumps` says whether the signal jumps where the command does."""

    delay: str
    jumps: bool


def rational_past(signal: str, delay: str, step: str, first: int) -> tuple[str, list[str]]:
    """A delayed signal by Padé's approximation [4/4], as an expression, and lines with the rates of its four states.

    With x = s τ, Q(x) = 1 + x/2 + 3x²/28 + x³/84 + x⁴/1680 and Q(x) w = z, the output is Q(−x) w = z − w′ − w‴/42,
    with an error below 4e-8 |x|⁹ (G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., 2013, section 9.3.1).
    A dead time shorter than a few steps is represented as a share of one that long, which agrees to first order in
    frequency. `first` is the index of the first state.
    """
    w = [f"s{first + k}" for k in range(PADE)]
    lasting = f"max({delay}, {FEWEST_STEPS_OF_DELAY} * {step})"
    lines = [f"d{first + k} = {w[k + 1]} / {lasting}" for k in range(PADE - 1)]
    lines.append(
        f"d{first + 3} = (1680.0 * ({signal} - {w[0]}) - 840.0 * {w[1]} - 180.0 * {w[2]} - 20.0 * {w[3]}) / {lasting}"
    )
    return f"{signal} - {delay} / {lasting} * ({w[1]} + {w[3]} / 42.0)", lines


@dataclass(frozen=True)
class HistoryLines:
    """Lines of the loop for these signals. `smooth` as in `generate`: where it is True, no signal jumps."""

    signals: tuple[DelayedSignal, ...]
    smooth: bool

    @property
    def _delays(self) -> tuple[DelayedSignal, ...]:
        """The signals, one per delay."""
        return tuple({one.delay: one for one in self.signals}.values())

    @property
    def width(self) -> int:
        """Number of columns of the history."""
        return SIGNALS + 3 * len(self.signals)

    @property
    def given(self) -> list[str]:
        """Names of further arguments of the right-hand side."""
        return [name for m in range(len(self.signals)) for name in (f"old{m}", f"share{m}")]

    @property
    def returned(self) -> list[str]:
        """Names of its further return values."""
        return [f"now{m}" for m in range(len(self.signals))]

    @property
    def present(self) -> list[str]:
        """Use every signal without its delay."""
        return [f"old{m} = 0.0; share{m} = 1.0" for m in range(len(self.signals))]

    def _row(self, one: DelayedSignal) -> str:
        return f"row_{one.delay}"

    @property
    def oldest(self) -> str:
        """The oldest row that is still needed; for a slope, the row before the one to which a delay reaches back."""
        return f"max(min({', '.join([*(self._row(one) for one in self._delays), 'last'])}) - 1, 0)"

    def look_up(self, time: str, within: bool = False) -> list[str]:
        """Look up the signals at a time; with `within`, jumps at the end of a step are still to come."""
        found = "row_until" if within else "row_at"
        rows = [
            f"{self._row(one)} = {found}(past, {self._row(one)}, last, {one.delay}, {time})"
            for one in self._delays
        ]
        values = [
            f"old{m}, share{m} = earlier(past, {self._row(one)}, last, {SIGNALS + 3 * m}, {time} - {one.delay}, {time})"
            for m, one in enumerate(self.signals)
        ]
        return [*rows, *values]

    @property
    def begun(self) -> list[str]:
        """Start a row at the start of a stretch of steps or of a sample."""
        return [f"began(past, last, t, {'False' if self.smooth else 'ku[i] == t'})"] if self.signals else []

    @property
    def stops(self) -> list[str]:
        """End the stretch where a delayed jump arrives."""
        jumping = [] if self.smooth else [one for one in self._delays if one.jumps]
        return [
            line
            for one in jumping
            for line in (
                f"{self._row(one)} = row_at(past, {self._row(one)}, last, {one.delay}, t)",
                f"until = jump_until(past, {self._row(one)}, last, {one.delay}, until)",
            )
        ]

    def keep(self, stage: int) -> list[str]:
        """Store the signals of a stage: start, mean of the two estimates of the middle, end."""
        lines = ["past[last, 1] = h"] if self.signals and stage == 1 else []
        for m in range(len(self.signals)):
            place = SIGNALS + 3 * m
            lines += {
                1: [
                    f"past[last, {place}] = now{m}",
                    "if last > 0 and past[last, 2] == 0.0:",
                    f"    past[last - 1, {place + 2}] = now{m}",
                ],
                2: [f"past[last, {place + 1}] = 0.5 * now{m}"],
                3: [f"past[last, {place + 1}] += 0.5 * now{m}"],
                4: [f"past[last, {place + 2}] = now{m}"],
            }[stage]
        return lines

    @property
    def next_row(self) -> list[str]:
        """Advance to the next row, with room for it; rows that no delay reaches are dropped there."""
        if not self.signals:
            return []
        return [
            "if last + 1 == past.shape[0]:",
            f"    oldest = {self.oldest}",
            "    past = with_room(past, oldest, last)",
            "    last -= oldest",
            *(f"    {self._row(one)} -= oldest" for one in self._delays),
            "last += 1",
            "began(past, last, t, False)",
        ]

    def before_the_start(
        self, states: int, memories: list[int], find: list[str], inputs: dict[str, list[str]], call: str
    ) -> list[str]:
        """The past of a run without a given history: command and forcing are known; the states are extrapolated
        back along their rates, the position (z0) also along the rate of its velocity (z1).

        `call` evaluates the right-hand side at the states `z0`, `z1`, … and the time `at`.
        """
        if not self.signals:
            return []
        columns = range(0, 3 * len(self.signals), 3)
        until = "times[0]" if self.smooth else "min(times[0], ku[i + 1])"

        def evaluated(at: str, column: int) -> list[str]:
            return [
                *inputs[at],
                f"at = {at}",
                *(
                    f"z{i} = s{i}"
                    if i in memories
                    else f"z{i} = s{i} + (at - times[0]) * e{i}"
                    + (" + 0.5 * (at - times[0]) ** 2 * e1" if i == POSITION else "")
                    for i in range(states)
                ),
                call,
                *(f"past[last, {SIGNALS + c + column}] = now{c // 3}" for c in columns),
            ]

        return [
            *(f"{self._row(one)} = 0" for one in self._delays),
            *(f"{one.delay} = max({one.delay}, 0.0)" for one in self._delays),
            "last = past.shape[0] - 1",
            "if last < 0:",
            f"    past = with_room(np.zeros((1, {self.width})), 0, 0)",
            "    last = 0",
            *(f"    {line}" for line in [*find, *inputs["t"], "at = t", *self.present]),
            *(f"    z{i} = s{i}" for i in range(states)),
            f"    {call}",
            *(f"    e{i} = a1_{i}" for i in range(states)),
            *(f"    {piece} = 0" for piece in "ijl"),
            f"    t = times[0] - max({', '.join(['0.0', *(one.delay for one in self._delays)])})",
            "    while t < times[0]:",
            *(f"        {line}" for line in [*find, *self.begun]),
            f"        until = {until}",
            "        substeps = max(1, int(math.ceil((until - t) / max_step * (1.0 - 1e-9))))",
            "        begin = t",
            "        h = (until - begin) / substeps",
            "        half = 0.5 * h",
            "        for substep in range(substeps):",
            "            past[last, 1] = h",
            *(
                f"            {line}"
                for column, at in enumerate(("t", "t + half", "t + h"))
                for line in evaluated(at, column)
            ),
            "            t = begin + (substep + 1) * h",
            *(f"            {line}" for line in self.next_row),
            "        t = until",
            "    t = times[0]",
        ]
