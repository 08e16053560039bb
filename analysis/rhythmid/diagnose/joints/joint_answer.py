"""The answer for a machine of several joints: the contract of one axis, with the joint of every missing effect."""

import json
from dataclasses import dataclass, field
from typing import Any

from pydantic import TypeAdapter

from rhythmid.diagnose.answer.result import Diagnosis, Estimate, FitQuality, Scored
from rhythmid.diagnose.family import MissingFamily
from rhythmid.diagnose.hypothesis import Verdict
from rhythmid.identify.joints.reference_delay import ReferenceDelay

BASE = "base"  # the place of what is wrong with the machine as a whole


@dataclass(frozen=True)
class JointEffect:
    """An effect that the nominal model lacks at a joint, or `base_tilt`, which belongs to no joint.

    For a link's mass, inertia, centre of mass or payload, `link` names the link, and the joint is the one that moves it. `share` is relative to
    the joint's mismatch. `heldout_gain` is the reduction of the joint's error on data that no fit has seen, as a share of the
    effort. `together` is the probability that the effect, or one of those listed in its place, is missing. `other_links` are further links, whose
    masses the records do not separate from that of `link`. For `base_tilt` share and gain are those of the joint that shows it best; for
    `gear_compliance`, whose evidence is that of the other joints, those of its own.
    """

    joint: str | None
    element: str
    slot: str
    equation: str
    share: float
    probability: float
    parameters: dict[str, Estimate]
    heldout_gain: float
    link: str | None = None
    together: float = 0.0
    other_links: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """The joint, or the base."""
        return self.joint or BASE

    @property
    def of_link(self) -> str:
        """The wrong quantity of a link in words; empty where the effect acts at the joint."""
        kind = self.element.removeprefix("link_").replace("_", " ")
        if self.link and self.other_links:
            return f"{kind} of {self.link} or of the links that it carries ({', '.join(self.other_links)}), together"
        return f"{kind} of {self.link}" if self.link else ""


@dataclass(frozen=True)
class JointLocation:
    """The deficient joint and the slot of its path, in one sentence."""

    joint: str | None
    slot: str | None
    where: str


@dataclass(frozen=True)
class MachineDiagnosis:
    """The answer to: which physics does the model of this machine lack, and at which joint?

    `joints` holds the complete answer of each joint. `unknown` are joints whose mismatch no name of the catalogue explains;
    `undecided` are those at which the evidence does not separate several names; `not_judged` gives the reasons for joints that
    could not be judged. `families` are the kinds of missing physics by joint, which may be certain where the law is not.
    `reference_delay` is the additional delay, beyond the model's, with which references act, where efforts are computed from them.
    """

    verdict: Verdict
    summary: str
    location: JointLocation
    missing: tuple[JointEffect, ...]
    unknown: tuple[str, ...]
    undecided: tuple[str, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    fit: dict[str, dict[str, FitQuality]]
    parameters: dict[str, Estimate]
    next_experiment: str
    scoring: Scored
    joints: dict[str, Diagnosis]
    not_judged: dict[str, str] = field(default_factory=dict)
    families: dict[str, tuple[MissingFamily, ...]] = field(default_factory=dict)
    assumptions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    reference_delay: ReferenceDelay | None = None

    def to_dict(self) -> dict[str, Any]:
        """The diagnosis as plain JSON data; a number that is not finite is null."""
        return json.loads(TypeAdapter(MachineDiagnosis).dump_json(self))
