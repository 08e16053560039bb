"""Figures of a model's residual: over time, over the cycle, over the states, over frequency."""

from collections.abc import Iterator, Sequence

import numpy as np

from rhythmid.report.blocks import Block, Columns, Drawing, Fold, Paragraph, Table, drawing
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.motion_figures import over_time, portrait, shaded, time_link
from rhythmid.report.quantity import number, percent, plus_minus, pretty_unit, scaled, with_unit
from rhythmid.report.row_chart import Change, draw_changes
from rhythmid.report.run import (
    FEWEST_SAMPLES,
    Compared,
    Error,
    Harmonic,
    Run,
    Which,
    by_phase,
    density,
    error_of,
    harmonics,
)
from rhythmid.report.state_map import draw_maps, state_map
from rhythmid.statistics import NORMAL_95

HELD_OUT = "held out"
MOST_SHOWN = 12  # records drawn in full; all are in the table


def residual_folds(runs: Sequence[Run], compared: Compared, position: str) -> list[Fold | Paragraph]:
    """The figures of every record, opened for the held-out record with the largest gain. Of very many records only the most
    informative are shown.

    `position` is the unit of the motion.
    """

    def gain(run: Run) -> float:
        before, after = error_of([run], "before"), error_of([run], "after")
        return 0.0 if before is None else before.rms - (after.rms if after and run.after is not None else 0.0)

    drawable = [run for run in runs if run.used.sum() >= FEWEST_SAMPLES]
    ranked = sorted(drawable, key=gain, reverse=True)[:MOST_SHOWN]
    opened = next((run for run in ranked if run.heldout), ranked[0] if ranked else None)
    blocks: list[Fold | Paragraph] = []
    for run in (r for r in drawable if r in ranked):
        before, after = error_of([run], "before"), error_of([run], "after")
        told = percent(before.ratio if before else None)
        if run.after is not None:
            told += f" → {percent(after.ratio if after else None)}"
        role = HELD_OUT if run.heldout else "used in the fit"
        blocks.append(
            Fold(
                f"{run.name} ({role}): error {told} of the {compared.quantity}",
                residual_figures(run, compared, position),
                run is opened,
            )
        )
    if len(drawable) > len(ranked):
        blocks.append(
            Paragraph(
                f"The {len(ranked)} records of {len(drawable)} that gain most are drawn; the table above has all.",
                "note",
            )
        )
    return blocks


def residual_figures(run: Run, compared: Compared, position: str) -> tuple[Block, ...]:
    """Motion and residual of one record over time, then over cycle, states and frequency; `position` is the unit of the motion."""
    size = float(np.quantile(np.abs(run.residual("before")[run.used]), 0.98))
    factor, shown = scaled(size, compared.unit)
    further = (
        portrait(run, compared),
        _over_cycle(run, factor, shown),
        _over_states(run, position, factor, shown),
        _over_frequency(run, compared),
    )
    return (
        over_time(run, compared),
        _over_time(run, compared, factor, shown),
        Columns(tuple(figure for figure in further if figure is not None)),
    )


def _curves(run: Run, factor: float) -> tuple[Curve, ...]:
    curves = [Curve(run.time, factor * run.residual("before"), run.labels[0], "before")]
    if run.after is not None:
        curves.append(Curve(run.time, factor * run.residual("after"), run.labels[1], "after"))
    return tuple(curves)


def _over_time(run: Run, compared: Compared, factor: float, unit: str) -> Drawing:
    hidden_parts = shaded(run)
    change = (
        " The second is the narrower, the more of the mismatch the effect explains."
        if run.after is not None
        else ""
    )
    hidden = " Shaded: hidden from the fit." if hidden_parts else ""
    return drawing(
        "Residual over time",
        Chart(
            f"{run.name}: measured minus {compared.made} {compared.quantity} over time. {_rms_words(run, factor, unit)}",
            "time [s]", f"measured − {compared.made} [{pretty_unit(unit)}]", _curves(run, factor), shaded=hidden_parts,
            link=time_link(run),
        ),
        f"What each model misses of {run.name}, moment by moment.{change}{hidden}",
        wide=True,
    )  # fmt: skip


def _rms_words(run: Run, factor: float, unit: str) -> str:
    before, after = error_of([run], "before"), error_of([run], "after")
    words = "" if before is None else f"rms {number(factor * before.rms, 3)} {unit} {run.labels[0]}"
    if after is not None and run.after is not None:
        words += f", {number(factor * after.rms, 3)} {unit} {run.labels[1]}"
    return words + "."


def _over_cycle(run: Run, factor: float, unit: str) -> Drawing | None:
    curves = []
    shown: tuple[tuple[Which, str], ...] = (("before", run.labels[0]), ("after", run.labels[1]))
    for which, label in shown:
        found = by_phase(run, which)
        if found is None or (which == "after" and run.after is None):
            continue
        phase, mean, std = found
        mean, half = factor * mean, NORMAL_95 * factor * std
        curves.append(Curve(phase, mean, label, which, low=mean - half, high=mean + half))
    if not curves:
        return None
    return drawing(
        "Residual over the cycle",
        Chart(
            f"{run.name}: mean residual over the phase of the forcing.", "phase of the forcing [cycles]",
            f"mean residual [{pretty_unit(unit)}]", tuple(curves), x_range=(0.0, 1.0),
        ),
        "The residual averaged over all cycles, from the forcing's peak (0) to the next (1). Bands: 95 % intervals of the mean. Where "
        "a band does not contain zero, the mismatch recurs in every cycle.",
    )  # fmt: skip


def _over_states(run: Run, length: str, factor: float, unit: str) -> Drawing:
    position, velocity = run.position[run.used], run.velocity[run.used]
    maps = [
        (
            "before" if run.after is not None else "",
            state_map(position, velocity, run.residual("before")[run.used]),
        )
    ]
    if run.after is not None:
        maps.append(("after", state_map(position, velocity, run.residual("after")[run.used])))
    rate = f"{length}/s"
    x_unit = scaled(float(np.ptp(position)), length)
    return Drawing(
        "Residual over position and velocity",
        draw_maps(
            f"{run.name}: mean residual over position x and velocity v{', before and after' if len(maps) > 1 else ''}.",
            maps, (x_unit[0], pretty_unit(x_unit[1])), (1.0, pretty_unit(rate)), (factor, pretty_unit(unit)),
        ),
        "Mean residual wherever the machine has been. Patches of one colour show in which states the model is wrong"
        + ("; after a good repair no patch is left." if len(maps) > 1 else "."),
    )  # fmt: skip


def _over_frequency(run: Run, compared: Compared) -> Drawing:
    frequency, whole = density(run, run.measured)
    _, before = density(run, run.residual("before"))
    factor, unit = scaled(float(np.max(whole)), compared.unit)
    curves = [Curve(frequency, factor * whole, f"measured {compared.quantity}", "measured"),
              Curve(frequency, factor * before, run.labels[0], "before")]  # fmt: skip
    if run.after is not None:
        curves.append(
            Curve(frequency, factor * density(run, run.residual("after"))[1], run.labels[1], "after")
        )
    return drawing(
        "Spectra of motion and residual" if compared.quantity == "motion" else "Spectra of effort and residual",
        Chart(
            f"{run.name}: amplitude spectral density of the {compared.quantity} and of what the models miss of it.",
            "frequency [Hz]", f"density [{pretty_unit(unit)}/√Hz]", tuple(curves), y_log=True, x_log=True,
        ),
        f"Spectra of the {compared.quantity} and of the residuals. Peaks that disappear are what was missing; a flat floor that remains is "
        "measurement noise.",
    )  # fmt: skip


def _parts(runs: Sequence[Run]) -> Iterator[tuple[Run, bool, str, str]]:
    """What errors are stated of: every record, and the end that was hidden from the fit where there is one; as (run, whether
    it is the hidden end, name, what it was used for)."""
    for run in runs:
        yield run, False, run.name, HELD_OUT if run.heldout else "fit"
        if run.hidden.any():
            yield run, True, f"{run.name}, its end", HELD_OUT


def error_changes(runs: Sequence[Run], noise: float | None, compared: Compared) -> Drawing:
    """Error of every record before and after; `noise` is the standard deviation of the measurement's averages."""
    rows: list[Change] = []
    for run, hidden, name, role in _parts(runs):
        before, after = error_of([run], "before", hidden), error_of([run], "after", hidden)
        if before is None:
            continue
        spread = before.rms / before.ratio if before.ratio else 0.0
        floor = 100.0 * noise / spread if noise is not None and spread > 0.0 else None
        name = f"{name}{' (held out)' if role == HELD_OUT else ''}"
        reached = 100.0 * after.ratio if after is not None and run.after is not None else None
        rows.append(
            Change(name if len(name) <= 44 else f"…{name[-43:]}", 100.0 * before.ratio, reached, floor)
        )
    shown = sorted(rows, key=lambda row: -row.before)[:30]
    repaired = any(row.after is not None for row in rows)
    before, after = runs[0].labels if runs else ("", "")
    legend = (("square before", before), *([("circle after", after)] if repaired else []))
    return Drawing(
        "Error of every record",
        draw_changes(
            f"Error of the {compared.quantity} in every record: "
            + "; ".join(
                f"{row.label} {number(row.before, 3)} %" + (f" to {number(row.after, 3)} %" if row.after is not None else "")
                for row in shown
            ),
            shown, f"error [% of the {compared.quantity}]",
        ),
        f"{'Squares: before; circles: after' if repaired else 'Squares: error'}. "
        + (
            "How small an error the noise allows is not known: nothing repeats in these records."
            if noise is None
            else "Upright ticks: what the measurement noise alone would leave. What lies at its tick cannot be improved any further."
        ),
        legend,
    )  # fmt: skip


def error_table(runs: Sequence[Run], compared: Compared) -> Table:
    """The same as numbers."""
    rows = []
    repaired = any(run.after is not None for run in runs)
    for run, hidden, name, role in _parts(runs):
        before, after = error_of([run], "before", hidden), error_of([run], "after", hidden)
        row = [name, role, _told(before, compared.unit)]
        rows.append((*row, _told(after, compared.unit)) if repaired else tuple(row))
    columns = ("record", "used for", "before" if repaired else "error")
    sized = any(run.size is not None for run in runs)
    return Table(
        f"Rms residual, and its share of the {compared.quantity} ({'rms' if sized else 'standard deviation'}) with a 95 % interval "
        "from ten stretches of the record.",
        (*columns, "after") if repaired else columns,
        tuple(rows),
    )


def _told(error: Error | None, unit: str) -> str:
    if error is None:
        return "—"
    factor, shown = scaled(error.rms, unit)
    return f"{with_unit(number(factor * error.rms, 3), shown)}, {percent(error.ratio, error.half)}"


def cycle_harmonics(run: Run, unit: str, noise: float) -> Table | None:
    """Harmonics of the forcing in a record, and the models' errors in them; None without forcing."""
    found = harmonics(run, noise)
    if not found:
        return None
    factor, shown = scaled(max(h.measured for h in found), unit)

    def told(value: float | None, one: Harmonic) -> str:
        return (
            "—"
            if value is None
            else with_unit(plus_minus(factor * value, NORMAL_95 * factor * one.std), shown)
        )

    repaired = run.after is not None
    columns = ("harmonic of the forcing", "measured", "missed before", "missed after")
    rows = [
        (
            f"harmonic {h.number}",
            told(h.measured, h),
            told(h.before, h),
            *([told(h.after, h)] if repaired else []),
        )
        for h in found
    ]
    return Table(
        f"Amplitudes of the limit cycle in {run.name}, and what the {run.labels[0]}{' (before) and the final one (after)' if repaired else ''} "
        f"miss{'' if repaired else 'es'} of them; 95 % intervals by the measurement noise.",
        columns if repaired else (*columns[:2], "missed"),
        tuple(rows),
    )
