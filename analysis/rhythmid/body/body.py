"""A body: the links and joints of a machine with several joints, independent of the program that integrates them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BODY = "body"  # label of the body's own parameters, as in "body.shank.mass"


@dataclass(frozen=True)
class Joint:
    """A joint with one degree of freedom: its name, whether its position is an angle, and its indices in the
    position and in the velocity vector."""

    name: str
    rotational: bool
    position: int
    velocity: int


@dataclass(frozen=True)
class Passive:
    """Losses of a joint in a body's file: viscous damping and dry friction. Here they become elements."""

    damping: float = 0.0
    friction: float = 0.0


class Body(ABC):
    """Moving links: positions (nq,), velocities (nv,), and forces (nv,) on the degrees of freedom.

    It contains inertia, gravity, springs and contacts. Effects along a joint are not part of it: actuators,
    friction, sensors and delays are elements of that joint's path.
    """

    joints: Mapping[str, Joint]
    step: float  # [s] of the integration
    base: str  # "fixed", "free" or the name of the joint along which the base moves

    @property
    @abstractmethod
    def parameters(self) -> dict[str, float]:
        """Inertial parameters by name: "link.mass" [kg], "link.inertia" [kg*m^2] of rotating links, "link.payload"
        [kg] of end links, and "joint.armature" [kg or kg*m^2]."""

    @abstractmethod
    def with_parameters(self, values: Mapping[str, float]) -> "Body":
        """A copy with some of the parameters replaced. A link whose mass is scaled keeps its shape; a link with a
        given inertia keeps that inertia for any mass."""

    @abstractmethod
    def inverse(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Forces (n, nv) required for the motion (n, nq), (n, nv), (n, nv) without contacts."""

    @abstractmethod
    def columns(self, names: list[str], position: Array, velocity: Array, acceleration: Array) -> Array:
        """Derivatives (n, nv, p) of `inverse` with respect to the named parameters; it is linear in them."""

    @abstractmethod
    def effective_inertia(self, joint: str) -> float:
        """Effective inertia [kg or kg*m^2] of a joint at the reference pose: 1 / (M^-1)_jj."""

    @abstractmethod
    def touches(self, position: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Whether any contact is closed, or nearer than `margin` [m], at positions (n, nq); (n,)."""
