"""Reads records from bags and tables, with the channels mapped by signals.yaml."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.progress import Tell, counted, silent
from rhythmid.record.arrival_bursts import without_bursts
from rhythmid.record.bag import Bag, is_bag
from rhythmid.record.channel_quality import channel_quality
from rhythmid.record.clocks import assumed_clock, assumed_columns, clock_notes
from rhythmid.record.columns import Columns, without_times
from rhythmid.record.foreign_file import refuse_foreign
from rhythmid.record.held_command import with_held_commands, with_hold
from rhythmid.record.merged_table import is_merged, is_sampled_rarely
from rhythmid.record.opened import Opened, fields_of
from rhythmid.record.placeholder import Placeholder, placeholder_of
from rhythmid.record.punctuality import punctuality_notes
from rhythmid.record.quality import ChannelQuality, Quality
from rhythmid.record.record import FEWEST_COMMON_SAMPLES, Channel, Record
from rhythmid.record.sign_bit import signed
from rhythmid.record.signals import WHOLE, Signals, Sinusoid, Source
from rhythmid.record.stale_rows import without_stale_rows
from rhythmid.record.standstill import is_driven
from rhythmid.record.table import Table, is_table, table_name
from rhythmid.record.time_origin import CALENDAR, counted_from, origin_of
from rhythmid.record.timing import put_in_order
from rhythmid.record.unit_notes import unit_notes

MOSTLY = 0.5  # share of samples that are not numbers above which a channel is unusable
LARGEST = 1e100  # largest measured value: its square is still finite
AMBIGUOUS = 0.01  # share of samples that may have the same time as another one with a different value
SPLIT = "take what lies before and after apart with  rhythmid split {table} --out runs"
USE_RECEIPT = "use  time: receive"
USE_STAMPS = "use  time: header  where the messages have stamps; else record what lies before and after in bags of their own"
SAMPLES_PER_CYCLE = 100  # of a forcing that is given by a formula
MOST_OF_FORMULA = 50_000_000  # samples of it, 400 MB: an hour at 100 Hz has 36 million


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of one channel as recorded: time [s] and value in the order of recording, latency [s], messages without
    it, and its placeholders, whose value is NaN."""

    source: Source
    time: NDArray[np.float64]
    value: NDArray[np.float64]
    lateness: NDArray[np.floating] | None = None
    missing: int = 0
    placeholder: Placeholder | None = None


def load_records(
    paths: Iterable[str | Path], signals: Signals | str | Path | None = None, tell: Tell = silent
) -> list[Record]:
    """Read several records, with progress messages; see `read_record`."""
    signals = Signals.load(signals) if isinstance(signals, (str, Path)) else signals
    given = list(paths)
    return list(counted((read_record(path, signals) for path in given), len(given), "records read", tell))


def read_record(
    source: str | Path, signals: Signals | str | Path | None = None, opened: Opened | None = None
) -> Record:
    """Read one record.

    Parameters
    ----------
    source : a bag directory, an .mcap or .db3 file, a signals.yaml that names tables, or a table for `signals`.
    signals : mapping of the channels; by default the topics of rhythmid's own nodes.
    opened : what was read of the source already, and what is read now.

    Times are relative to the first sample of any channel. A clock that started with the run (simulated time) keeps
    its own zero, as does the time column of a table, unless it counts from 1970. Messages out of order are sorted
    and duplicates dropped; both are counted in the record's quality. NaN and empty fields of a table count as
    missing.

    Raises InputError, one line, when there is no such recording, a topic or field is missing or empty, a used sample is
    infinite, time goes backwards, or too little is recorded.
    """
    if isinstance(signals, (str, Path)):
        signals = Signals.load(signals)
    source = Path(source)
    if source.suffix in (".yaml", ".yml"):
        given = Signals.load(source)
        if not given.from_tables:
            raise InputError(f"{source}: names topics of a bag; give the bag, and this file with --signals")
        return read_tables(given)
    try:
        there = source.exists()
    except OSError as error:  # an impossible path
        raise InputError(f"{source}: {error.strerror}") from None
    if not there:
        raise InputError(f"{source}: no such file or directory")
    refuse_foreign(source)
    if signals is not None and is_table(source):
        return read_tables(signals.of_table(source), opened)
    if not is_bag(source):
        raise InputError(
            f"{source}: is neither a bag (directory, .mcap, .db3) nor a signals.yaml that names tables; "
            f"the columns of a table have to be named with --signals, by a file that  rhythmid init {source}  writes"
        )
    if signals is not None and signals.from_tables:
        raise InputError(f"{signals.path}: names tables, so it takes the place of the bag {source}")
    return read_bag(Bag(source), signals, opened)


def read_bag(bag: Bag, signals: Signals | None = None, opened: Opened | None = None) -> Record:
    """Read a record from a bag. Raises InputError as `read_record` does."""
    chosen = (signals or Signals.default()).of_record(bag.name)
    wanted = fields_of(chosen)
    bag, columns, run = (opened or Opened()).bag(bag, wanted)
    description, notes = _description(run)
    if signals is None and chosen.channels["output"].topic not in bag.topics and description is not None:
        # rhythmid's own recordings state their namespace and joint
        named = Signals.default(str(description.get("namespace")), str(description.get("joint")))
        if named.channels["output"].topic in bag.topics:
            return read_bag(Bag(bag.path), named)
    if signals is None and not any(topic in bag.topics for topic in wanted):
        listed = ", ".join(sorted(bag.topics)) or "none"
        raise InputError(
            f"{bag.path}: no file says which of its topics is what; write one by  rhythmid init {bag.path}  and give it with --signals "
            f"(topics: {listed})"
        )
    samples = [
        (role, *_from_columns(bag, source, columns, chosen))
        for role, source in chosen.channels.items()
        if not (role in chosen.optional and source.topic not in bag.topics)
    ]
    first = min(int(stamp_ns.min()) for _, stamp_ns, _ in samples)
    start_ns = first if origin_of(first * 1e-9) else 0
    made = {role: replace(part, time=(stamp_ns - start_ns) * 1e-9) for role, stamp_ns, part in samples}
    mend = USE_RECEIPT if chosen.time.kind == "header" else USE_STAMPS
    quality = Quality({}, bag.truncated, (*bag.notes, *notes, *punctuality_notes(description)))
    record = _record(bag.name, made, chosen, mend, quality)
    return _finish(replace(record, start_ns=start_ns, hold=chosen.hold or "zero", run=description), chosen)


def read_tables(signals: Signals, opened: Opened | None = None) -> Record:
    """Read a record from the tables that `signals` names. Raises InputError as `read_record` does."""
    for source in signals.channels.values():
        if source.file is None:
            raise InputError(
                f"{source.place}'file:' is missing: whose column is it? Or give the table, and this file with --signals"
            )
    assert signals.path is not None
    name = table_name(signals.path)
    if name == "signals":  # the folder's name is more specific
        name = signals.path.resolve().parent.name
    signals, opened = signals.of_record(name), opened or Opened()
    tables = {
        file: opened.table(file) for source in signals.channels.values() if (file := source.file) is not None
    }
    made, stale = dict[str, Samples](), dict[str, None]()
    merged = {file: _is_merged(table, signals) for file, table in tables.items()}
    for role, source in signals.channels.items():
        assert source.file is not None
        table = tables[source.file]
        try:
            value = table.column(source.column)
            clock = source.clock(signals.time)
            if clock.kind == "column":
                time = table.column(clock.column) * clock.scale
            else:
                time = np.arange(len(value)) / clock.rate
        except InputError as error:
            raise InputError(f"{source.place}{error}") from None
        if len(time) != len(value):
            raise InputError(f"{source.place}{source} has {len(value)} rows, its time column {len(time)}")
        if not np.isfinite(time).all():
            raise InputError(
                f"{source.place}{table.path}: time is not finite in row {int(np.argmin(np.isfinite(time)))}"
            )
        time, value, old = without_stale_rows(time, _in_unit(value, source), table.path.name)
        stale |= old
        if merged[source.file] or is_sampled_rarely(value):  # its empty cells are no samples
            time, value = time[~np.isnan(value)], value[~np.isnan(value)]
        made[role] = Samples(source, time, value, placeholder=table.placeholder(source.column))
    clocks = {(source.file, source.clock(signals.time)) for source in signals.channels.values()}
    first = min((float(samples.time.min()) for samples in made.values() if len(samples.time)), default=0.0)
    told = [note for table in tables.values() for note in table.notes]
    quality = Quality({}, notes=(*unit_notes(signals, first >= CALENDAR), *told, *stale))
    calendar = first >= CALENDAR
    if calendar:  # the used part starts with its first row
        made = {role: replace(samples, time=samples.time - first) for role, samples in made.items()}
    record = _record(name, made, signals, SPLIT.format(table=" ".join(map(str, tables))), quality)
    record = replace(record, hold=signals.hold) if signals.hold else with_hold(record)
    record = _finish(replace(record, one_clock=len(clocks) == 1), signals, first if calendar else 0.0)
    return record if calendar else counted_from(record, origin_of(first))


def _is_merged(table: Table, signals: Signals) -> bool:
    """Whether a table merges rows of streams with their own timestamps; False for one without a time."""
    clocks = [source.clock(signals.time) for source in signals.channels.values() if source.file == table.path]
    times = {str(clock.column) for clock in clocks if clock.kind == "column"}
    return bool(times) and is_merged(value for name, value in table.vectors() if name not in times)


def _description(run: Sequence[bytes]) -> tuple[Mapping[str, Any] | None, list[str]]:
    """The newest description of the experiment, and a note if it cannot be read."""
    if not run:
        return None, []
    try:
        said = json.loads(run[-1][8:].rstrip(b"\0").decode())
    except ValueError:
        said = None
    return (said, []) if isinstance(said, dict) else (None, ["the topic run does not carry a JSON object"])


def _from_columns(
    bag: Bag, source: Source, columns: Mapping[str, Columns], signals: Signals
) -> tuple[NDArray[np.int64], Samples]:
    """Times [ns] and samples of one channel, in the order of recording."""
    if source.topic not in bag.topics:
        listed = ", ".join(sorted(bag.topics)) or "none"
        mend = "" if signals.path else "; say with --signals which of them is what"
        raise InputError(
            f"{source.place}topic {source.topic} is not in {bag.path}; its topics: {listed}{mend}"
        )
    if source.topic not in columns:
        raise InputError(
            f"{source.place}topic {source.topic} in {bag.path} is empty: no message was recorded"
        )
    found = columns[source.topic]
    assert source.field is not None
    missing = found.missing[source.field]
    if missing.all():
        raise InputError(
            f"{source.place}no message of {source.topic} in {bag.path} has {source.field.text}: "
            f"{found.reason[source.field]}"
        )
    clock = source.clock(signals.time).kind
    stamp_ns = found.times(clock)
    if stamp_ns is None:
        raise InputError(f"{source.place}{without_times(found, clock)}, within its braces, or for all")
    kept = ~missing
    lateness = None if clock == "receive" else np.asarray((found.log_ns - stamp_ns)[kept] * 1e-9)
    value = found.values[source.field][kept]
    if (placeholder := placeholder_of(value)) is not None:
        value = np.where(placeholder.where, np.nan, value)
    value = _in_unit(value, source)
    return stamp_ns[kept], Samples(source, np.empty(0), value, lateness, int(missing.sum()), placeholder)


@np.errstate(over="ignore", invalid="ignore")  # for numbers near the largest, and NaN of every kind
def _in_unit(value: NDArray[np.float64], source: Source) -> NDArray[np.float64]:
    """Values (n,) in SI or model units. Impossible ones, as from damaged bytes, become infinite and are rejected."""
    value = signed(value, source.sign_bit) * source.scale + source.one_offset
    return np.where(np.abs(value) > LARGEST, np.copysign(np.inf, value), value)


def _record(name: str, made: Mapping[str, Samples], signals: Signals, mend: str, quality: Quality) -> Record:
    """Channels in order of time without duplicates, and their quality as recorded."""
    channels: dict[str, Any] = {}
    judgement: dict[str, ChannelQuality] = {}
    given = {role: samples.source.clock(signals.time) for role, samples in made.items()}
    clocks = {role: clock.kind for role, clock in given.items()}
    columns = {role: str(clock.column) for role, clock in given.items() if clock.kind == "column"}
    stamped = clocks["output"] != "rate"
    for role, samples in made.items():
        label = f"{samples.source.place}{samples.source}"
        if len(samples.time) == 0:
            raise InputError(f"{label}: is empty")
        column = samples.source.clock(signals.time).column
        kept = put_in_order(samples.time, f"{label} (time: {column})" if column != "" else label, mend)
        time, value = samples.time[kept], samples.value[kept]
        conflicts = _conflicts(samples, time, value)
        absent = np.isnan(value)
        if absent.mean() > MOSTLY:
            marked = (
                ""
                if samples.placeholder is None
                else f", or {samples.placeholder.words} for nothing measured"
            )
            raise InputError(f"{label}: {int(absent.sum())} of {len(value)} samples are NaN or empty{marked}")
        if conflicts > AMBIGUOUS * len(samples.time):
            raise InputError(
                f"{label}: {conflicts} of {len(samples.time)} samples have the time of another one with another value: "
                f"two publishers, a clock set back or too coarse stamps; {mend}{_evenly(clocks[role])}"
            )
        judgement[role] = channel_quality(
            str(samples.source), samples.time, samples.lateness, time, value, stamped and role == "output", samples.missing, conflicts,
            samples.placeholder,
        )  # fmt: skip
        if absent.any():
            time, value = time[~absent], value[~absent]
        shared = next((c.time for c in channels.values() if np.array_equal(c.time, time)), time)
        channels[role] = Channel(shared, value, samples.source.unit, str(samples.source))
    channels, burst_notes = without_bursts(channels)
    assumed = (*assumed_clock(judgement, clocks), *assumed_columns(columns))
    notes = (*quality.notes, *clock_notes(judgement, clocks), *assumed_columns(columns), *burst_notes)
    return Record(
        name, input_kind=signals.input_kind, output_kind=signals.output_kind, forcing_law=signals.forcing_law,
        quality=replace(quality, channels=judgement, notes=notes, assumed=assumed),
        parameters=signals.declared(name), stamped=stamped,
        **channels,
    )  # fmt: skip


def _evenly(clock: str) -> str:
    """A further way to correct stamps that several rows share."""
    return (
        ", or, where the rows were taken evenly, give their rate: time: {sample_rate: HZ}, of init --rate HZ"
        if clock == "column"
        else ""
    )


def _conflicts(samples: Samples, time: NDArray[np.float64], value: NDArray[np.float64]) -> int:
    """Number of samples whose value differs from the one kept for the same time."""
    kept = value[np.searchsorted(time, samples.time)]
    return int(np.count_nonzero((samples.value != kept) & np.isfinite(samples.value)))


def _finish(record: Record, signals: Signals, began: float = 0.0) -> Record:
    """Count held commands as known, cut to the used part, reject unusable data, and add a forcing that is given by a
    formula. `began` [s] is the record's zero since 1970: the used part may be told by either."""
    record = with_held_commands(record)
    if (part := signals.part(record.name)) != WHOLE:
        record = record.cut(*(time - began if time >= CALENDAR else time for time in part))
    for role, channel in record.channels.items():
        finite = np.isfinite(channel.value)
        if not finite.all():
            raise InputError(
                f"{signals.channels[role].place}{channel.source}: {np.count_nonzero(~finite)} of {len(channel)} samples "
                f"are infinite, the first at {channel.time[np.argmin(finite)]:.6f} s (so is what is beyond {LARGEST:g})"
            )
    if len(record.output) < FEWEST_COMMON_SAMPLES:
        raise InputError(
            f"{record.name}: {record.output.source} has only {len(record.output)} samples: too short"
        )
    if np.ptp(record.output.value) == 0.0 and not is_driven(record):
        raise InputError(f"{record.name}: {record.output.source} never changes; nothing is learnt from it")
    _require_overlap(record)
    frequency = _pumping_frequency(record)
    if frequency > 0.0 and record.duration * frequency < 1.0:
        raise InputError(
            f"{record.name}: lasts {record.duration:.4g} s, less than one period of the forcing ({1 / frequency:.4g} s)"
        )
    if record.forcing_law is None:
        return record
    step = record.output.period
    if frequency > 0.0:
        step = min(step, 1.0 / (SAMPLES_PER_CYCLE * frequency))
    ends = [(channel.time[0], channel.time[-1]) for channel in record.channels.values()]
    start, end = min(first for first, _ in ends), max(last for _, last in ends)
    count = np.ceil((end - start) / step) + 1
    if not count <= MOST_OF_FORMULA:
        raise InputError(
            f"{record.name}: a forcing of {frequency:g} Hz cannot be followed over {end - start:g} s ({count:.3g} samples)"
        )
    time = start + np.arange(count) * step
    return replace(record, forcing=Channel(time, record.forcing_law(time), "N", "formula"))


def _require_overlap(record: Record) -> None:
    """Reject channels that were not recorded at the same time as the output: most likely their clocks differ."""
    first, last = record.output.time[0], record.output.time[-1]
    least = (FEWEST_COMMON_SAMPLES - 1) * record.output.period
    for role, channel in record.channels.items():
        start, end = max(first, channel.time[0]), min(last, channel.time[-1])
        if role == "input" and record.hold == "zero" and (end >= first or len(channel) == 1):
            end = last  # the last command stays in force
        if end - start < 0.999 * least:
            raise InputError(
                f"{record.name}: {role} ({channel.time[0]:.6g} to {channel.time[-1]:.6g} s) and output ({first:.6g} to "
                f"{last:.6g} s) were not recorded at the same time; if their stamps come from two clocks, use  time: receive"
            )


def _pumping_frequency(record: Record) -> float:
    """Frequency of the forcing [Hz] from the formula or the description, else 0."""
    law = record.forcing_law
    if law is None and record.run is not None:
        try:
            law = Sinusoid(**{key: float(value) for key, value in record.run["forcing"].items()})
        except (KeyError, TypeError, ValueError, AttributeError):
            return 0.0
    return law.frequency if law is not None and law.amplitude != 0.0 else 0.0
