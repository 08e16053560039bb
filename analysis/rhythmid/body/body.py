"""A body: the links and joints that a machine of several joints moves, whatever program integrates them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BODY = "body"  # label of the body's own parameters, as in "body.shank.mass"


@dataclass(frozen=True)
class Joint:
    """A joint with one degree of freedom: its name, whether its position is an angle, and its places in the position and in the
    velocity vector."""

    name: str
    rotational: bool
    position: int
    velocity: int


@dataclass(frozen=True)
class Passive:
    """What a body's file says of the losses of a joint: viscous damping and dry friction, which are elements here."""

    damping: float = 0.0
    friction: float = 0.0


class Body(ABC):
    """Links that move: positions (nq,), velocities (nv,), and forces (nv,) on its degrees of freedom.

    It knows inertia, gravity, springs and contacts. What acts along a joint is no part of it: actuators, friction, sensors and
    delays are elements of that joint's path.
    """

    joints: Mapping[str, Joint]
    step: float  # [s] of the integration
    base: str  # "fixed", "free" or the name of the joint along which the base moves

    @property
    @abstractmethod
    def parameters(self) -> dict[str, float]:
        """Inertial parameters by "link.mass" [kg], "link.inertia" [kg*m^2] of links that turn, "link.payload" [kg] of links at ends, and "joint.armature" [kg or kg*m^2]."""

    @abstractmethod
    def with_parameters(self, values: Mapping[str, float]) -> "Body":
        """A copy with some of the parameters replaced; a link whose mass is scaled keeps its shape, and one that is given an
        inertia keeps this with any mass."""

    @abstractmethod
    def inverse(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Forces (n, nv) that make the motion (n, nq), (n, nv), (n, nv) without contacts."""

    @abstractmethod
    def columns(self, names: list[str], position: Array, velocity: Array, acceleration: Array) -> Array:
        """Derivatives (n, nv, p) of `inverse` with respect to the named parameters, in which it is linear."""

    @abstractmethod
    def effective_inertia(self, joint: str) -> float:
        """Inertia [kg or kg*m^2] that a force along the joint meets at the reference pose: 1 / (M^-1)_jj."""

    @abstractmethod
    def touches(self, position: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Whether anything is in contact, or nearer to it than `margin` [m], at positions (n, nq)."""
