"""Changes of several links fitted to all joints together, and simplified where the others make that possible.

Links are corrected one after another, each as it explains best what those before it have left. A link that stood for a part of a later one, or that
took more numbers for it, is found when all are fitted at once: a change is left out, or one with fewer numbers takes its place, as long as the
evidence, less the price of links and numbers, grows (backward elimination).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from rhythmid.body.inertial_parameter import MASS, MOMENT, PAYLOAD, split
from rhythmid.body.link_inertia import point_mass
from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_cause import LinkChange, columns_of, kinds_of
from rhythmid.diagnose.joints.link_evidence import laws_of
from rhythmid.diagnose.joints.machine_cause import SETTLED, WeightedRows, refined, rows_of
from rhythmid.diagnose.joints.wrong_link import WrongLink, values_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
Kinds = Mapping[str, str]  # what is wrong of each link


@dataclass(frozen=True, eq=False)
class _Together:
    """Changes of several links; their numbers and coordinates stand one after another."""

    changes: Sequence[LinkChange]

    @property
    def spreads(self) -> Array:
        return np.concatenate([one.spreads for one in self.changes])

    @property
    def least(self) -> Array:
        return np.concatenate([one.least for one in self.changes])

    @property
    def parts(self) -> list[slice]:
        """Places of the numbers of each change."""
        ends = np.cumsum([len(one.spreads) for one in self.changes])
        return [
            slice(int(end) - len(one.spreads), int(end)) for one, end in zip(self.changes, ends, strict=True)
        ]

    @property
    def slopes(self) -> Array:
        return np.asarray(block_diag(*(one.slopes for one in self.changes)), dtype=np.float64)

    def coordinates(self, numbers: Array) -> Array:
        made = zip(self.changes, self.parts, strict=True)
        return np.concatenate([one.coordinates(numbers[part]) for one, part in made])


@dataclass(frozen=True, eq=False)
class _State:
    """The changes `kinds` of links with their best numbers (k,), the covariance (k, k), and what they are worth [nat], up to a constant."""

    kinds: Kinds
    numbers: Array
    covariance: Array
    worth: float


def exchanged(
    given: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult], links: Mapping[str, WrongLink],
) -> dict[str, WrongLink] | None:  # fmt: skip
    """The corrections of links, fitted together; None where that changes none of them, or where the masses of links are not separated.

    Parameters
    ----------
    given : the balances of the machine without these corrections.
    found : the results of its joints with them.
    links : the corrections, by "link.kind"; the last one has the machine with all of them.
    """
    if len(links) < 2 or any(_not_separated(one) for one in links.values()):
        return None
    body, machine = given.machine.body, list(links.values())[-1].corrected
    kinds = dict(split(parameter) for parameter in links)
    weights = {link: columns_of(given, link) for link in kinds}
    before = np.concatenate([_ten(machine.body, link) - _ten(body, link) for link in kinds])
    rows = []
    for joint, one in found.items():
        together = [
            np.concatenate(parts, axis=1) for parts in zip(*(weights[link][joint] for link in kinds), strict=True)
        ]  # fmt: skip
        law = one.result.chosen if one.result.chosen in laws_of(one) else one.result.nominal
        left, columns = rows_of(one.result.search.balance, law.fit, together, one.result.chosen.fit.residual)
        rows.append((left - columns @ before, columns))
    places = {link: slice(10 * place, 10 * (place + 1)) for place, link in enumerate(kinds)}
    price = max(decisive(one.result.contest.candidates) for one in found.values())
    price += math.log(sum(len(kinds_of(given, link)) for link in body.links))

    def state_of(some: Kinds) -> _State:
        changes = [LinkChange(given, records, link, kind, weights[link]) for link, kind in some.items()]
        own = [places[link] for link in some]
        return _fitted(_Together(changes), some, [(left, _of(columns, own)) for left, columns in rows], price)

    state = first = state_of(kinds)
    while simpler := _simpler(state.kinds, given):
        best = max((state_of(one) for one in simpler), key=lambda one: one.worth)
        if best.worth <= state.worth:
            break
        state = best
    if state is first and _as_before(state, before, given, records, weights):
        return None
    return _corrected(state, given, records, weights, links)


def _not_separated(one: WrongLink) -> bool:
    return one.together is not None or (split(one.parameter)[1] == MASS and MOMENT in one.values)


def _ten(body: MujocoBody, link: str) -> Array:
    """The ten numbers (10,) of a link with its payload."""
    load = body.parameters.get(f"{link}.{PAYLOAD}", 0.0)
    return body.own(link).ten + (load * point_mass(body.ends[link]) if load else 0.0)


def _of(columns: Array, places: Sequence[slice]) -> Array:
    return np.concatenate([columns[:, one] for one in places], axis=1)


def _fitted(cause: _Together, kinds: Kinds, rows: Sequence[WeightedRows], price: float) -> _State:
    """The best numbers of these changes, beside the laws of the joints."""
    numbers, covariance = refined(rows, cause, np.zeros(len(cause.spreads)))
    change = cause.coordinates(numbers)
    cost = sum(0.5 * float(np.sum((left + columns @ change) ** 2)) for left, columns in rows)
    cost += 0.5 * float(np.sum((numbers / cause.spreads) ** 2))
    return _State(kinds, numbers, covariance, -cost - decisive(1) * len(numbers) - price * len(kinds))


def _simpler(kinds: Kinds, given: JointBalances) -> list[Kinds]:
    """The changes with one of them left out, or with one of fewer numbers in its place; one is left at least."""
    made: list[Kinds] = []
    for link, kind in kinds.items():
        if len(kinds) > 1:
            made.append({other: one for other, one in kinds.items() if other != link})
        count = _count(given, link, kind)
        made += [
            {**kinds, link: other} for other in kinds_of(given, link) if _count(given, link, other) < count
        ]
    return made


def _count(given: JointBalances, link: str, kind: str) -> int:
    return len(LinkChange(given, (), link, kind, {}).spreads)


def _as_before(
    state: _State, before: Array, given: JointBalances, records: Sequence[JointRecord], weights: Mapping[str, Mapping],
) -> bool:  # fmt: skip
    """Whether the corrections `before` (10 l,), one after another, are those of the fit together, within a part of its standard deviations."""
    cause = _Together(
        [LinkChange(given, records, link, kind, dict(weights[link])) for link, kind in state.kinds.items()]
    )
    slopes = cause.slopes
    moved = np.linalg.lstsq(slopes.T, before - cause.coordinates(state.numbers), rcond=None)[0]
    return bool(np.all(np.abs(moved) <= SETTLED * np.sqrt(np.diag(state.covariance))))


def _corrected(
    state: _State, given: JointBalances, records: Sequence[JointRecord], weights: Mapping[str, Mapping], links: Mapping[str, WrongLink],
) -> dict[str, WrongLink]:  # fmt: skip
    """The findings with the numbers of a state, and the machine with all of them."""
    changes = [
        LinkChange(given, records, link, kind, dict(weights[link])) for link, kind in state.kinds.items()
    ]
    parts = _Together(changes).parts
    machine: Machine = given.machine
    for one, part in zip(changes, parts, strict=True):
        machine = replace(one, balances=replace(given, machine=machine)).machine(state.numbers[part])
    known = {split(parameter)[0]: one for parameter, one in links.items()}
    return {
        f"{one.link}.{one.kind}": replace(
            known[one.link],
            parameter=f"{one.link}.{one.kind}",
            values=values_of(
                given.machine.body, machine.body, one.link, one.kind, state.covariance[part, part]
            ),
            corrected=machine,
            alike=tuple(
                name for name in known[one.link].alike if split(known[one.link].parameter)[1] == one.kind
            ),
        )
        for one, part in zip(changes, parts, strict=True)
    }
