"""A link's centre of mass, or its mass and centre together, as the cause of what a wrong mass or inertia explains at one joint.

One joint feels the first moment of a link, the product of mass and distance; the joints above feel mass and place in other proportions.
With the shape of the inertia about the centre held, the force is known for any mass and centre from the columns of the ten numbers of the link
(M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362), and all joints that feel the link are fitted together.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.body.link_inertia import Principal, about_centre
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_evidence import own_path, weight_of_values, with_body_of
from rhythmid.diagnose.joints.payload_place import AXES, BESIDE, ROUNDS, weighted_rows
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.base_parameters import from_cholesky, to_cholesky
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
PLACES = 3  # of a centre, that are fitted: each of them has to be beaten by the odds of a candidate
NUMBERS = 10  # of a rigid body, that are fitted
STEP = 1e-6  # of the finite differences of a body's factor
LARGEST = 100.0  # factor to which a link's root of mass and its sizes may differ from the file's: no body that a robot carries differs by more


@dataclass(frozen=True, eq=False)
class Load:
    """Inertia of a link as it fits the efforts of all joints that feel the link.

    `ten` (10,) are its parameters, `covariance` (4, 4) is that of its mass [kg] and its centre [m] in the link's frame. `given` is the file's
    inertia. `origin` (3,) [m] is the point from which the first moment is taken. `weight` is the log odds for it against another value of the
    link.
    """

    ten: Array
    covariance: Array
    given: Principal
    origin: Array
    weight: float

    @property
    def mass(self) -> float:
        """The mass [kg]."""
        return float(self.ten[0])

    @property
    def place(self) -> Array:
        """The centre of mass (3,) [m]."""
        return self.ten[1:4] / self.ten[0]

    @property
    def _std(self) -> Array:
        """Standard deviations (4,) of mass and centre."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def mass_moved(self) -> bool:
        """Whether the records contradict the file's mass, whatever the centre is."""
        return bool(abs(self.mass - self.given.mass) > CONTRADICTS * self._std[0])

    @property
    def moved(self) -> bool:
        """Whether the records contradict the file's centre, whatever the mass is."""
        return bool(np.any(np.abs(self.place - self.given.centre) > CONTRADICTS * self._std[1:]))

    @property
    def moment_moved(self) -> bool:
        """Whether the records contradict the file's first moment."""
        found, before = self.first_moment, replace(self, ten=self.given.ten).first_moment
        return bool(abs(found.value - before.value) > CONTRADICTS * (found.std or 0.0))

    @property
    def better(self) -> bool:
        """Whether the joints together give it decisively more than the other value."""
        return self.moved and self.weight > decisive(PLACES)

    @property
    def as_good(self) -> bool:
        """Whether the joints do not separate it from the other value."""
        return self.moved and self.weight >= -decisive(1)

    @property
    def mass_value(self) -> Estimate:
        """The mass, whatever the centre is."""
        return Estimate(self.mass, float(self._std[0]), "kg")

    @property
    def values(self) -> dict[str, Estimate]:
        """The centre by axis."""
        return {
            axis: Estimate(float(place), float(std), "m")
            for axis, place, std in zip(AXES, self.place, self._std[1:], strict=True)
        }

    @property
    def first_moment(self) -> Estimate:
        """Mass times distance of the centre from the `origin`: what a single joint feels, so that it may be known where mass and centre are not."""
        arm = self.place - self.origin
        far = max(float(np.linalg.norm(arm)), 1e-12)
        slope = np.concatenate([[far], self.mass * arm / far])
        return Estimate(self.mass * far, float(np.sqrt(max(slope @ self.covariance @ slope, 0.0))), "kg*m")


def refitted_link(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult], link: str, corrected: JointBalances,
    centre_only: bool,
) -> Load:  # fmt: skip
    """Inertia of a link that fits best, weighed against the balances `corrected` by another value of this link.

    With `centre_only` its mass and its inertia about the centre are held. Without, mass, centre and inertia are fitted together: what one joint
    feels of a body that is attached to a link are its first moment and its inertia about the joint, so that its mass follows from the joints
    above, whatever its inertia is.

    An effect that was found at a joint, such as a gain of its effort, may only have stood for the link. So the link is fitted beside the given
    paths, and beside the effects that were found where this has decisively more evidence.
    """
    given = {joint: balances.models[joint] for joint in found}
    effects = {joint: own_path(balances, one) for joint, one in found.items()}
    plain, richer = (
        _fitted(balances, records, found, link, corrected, paths, centre_only) for paths in (given, effects)
    )
    return richer if richer.weight > plain.weight + decisive(1) else plain


def _fitted(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult], link: str, corrected: JointBalances,
    paths: Mapping[str, Model], centre_only: bool,
) -> Load:  # fmt: skip
    machine = balances.machine
    own = machine.body.own(link)
    joints = [joint for joint in found if feels(corrected, joint, link)]
    ten, covariance, now = own.ten, np.zeros((4, 4)), balances
    for _ in range(ROUNDS):
        rows = [
            weighted_rows(now, joint, with_body_of(now.models[joint], paths[joint]), found[joint].late, link)
            for joint in joints
        ]
        ten, covariance = (_centre if centre_only else fitted_body)(rows, own, ten)
        made = machine.with_centre(link, ten[1:4] / ten[0]) if centre_only else machine.with_load(link, ten)
        now = JointBalances.of(made, records, balances)
    hinge = machine.body.hinges.get(link)
    origin = np.zeros(3) if hinge is None else hinge.place
    return Load(ten, covariance, own, origin, weight_of_values(found, corrected, now, joints, link))


def _centre(rows: Sequence[tuple[Array, Array]], own: Principal, start: Array) -> tuple[Array, Array]:
    """The ten parameters (10,) with an improved centre from a `start` (10,), and the covariance (4, 4) of mass and centre; `rows` are residuals
    and columns in units of the noise."""

    def error(at: Array) -> Array:
        change = replace(own, centre=at).ten - start
        return np.concatenate(
            [*(left + columns @ change for left, columns in rows), (at - own.centre) / BESIDE]
        )

    solved = least_squares(error, start[1:4] / start[0], x_scale="jac")
    covariance = np.zeros((4, 4))
    covariance[1:, 1:] = np.linalg.pinv(solved.jac.T @ solved.jac)
    return replace(own, centre=solved.x).ten, covariance


def fitted_body(rows: Sequence[tuple[Array, Array]], own: Principal, start: Array) -> tuple[Array, Array]:
    """The ten parameters (10,) of an improved rigid body from a `start` (10,), and the covariance (4, 4) of mass and centre; `rows` as for
    `_centre`.

    Only where the records do not say does the centre stay near the file's, and the inertia about it near that of the file's shape, both
    within the size of what a link carries.
    """
    first = to_cholesky(start)
    size = start[0] * BESIDE**2
    _, _, shape = about_centre(own.ten)
    triangles = [np.linalg.qr(np.column_stack([columns, left]), mode="r") for left, columns in rows]

    def error(at: Array) -> Array:
        ten = from_cholesky(at)
        mass, centre, about = about_centre(ten)
        change = np.append(ten - start, 1.0)
        return np.concatenate(
            [
                *(triangle @ change for triangle in triangles),
                (centre - own.centre) / BESIDE,
                (about - shape * mass / own.mass) / size,
            ]
        )

    reach = np.full(NUMBERS, np.inf)
    reach[:4] = math.log(LARGEST)
    given = to_cholesky(own.ten)
    inside = np.clip(first, given - 0.99 * reach, given + 0.99 * reach)
    solved = least_squares(error, inside, bounds=(given - reach, given + reach), x_scale="jac")
    slopes = np.array([_mass_and_centre(solved.x + step) for step in STEP * np.eye(NUMBERS)])
    slopes = (slopes - _mass_and_centre(solved.x)).T / STEP
    noise = np.linalg.pinv(solved.jac.T @ solved.jac)
    # each joint has unmodelled effects of its own; what its optimum is apart from that of all widens the errors (K.-Y. Liang, S. L. Zeger,
    # Biometrika 73 (1986) 13)
    count = sum(map(len, triangles))
    pulls = np.zeros((NUMBERS, len(rows)))
    ends = np.cumsum([len(triangle) for triangle in triangles])[:-1]
    for number, (own_jac, left) in enumerate(
        zip(np.split(solved.jac[:count], ends), np.split(solved.fun[:count], ends), strict=True)
    ):
        pulls[:, number] = own_jac.T @ left
    apart = noise @ pulls
    return from_cholesky(solved.x), slopes @ (noise + apart @ apart.T) @ slopes.T


def _mass_and_centre(entries: Array) -> Array:
    ten = from_cholesky(entries)
    return np.append(ten[0], ten[1:4] / ten[0])


def feels(balances: JointBalances, joint: str, link: str) -> bool:
    """Whether a joint feels any parameter of a link."""
    return any(name.rpartition(".")[0] == link for name in balances.links(joint))
