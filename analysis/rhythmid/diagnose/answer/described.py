"""Parts of a report that do not depend on how the records were scored: the nominal model and the elements."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.hypothesis import Hypothesis, Kind
from rhythmid.elements.element import SLOTS, Element
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.findings import ElementWords
from rhythmid.report.record_quality import quality_of

REFITTED_NOMINAL = "refitted nominal model"
# name of the final model beside the nominal one, by the kind of the chosen hypothesis
CHANGED: dict[Kind, str] = {
    "freed_value": "with the value set free",
    "delay": "with a longer delay",
    "free_map": "with a free law",
}


def labels_of(kind: Kind) -> tuple[str, str]:
    """Labels of the nominal and the final model in figures."""
    return REFITTED_NOMINAL, CHANGED.get(kind, "with the added effect")


def described(
    diagnosis: Diagnosis,
    chosen: Hypothesis,
    nominal: Model,
    records: Sequence[Record],
    holdout: Sequence[Record],
    elements: Iterable[Element],
    command: str,
    name: str,
) -> dict[str, Any]:
    """Fields of `Findings` by name; `elements` are those that the report may mention, the other arguments are those of `present`."""
    known = {one.name: one for one in elements}
    slots = {slot: tuple(t.element.name for t in nominal.terms if t.element.slot == slot) for slot in SLOTS}
    return {
        "result": diagnosis.to_dict(),
        "source": f"{name} against {_listed([record.name for record in records])}",
        "slots": slots,
        "chosen": chosen.names,
        "output_unit": nominal.units.position,
        "nominal": {
            n: {"value": v.value, "std": None, "unit": v.unit} for n, v in nominal.parameters.items()
        },
        "records": tuple(
            quality_of(one, role)
            for group, role in ((records, "fit"), (holdout, "held out"))
            for one in group
        ),
        "words": {key: _words_of(one) for key, one in known.items()},
        "hints": tuple(_hints(diagnosis.indistinguishable, known)),
        "command": command,
    }


def _listed(names: Sequence[str], most: int = 4) -> str:
    """Names joined to text; of more than `most` names, only the number of the last ones is given."""
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more records"
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]


def _words_of(one: Element) -> ElementWords:
    """The description of an element in the catalogue."""
    parameters = {parameter.name: parameter.description for parameter in one.parameters}
    return ElementWords(one.title, parameters, one.also_known_as, one.reference)


def _hints(groups: Sequence[Sequence[str]], known: Mapping[str, Element]) -> Iterator[tuple[str, str, str]]:
    """What distinguishes the members of each group, as stated by the elements themselves."""
    for group in groups:
        for name in group:
            for other, words in known[name].confusable.items() if name in known else ():
                if other in group:
                    yield name, other, words
