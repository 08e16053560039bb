"""Parts of a report that do not depend on how the records were scored: the nominal model and the elements."""

from collections.abc import Iterable, Mapping, Sequence

from rhythmid.diagnose.hypothesis import Kind
from rhythmid.elements.element import SLOTS, Element
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.findings import ElementWords
from rhythmid.report.record_quality import RecordQuality, quality_of

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


def listed(names: Sequence[str], most: int = 4) -> str:
    """Names joined to text; of more than `most` names, only the number of the last ones is given."""
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more records"
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]


def slots_of(nominal: Model) -> dict[str, tuple[str, ...]]:
    """The nominal model's elements by slot."""
    return {slot: tuple(t.element.name for t in nominal.terms if t.element.slot == slot) for slot in SLOTS}


def given_values(nominal: Model) -> dict[str, dict[str, float | str | None]]:
    """The nominal model's parameters as given in its file."""
    return {n: {"value": v.value, "std": None, "unit": v.unit} for n, v in nominal.parameters.items()}


def qualities(records: Sequence[Record], holdout: Sequence[Record]) -> tuple[RecordQuality, ...]:
    """Quality of the fitted and of the held-out records."""
    roles = ((records, "fit"), (holdout, "held out"))
    return tuple(quality_of(one, role) for group, role in roles for one in group)


def words_of(elements: Iterable[Element]) -> dict[str, ElementWords]:
    """Descriptions of these elements in the catalogue, by name."""
    return {
        e.name: ElementWords(
            e.title, {p.name: p.description for p in e.parameters}, e.also_known_as, e.reference
        )
        for e in elements
    }


def hints_of(
    groups: Sequence[Sequence[str]], elements: Iterable[Element]
) -> tuple[tuple[str, str, str], ...]:
    """What distinguishes the members of each group, as stated by the elements themselves."""
    known: Mapping[str, Element] = {element.name: element for element in elements}
    made = []
    for group in groups:
        for name in group:
            for other, words in known[name].confusable.items() if name in known else ():
                if other in group:
                    made.append((name, other, words))
    return tuple(made)
