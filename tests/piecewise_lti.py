"""Piecewise linear time-invariant systems of period T, equation (6), and their exact harmonic transfer functions.

Within each piece the response to exp(jωt) is known in closed form, so nothing is truncated: an independent check of the
harmonic state space, and the closed form for the paper's plant, equation (13).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Piece:
    """dx/dt = A x + B u, y = C x + D u for start <= mod(t, T) < end [s]."""

    start: float
    end: float
    a: Array
    b: Array
    c: Array
    d: float = 0.0


@dataclass(frozen=True, eq=False)
class PiecewiseLti:
    """Paper, equation (6), without its delays: pieces that tile one period [s] of cycle time."""

    pieces: tuple[Piece, ...]
    period: float

    def htf(self, harmonics: NDArray[np.int64], frequency: Array) -> Complex:
        """G_m(jω) in the convention of (4), m (h,), output frequency [Hz] (n,); shape (h, n).

        For u = exp(jνt), ν = ω − mω_p, the envelope z(t) = x(t) exp(−jνt) has the period T and within a piece obeys
        dz/dt = F z + B, F = A − jνI. The output's component at ω is the m-th Fourier coefficient of C z + D.
        """
        omega_p = 2.0 * np.pi / self.period
        omega = 2.0 * np.pi * np.asarray(frequency, dtype=float)
        return np.array([self._sideband(omega - m * omega_p, m * omega_p) for m in harmonics])

    def _sideband(self, nu: Array, shift: float) -> Complex:
        """Components at ν + `shift` of the responses to exp(jνt), ν (n,) [rad/s]."""
        q = len(self.pieces[0].b)
        identity = np.eye(q)
        through = np.broadcast_to(identity.astype(complex), (len(nu), q, q))
        offset = np.zeros((len(nu), q, 1), dtype=complex)
        steps = []
        for piece in self.pieces:  # z(end) = Φ z(start) + forced part, piece after piece
            f = piece.a - 1j * nu[:, None, None] * identity
            steady = -np.linalg.solve(f, np.broadcast_to(piece.b[:, None], (len(nu), q, 1)))
            phi = expm(f * (piece.end - piece.start))
            steps.append((piece, f, steady, phi))
            offset = phi @ (offset - steady) + steady
            through = phi @ through
        state = np.linalg.solve(identity - through, offset)
        total: Complex = np.zeros(len(nu), dtype=np.complex128)
        for piece, f, steady, phi in steps:  # z = steady + exp(F t) (z(start) − steady)
            length = piece.end - piece.start
            turned = f - 1j * shift * identity
            moving = np.linalg.solve(turned, (expm(turned * length) - identity) @ (state - steady))
            window = length if shift == 0.0 else (1.0 - np.exp(-1j * shift * length)) / (1j * shift)
            part = (piece.c @ moving)[:, 0] + ((piece.c @ steady)[:, 0] + piece.d) * window
            total = total + part * np.exp(-1j * shift * piece.start)
            state = steady + phi @ (state - steady)
        return (total / self.period).astype(complex)


def hybrid_spring_mass_damper(
    stiffness: float, damping: float, mass: float, stance: tuple[float, float], period: float
) -> PiecewiseLti:
    """Paper, equations (11)-(13): dξ/dt = [[0, 1], [−k, −c s(t)]] ξ + [0, 1] u (for m = 1), y = ξ_1.

    The switching function s(t) is 1 during `stance` = (start, end) [s] of cycle time, which may run over the end of
    the period [s]; `stiffness` k [N/m], `damping` c [N s/m], `mass` m [kg].
    """
    b, c = np.array([0.0, 1.0 / mass]), np.array([1.0, 0.0])
    flight_a = np.array([[0.0, 1.0], [-stiffness / mass, 0.0]])
    stance_a = np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]])
    start, end = stance[0] % period, stance[1] % period
    inner, outer = (stance_a, flight_a) if start < end else (flight_a, stance_a)
    low, high = min(start, end), max(start, end)
    edges = ((0.0, low, outer), (low, high, inner), (high, period, outer))
    return PiecewiseLti(tuple(Piece(a0, a1, a, b, c) for a0, a1, a in edges if a1 > a0), period)
