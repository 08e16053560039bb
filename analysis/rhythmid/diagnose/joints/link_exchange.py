"""Changes of several links fitted to all joints together, and simplified where the others make that possible.

Links are corrected one after another, each as it explains best what those before it have left. A link that stood for a part of another, or that
took more numbers for it, shows when all are fitted at once: a change is left out, or one of this or of another link with no more numbers takes its
place, as long as the evidence, less the price of links and numbers, grows.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from rhythmid.body.inertial_parameter import MASS, MOMENT, PAYLOAD, split
from rhythmid.body.link_inertia import point_mass
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.linear_cause import side_by_side
from rhythmid.diagnose.joints.link_cause import NUMBERS, LinkChange, columns_of, kinds_of
from rhythmid.diagnose.joints.link_evidence import laws_of
from rhythmid.diagnose.joints.machine_cause import SETTLED, refined, rows_of
from rhythmid.diagnose.joints.wrong_link import WrongLink, values_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
Changes = Mapping[
    str, tuple[str, str]
]  # link and kind of the change that stands in the place of each correction


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
    """The `changes` with their best `numbers` (k,), the `covariance` (k, k), and what they are worth [nat], up to a constant."""

    changes: Changes
    cause: _Together
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
    body, corrected = given.machine.body, list(links.values())[-1].corrected.body
    weights = {link: columns_of(given, link) for link in body.links}
    places = {link: slice(NUMBERS * place, NUMBERS * (place + 1)) for place, link in enumerate(weights)}
    before = np.concatenate([_ten(corrected, link) - _ten(body, link) for link in weights])
    rows = []
    for joint, one in found.items():
        every = side_by_side(of_link[joint] for of_link in weights.values())
        law = one.result.chosen if one.result.chosen in laws_of(one) else one.result.nominal
        left, columns = rows_of(one.result.search.balance, law.fit, every, one.result.chosen.fit.residual)
        triangle = np.asarray(np.linalg.qr(np.column_stack([columns, left - columns @ before]), mode="r"))
        rows.append((triangle[:, -1], triangle[:, :-1]))
    kinds = {link: kinds_of(given, link) for link in weights}
    price = max(decisive(one.result.contest.candidates) for one in found.values())
    price += math.log(sum(map(len, kinds.values())))
    single = {
        (link, kind): LinkChange(given, records, weights[link], link, kind)
        for link in weights
        for kind in kinds[link]
    }

    def fitted(changes: Changes) -> _State:
        cause = _Together([single[one] for one in changes.values()])
        own = [places[link] for link, _ in changes.values()]
        some = [(left, np.concatenate([columns[:, one] for one in own], axis=1)) for left, columns in rows]
        numbers, covariance = refined(some, cause, np.zeros(len(cause.spreads)))
        moved = cause.coordinates(numbers)
        cost = sum(0.5 * float(np.sum((left + columns @ moved) ** 2)) for left, columns in some)
        cost += 0.5 * float(np.sum((numbers / cause.spreads) ** 2))
        paid = decisive(1) * len(numbers) + price * len(changes)
        return _State(changes, cause, numbers, covariance, -cost - paid)

    state = first = fitted({name: split(name) for name in links})
    while others := exchanges(state.changes, {key: len(one.spreads) for key, one in single.items()}):
        best = max((fitted(one) for one in others), key=lambda one: one.worth)
        if best.worth <= state.worth:
            break
        state = best
    own = np.concatenate([before[places[link]] for link, _ in state.changes.values()])
    if state is first and _as_before(state, own):
        return None
    return _corrections(state, given, links)


def _not_separated(one: WrongLink) -> bool:
    return one.together is not None or (split(one.parameter)[1] == MASS and MOMENT in one.values)


def _ten(body: MujocoBody, link: str) -> Array:
    """The ten numbers (10,) of a link with its payload."""
    load = body.parameters.get(f"{link}.{PAYLOAD}", 0.0)
    return body.own(link).ten + (load * point_mass(body.ends[link]) if load else 0.0)


def exchanges(changes: Changes, counts: Mapping[tuple[str, str], int]) -> list[Changes]:
    """The changes with one of them left out, if it is not the last one, or with another one in its place.

    That is one with fewer numbers (`counts`) of the same link, or one with no more numbers of a link that none of them changes.
    """
    made: list[Changes] = []
    taken = {link for link, _ in changes.values()}
    for name, own in changes.items():
        if len(changes) > 1:
            made.append({other: one for other, one in changes.items() if other != name})
        for one, count in counts.items():
            if (count < counts[own]) if one[0] == own[0] else (one[0] not in taken and count <= counts[own]):
                made.append({**changes, name: one})
    return made


def _as_before(state: _State, before: Array) -> bool:
    """Whether the corrections `before` are those of the fit together, within a part of its standard deviations."""
    cause = state.cause
    moved = np.linalg.lstsq(cause.slopes.T, before - cause.coordinates(state.numbers), rcond=None)[0]
    return bool(np.all(np.abs(moved) <= SETTLED * np.sqrt(np.diag(state.covariance))))


def _corrections(state: _State, given: JointBalances, links: Mapping[str, WrongLink]) -> dict[str, WrongLink]:
    """The corrections with the numbers of a state, and the machine with all of them.

    Probability and share are those of the corrections in whose places they stand.
    """
    made = list(zip(state.changes, state.cause.changes, state.cause.parts, strict=True))
    machine = given.machine
    for _, one, part in made:
        machine = replace(one, balances=replace(given, machine=machine)).machine(state.numbers[part])
    found: dict[str, WrongLink] = {}
    for name, one, part in made:
        parameter, covariance = f"{one.link}.{one.kind}", state.covariance[part, part]
        values = values_of(given.machine.body, machine.body, one.link, one.kind, covariance)
        alike = links[name].alike if parameter == name else ()
        found[parameter] = replace(
            links[name], parameter=parameter, values=values, corrected=machine, alike=alike
        )
    return found
