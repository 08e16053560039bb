"""A wrong inertia of a link, or a body that it carries, as one cause of all joints below it.

The efforts are linear in the ten numbers of a link (M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362). What may be wrong of them is the
mass, the centre of mass, the inertia, all ten, or a payload at the end: each kind of change has a few numbers, for any of which the link is a body
that can exist. Every kind of every link is fitted to all joints together, beside what each joint may need for itself. Each number has to be worth
the odds of a candidate.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.inertial_parameter import CENTRE, LOAD, MASS, MOMENT, PAYLOAD, TURNING, split
from rhythmid.body.link_inertia import Principal, about_centre, point_mass, ten_of
from rhythmid.body.machine import Machine
from rhythmid.diagnose.constants import CONTRADICTS, EQUIVALENT
from rhythmid.diagnose.joints.dry_friction import dry_in_place, laws_found
from rhythmid.diagnose.joints.joint_case import OF_LINKS, JointResult
from rhythmid.diagnose.joints.linear_cause import LinearCause, side_by_side
from rhythmid.diagnose.joints.link_evidence import advantage
from rhythmid.diagnose.joints.link_group import masses_alike
from rhythmid.diagnose.joints.machine_cause import (
    Beside,
    Columns,
    Options,
    Weighed,
    best_beside,
    matters,
    options_of,
    weighed,
)
from rhythmid.diagnose.joints.wrong_link import WrongLink, values_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
NUMBERS = 10  # of a rigid body
BESIDE = 0.1  # [m] prior standard deviation of a centre, of a payload's place and of a body's radii: the size of a gripper or of a foot
HEAVIER = 10.0  # prior standard deviation of the change of a mass or an inertia, as a share of it: a hand on a flange is some times its mass
LEAST = 1e-3  # share of an inertia that is left at least: a file may have that about the joint
LIGHTEST = 0.1  # share of a mass that is left at least: what removes a link is another effect
STEP = 1e-6  # of finite differences, in prior standard deviations
LOWER = np.tril_indices(3)


@dataclass(frozen=True, eq=False)
class LinkChange(LinearCause):
    """A kind of change of one link as a cause of the machine as a whole; `weights` are the efforts (n, 10) per unit of each of the link's ten numbers."""

    link: str
    kind: str

    @property
    def own(self) -> Principal:
        """The inertia of the link in the model, without a payload."""
        return self.balances.machine.body.own(self.link)

    @property
    def _load(self) -> tuple[float, Array]:
        """The payload [kg] of the link in the model, and its place (3,)."""
        body = self.balances.machine.body
        return body.parameters[f"{self.link}.{PAYLOAD}"], body.ends[self.link]

    @property
    def spreads(self) -> Array:
        if self.kind == PAYLOAD:
            body = self.balances.machine.body
            return np.array([sum(body.own(link).mass for link in body.links), *(3 * [BESIDE])])
        if self.kind == CENTRE:
            return np.full(3, BESIDE)
        return np.array([HEAVIER] if self.kind != LOAD else [HEAVIER, *(9 * [BESIDE])])

    @property
    def least(self) -> Array:
        low = np.full(len(self.spreads), -np.inf)
        if self.kind == PAYLOAD:
            low[0] = -self._load[0]
        elif self.kind != CENTRE:
            low[0] = LIGHTEST - 1.0 if self.kind != TURNING else LEAST - 1.0
        return low

    @property
    def slopes(self) -> Array:
        """The places of a payload have an effect only with its mass, so that they count for one as heavy as the link."""
        steps, about = STEP * self.spreads, np.zeros(len(self.spreads))
        made = []
        for place, row in enumerate(np.diag(steps)):
            about[0] = self.own.mass if self.kind == PAYLOAD and place else 0.0
            made.append((self.coordinates(about + row) - self.coordinates(about)) / steps[place])
        return np.array(made)

    def start(self, numbers: Array) -> Array:
        """Numbers for a fit from those that the `slopes` give, in which places and radii have the effect that they have with the mass of the model."""
        if self.kind == PAYLOAD and numbers[0] > 0.0:
            return np.append(numbers[0], numbers[1:] * self.own.mass / numbers[0])
        return np.append(numbers[0], numbers[1:] / (1.0 + numbers[0])) if self.kind == LOAD else numbers

    def ten(self, numbers: Array) -> Array:
        """The ten numbers (10,) of the link without its payload."""
        own = self.own
        if self.kind == PAYLOAD:
            return own.ten
        if self.kind == CENTRE:
            return replace(own, centre=own.centre + numbers).ten
        more = 1.0 + float(numbers[0])
        if self.kind == TURNING:
            return replace(own, moments=more * own.moments).ten
        kept = (
            f"{self.link}.{TURNING}" in self.balances.machine.body.given
        )  # an inertia that is listed does not go with the mass
        if self.kind == MASS:
            return replace(own, mass=more * own.mass, moments=(1.0 if kept else more) * own.moments).ten
        radii = _radii(own)
        radii[LOWER] += numbers[4:]
        second = radii @ radii.T
        about = np.trace(second) * np.eye(3) - second
        return ten_of(
            more * own.mass,
            own.centre + numbers[1:4],
            more * own.mass * about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        )

    def payload(self, numbers: Array) -> tuple[float, Array]:
        """The payload [kg], and its place (3,) [m] in the frame of the link."""
        mass, end = self._load
        return mass + float(numbers[0]), end + numbers[1:]

    def coordinates(self, numbers: Array) -> Array:
        if self.kind == PAYLOAD:
            (mass, place), (before, end) = self.payload(numbers), self._load
            return mass * point_mass(place) - before * point_mass(end)
        return self.ten(numbers) - self.own.ten

    def machine(self, numbers: Array) -> Machine:
        """The machine with these numbers."""
        machine, (link, kind) = self.balances.machine, (self.link, self.kind)
        if kind == PAYLOAD:
            return machine.with_payload(link, *self.payload(numbers))
        ten = self.ten(numbers)
        if kind == CENTRE:
            return machine.with_centre(link, ten[1:4] / ten[0])
        if kind == LOAD:
            return machine.with_load(link, ten)
        name = f"{link}.{kind}"
        return machine.with_inertial({name: (1.0 + float(numbers[0])) * machine.body.parameters[name]})

    def in_place(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        return JointBalances.of(self.machine(numbers), self.records, self.balances)


def _radii(own: Principal) -> Array:
    """Lower triangular factor (3, 3) [m] of the second moment of a kilogram of a body about its centre."""
    _, _, (xx, yy, zz, xy, xz, yz) = about_centre(own.ten)
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) / own.mass
    second = 0.5 * np.trace(about) * np.eye(3) - about
    sizes, axes = np.linalg.eigh(second)  # a point or a rod has no second moments in some directions
    least = max(1e-9 * float(sizes[-1]), 1e-12)
    return np.linalg.cholesky(axes @ np.diag(np.maximum(sizes, least)) @ axes.T)


@dataclass(frozen=True, eq=False)
class Ranked:
    """A change of a link that may be the cause, with what is best beside it at each joint and what it is worth [nat] beyond its numbers."""

    change: LinkChange
    beside: Beside
    worth: float


def ranked_changes(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult], known: Collection[str] = ()
) -> list[Ranked]:  # fmt: skip
    """All kinds of changes of all links, those that are worth most first; not of links of which a value is `known`, as "link.kind"."""
    body = balances.machine.body
    corrected = {split(parameter)[0] for parameter in known}
    links = [link for link in body.links if link not in corrected]
    if not links:
        return []
    weights = {link: columns_of(balances, link) for link in links}
    options: dict[str, Options] = {}
    for joint, one in found.items():
        options[joint] = options_of(one, side_by_side(weights[link][joint] for link in links))
    made: list[Ranked] = []
    for place, link in enumerate(links):
        own = {joint: one.of(slice(NUMBERS * place, NUMBERS * (place + 1))) for joint, one in options.items()}
        for kind in kinds_of(balances, link):
            change = LinkChange(balances, records, weights[link], link, kind)
            beside = best_beside(own, change)
            made.append(Ranked(change, beside, beside.gain - decisive(1) * len(beside.numbers)))
    return sorted(made, key=lambda one: -one.worth)


def kinds_of(balances: JointBalances, link: str) -> tuple[str, ...]:
    """What may be wrong of a link."""
    body = balances.machine.body
    kinds = [MASS]
    kinds += [TURNING] if link in body.hinges else []
    kinds += [PAYLOAD] if link in body.ends else []
    kinds += [CENTRE, LOAD] if link not in body.centres else []
    return tuple(kinds)


def columns_of(balances: JointBalances, link: str) -> Columns:
    """By joint, the effort (n, 10) along each motion per unit of each of the ten numbers of a link."""
    body = balances.machine.body
    made = [body.inertial_columns(link, one.pose, one.rate, one.acceleration) for one in balances.bodies]
    return {
        joint: [np.ascontiguousarray(one[:, body.joints[joint].velocity]) for one in made]
        for joint in balances.models
    }


@dataclass(frozen=True, eq=False)
class _Tried:
    """A change of a link that was fitted to all joints."""

    change: LinkChange
    fit: Weighed

    @property
    def worth(self) -> float:
        """What it is worth [nat] beyond its numbers."""
        return self.fit.weight - decisive(1) * len(self.fit.numbers)

    @property
    def moved(self) -> bool:
        """Whether the records contradict the model's value of some number."""
        numbers, std = self.fit.numbers, np.sqrt(np.diag(self.fit.covariance))
        first = 1 if self.change.kind == PAYLOAD else len(numbers)  # a place without a payload is nothing
        return bool(np.any(np.abs(numbers[:first]) > CONTRADICTS * std[:first]))


def _tried(one: Ranked, balances: JointBalances, found: Mapping[str, JointResult]) -> _Tried:
    """A change fitted to all joints beside the laws that are best to first order, or beside the plain dry friction in place of another law of friction
    if this is worth more: which law of friction it is depends on the change."""
    fits, start = one.beside.fits, one.change.start(one.beside.numbers)
    plain = {joint: dry_in_place(found[joint], fit) for joint, fit in fits.items()}
    sides = [fits] if all(plain[joint] is fit for joint, fit in fits.items()) else [fits, plain]
    made = (weighed(one.change, balances, found, found, start, side, laws_found) for side in sides)
    return _Tried(one.change, max(made, key=lambda fit: fit.weight))


def likely_link(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult], known: Collection[str] = (),
    stated: Collection[str] = (),
) -> WrongLink | None:  # fmt: skip
    """The change of a link that all joints together give decisively more than the laws found at each of them; None without one.

    Links are tried, the most promising first. All kinds of change of a link are fitted to all joints, and the simplest that predicts best is taken. Links with a value
    that is `known`, as "link.kind", are corrected already. Links that are `stated` at a joint have been worth the choice among all candidates there.
    """
    ranked = ranked_changes(balances, records, found, known)
    price = max((decisive(one.result.contest.candidates) for one in found.values()), default=0.0)
    price += math.log(max(len(ranked), 1))

    def priced(one: Ranked) -> float:
        return one.worth - (0.0 if one.change.link in stated else price)

    worthy = sorted((one for one in ranked if priced(one) > 0.0), key=lambda one: -priced(one))
    for link in dict.fromkeys(one.change.link for one in worthy):
        tried = [_tried(one, balances, found) for one in worthy if one.change.link == link]
        best = _simplest(tried, found)
        if not best.moved or best.worth <= (0.0 if link in stated else price):
            continue
        if matters(best.change.imposed(best.fit.numbers, best.fit.paths), balances, found):
            own = max(one.worth for one in ranked if one.change.link == link)
            others = [one.worth - own for one in ranked if one.change.link != link]
            return _wrong(best, tried, others, balances, found)
    return None


def _simplest(tried: Sequence[_Tried], found: Mapping[str, JointResult]) -> _Tried:
    """The change that is worth most, or the best one with fewer numbers that predicts as well: more numbers of a link also explain what filters and
    laws of friction leave."""
    best = max(tried, key=lambda one: one.worth)
    fewer = [one for one in tried if len(one.fit.numbers) < len(best.fit.numbers)]
    alike = [one for one in fewer if _as_good(one, best, found)]
    return max(alike, key=lambda one: one.worth, default=best)


def _as_good(one: _Tried, best: _Tried, found: Mapping[str, JointResult]) -> bool:
    """Whether the `best` change, which has more numbers, is ahead by no more than their price and `EQUIVALENT` standard errors over blocks."""
    made = [advantage(result, best.fit.best[joint], one.fit.best[joint]) for joint, result in found.items()]
    gain, error = sum(more for more, _ in made), math.hypot(*(error for _, error in made))
    more = len(best.fit.numbers) - len(one.fit.numbers)
    return gain - decisive(1) * more <= EQUIVALENT * error


def _wrong(
    best: _Tried, tried: Sequence[_Tried], others: Sequence[float], balances: JointBalances, found: Mapping[str, JointResult],
) -> WrongLink:  # fmt: skip
    """The best change of a link as a finding; `others` are what changes of other links are worth beyond it [nat]."""
    change, fit, body = best.change, best.fit, balances.machine.body
    link, kind = change.link, change.kind
    corrected = change.machine(fit.numbers)
    values = values_of(body, corrected.body, link, kind, fit.covariance)
    alike = [one for one in tried if one is not best and one.change.kind != LOAD != kind and one.moved]
    alike = [one.change.kind for one in alike if one.worth >= best.worth - decisive(1)]
    whole = next((one for one in tried if one.change.kind == LOAD), None)
    if (
        kind == MASS and CENTRE in alike and whole is not None
    ):  # one joint feels mass times distance: the mass is as uncertain as the distance
        free = values_of(body, whole.change.machine(whole.fit.numbers).body, link, LOAD, whole.fit.covariance)
        own = values[MASS]
        values = {
            MASS: replace(own, std=math.hypot(own.std or 0.0, free[MASS].std or 0.0)),
            MOMENT: free[MOMENT],
        }
    after = change.in_place(fit.numbers, fit.paths)
    together = None
    if kind == MASS:
        together = masses_alike(after, found, f"{link}.{MASS}", values[MASS], body.own(link).mass)
    odds = 0.0 if together is not None else sum(math.exp(min(one, 0.0)) for one in others)
    return WrongLink(
        f"{link}.{kind}", values, corrected, fit.probability / (1.0 + odds), fit.weight, fit.shown,
        fit.share, tuple(OF_LINKS[one] for one in alike), together,
    )  # fmt: skip


def feels(balances: JointBalances, joint: str, link: str) -> bool:
    """Whether a joint feels any parameter of a link."""
    return any(name.rpartition(".")[0] == link for name in balances.links(joint))
