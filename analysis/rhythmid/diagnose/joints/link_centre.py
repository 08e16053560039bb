"""A link's centre of mass as the cause of what a wrong mass, a wrong inertia or a payload explains at one joint.

One joint feels the first moment of a link, the product of mass and place; the joints above feel mass and place in other proportions.
With mass and inertia about the centre held, the force is known for any centre from the columns of the ten numbers of the link
(M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362), and all joints that feel the link are fitted together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.body.link_inertia import Principal
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_evidence import own_path, weight_of_values, with_body_of
from rhythmid.diagnose.joints.payload_place import BESIDE, ROUNDS, rows_of, weighted_rows
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
PLACES = 3  # of a centre, that are fitted: each of them has to be beaten by the odds of a candidate


@dataclass(frozen=True, eq=False)
class Centre:
    """A link's centre of mass (3,) [m] in its frame, with standard deviations, the file's centre `given` (3,) [m], and the log odds for it
    against another value of the link."""

    place: Array
    std: Array
    given: Array
    weight: float

    @property
    def moved(self) -> bool:
        """Whether the records contradict the file's centre."""
        return bool(np.any(np.abs(self.place - self.given) > CONTRADICTS * self.std))

    @property
    def better(self) -> bool:
        """Whether the joints together give it decisively more than the other value."""
        return self.moved and self.weight > decisive(PLACES)

    @property
    def as_good(self) -> bool:
        """Whether the joints do not separate it from the other value."""
        return self.moved and self.weight >= -decisive(1)

    @property
    def values(self) -> dict[str, Estimate]:
        """The place by axis."""
        return {
            axis: Estimate(float(place), float(std), "m")
            for axis, place, std in zip("xyz", self.place, self.std, strict=True)
        }


def centre_instead(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    link: str,
    corrected: JointBalances,
) -> Centre:
    """The centre of mass of a link that fits best, weighed against the balances `corrected` by another value of this link.

    An effect that was found at a joint may only have stood for the centre. So the centre is fitted beside the given paths, and beside
    the effects that were found where this has decisively more evidence.
    """
    given = {joint: balances.models[joint] for joint in found}
    effects = {joint: own_path(balances, one) for joint, one in found.items()}
    plain, richer = (_fitted(balances, records, found, link, corrected, paths) for paths in (given, effects))
    return richer if richer.weight > plain.weight + decisive(1) else plain


def _fitted(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    link: str,
    corrected: JointBalances,
    paths: Mapping[str, Model],
) -> Centre:
    machine = balances.machine
    own = machine.body.own(link)
    joints = [joint for joint in found if feels(corrected, joint, link)]
    place, std = own.centre.copy(), np.zeros(3)
    now = balances
    for _ in range(ROUNDS):
        rows = [
            weighted_rows(
                rows_of(now, joint, with_body_of(now, joint, paths[joint]), found[joint].late, link)
            )
            for joint in joints
        ]
        place, std = _refined(rows, own, place)
        now = JointBalances.of(machine.with_centre(link, place), records, balances)
    return Centre(place, std, own.centre, weight_of_values(found, corrected, now, joints))


def _refined(rows: Sequence[tuple[Array, Array]], own: Principal, start: Array) -> tuple[Array, Array]:
    """Improved place (3,) from a `start`, and its standard deviations (3,); `rows` are residuals and columns in units of the noise."""
    before = replace(own, centre=start).ten

    def error(at: Array) -> Array:
        change = replace(own, centre=at).ten - before
        return np.concatenate(
            [*(left + columns @ change for left, columns in rows), (at - own.centre) / BESIDE]
        )

    solved = least_squares(error, start, x_scale="jac")
    return solved.x, np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))


def feels(balances: JointBalances, joint: str, link: str) -> bool:
    """Whether a joint feels any parameter of a link."""
    return any(name.rpartition(".")[0] == link for name in balances.links(joint))
