"""How often a correct record is called implausible, and how often a wrong unit, sign or exchange is found, on random machines.

    python benchmarks/plausibility.py [--machines 200] [--hits 40] [--seed 0] [--kind null]

The machines are those of the concealed proof, of all kinds in turn, with nominal values that are wrong by up to a factor of two. A false alarm is a
correct record for which another unit, sign or channel is reported. A hit is a record with one error for which this error, or an
equivalent one for this machine, is reported.
"""

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

from threadpoolctl import threadpool_limits

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.channel_change import DEGREE, Change
from rhythmid.identify.plausibility import likely_mend
from rhythmid.model import Model
from rhythmid.proof.draw import KINDS, draw_case
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.perform import LEARN, NOMINAL, perform
from rhythmid.record.read import load_records
from rhythmid.record.record import Record

# errors that a user may make in a record, by their correction
SPOILT = {
    "degrees as radians": Change("output", DEGREE),
    "millimetres as metres": Change("output", 1e-3),
    "input in thousandths": Change("input", 1e-3),
    "amperes as N m": Change("input", 0.085),
    "sign of the input": Change("input", -1.0),
    "sign of the output": Change("output", -1.0),
    "input and output exchanged": Change("exchange"),
}


def made(seed: int, kind: str, index: int, design: str) -> tuple[list[Record], Model]:
    """Records for the fit and the nominal model of one drawn case."""
    case = draw_case(seed, kind, index, design=design)  # pyright: ignore[reportArgumentType]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        perform(case, place, [seed, index])
        suffix = "" if DESIGNS[design].bags else "*.yaml"
        learn = place / LEARN
        paths = sorted(learn.glob(suffix)) if suffix else sorted(p for p in learn.iterdir() if p.is_dir())
        return load_records(paths), Model.load(place / NOMINAL, load_catalogue())


def spoilt(records: list[Record], mend: Change) -> list[Record] | None:
    """The records as they would have been without the correction."""
    undone = mend if mend.role == "exchange" else Change(mend.role, 1.0 / mend.factor)
    found = [undone.applied(record) for record in records]
    return [one for one in found if one is not None] if any(one is not None for one in found) else None


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--machines", type=int, default=200, help="sound sets of records")
    parser.add_argument("--first", type=int, default=0, help="number of the first machine")
    parser.add_argument("--hits", type=int, default=40, help="machines of which every spoilt record is tried")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--kind", choices=KINDS, default="null", help="single: with an effect that the model lacks"
    )
    parser.add_argument("--designs", nargs="+", choices=list(DESIGNS), default=list(DESIGNS))
    given = parser.parse_args()
    alarms: list[int] = []
    seconds: list[float] = []
    hits: dict[str, Counter[str]] = {name: Counter() for name in SPOILT}
    with threadpool_limits(1):
        for index in range(given.first, given.first + given.machines):
            design = given.designs[index % len(given.designs)]
            try:
                records, model = made(given.seed, given.kind, index, design)
            except RuntimeError:
                continue
            begin = time.perf_counter()
            mend = likely_mend(model, records)
            seconds.append(time.perf_counter() - begin)
            if len(seconds) % 10 == 0:
                print(f"{len(seconds)} sets of records, {len(alarms)} false alarms", flush=True)
            if mend is not None:
                alarms.append(index)
                print(f"  {design} {index}: {mend.text}", flush=True)
            for name, change in SPOILT.items() if index < given.hits else ():
                wrong = spoilt(records, change)
                if wrong is None or (change.factor == DEGREE and model.units.position != "rad"):
                    continue
                found = likely_mend(model, wrong)
                said = "missed" if found is None else "warned" if not found.certain else "refused"
                hits[name][said] += 1
                print(f"  {design} {index}, {name}: {said if found is None else found.text}", flush=True)
    print(
        f"{len(alarms)} false alarms in {len(seconds)} sound sets of records, {sum(seconds) / len(seconds):.2f} s each"
    )
    for name, count in hits.items() if given.hits else ():
        print(f"{name}: " + ", ".join(f"{said} {number}" for said, number in sorted(count.items())))


if __name__ == "__main__":
    main()
