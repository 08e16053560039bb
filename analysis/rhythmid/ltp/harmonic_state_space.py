"""Harmonic state space of a linear time-periodic system and its harmonic transfer functions: equations (1)-(4).

N. M. Wereley, Analysis and Control of Linear Periodically Time Varying Systems, PhD thesis, MIT, 1991. With exponentially
modulated signals, x(t) = Σ_n X_n exp((s + j n ω_p) t), equation (1) becomes s X = (A − N) X + B U, Y = C X + D U, where A, B, C,
D hold Fourier coefficients in Toeplitz blocks (block row n, block column k: coefficient n − k) and N = blockdiag(j n ω_p I).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.ltp.linearisation import Linearisation

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
TRUNCATION = 20  # harmonics kept on either side
# distance to a pole, relative to the fastest mode, below which a requested frequency lies on the pole
INTEGRATES = 1e-9


def toeplitz_blocks(coefficients: Complex) -> Complex:
    """Block Toeplitz matrix of Fourier coefficients −2N … 2N; (4N + 1, r, c) -> ((2N + 1) r, (2N + 1) c)."""
    order = (len(coefficients) - 1) // 4
    n = np.arange(2 * order + 1)
    blocks = coefficients[2 * order + n[:, None] - n[None, :]]
    rows, columns = coefficients.shape[1:]
    return blocks.transpose(0, 2, 1, 3).reshape((2 * order + 1) * rows, (2 * order + 1) * columns)


@dataclass(frozen=True, eq=False)
class HarmonicStateSpace:
    """Paper, equation (2), truncated to harmonics −N … N: s X = (A − N) X + B U, Y = C X + D U.

    `a_minus_n` complex128[(2N + 1) q, (2N + 1) q]; `b` [(2N + 1) q, 2N + 1]; `c` [2N + 1, (2N + 1) q]; `d`
    [2N + 1, 2N + 1]; `omega` ω_p [rad/s].
    """

    a_minus_n: Complex
    b: Complex
    c: Complex
    d: Complex
    omega: float

    @property
    def order(self) -> int:
        """N."""
        return (len(self.d) - 1) // 2

    @cached_property
    def _modes(self) -> tuple[Complex, Complex, Complex] | None:
        """Eigenvalues, and the parts of input and output in modal coordinates; None where A − N is not diagonalisable."""
        values, vectors = np.linalg.eig(self.a_minus_n)
        if np.linalg.cond(vectors) > 1e10:
            return None
        inputs = np.linalg.solve(vectors, self.b).astype(complex)
        return values.astype(complex), inputs, self.c[self.order] @ vectors

    def htf(self, harmonics: NDArray[np.int64], frequency: Array) -> Complex:
        """G_m(jω) for the harmonics m (h,) at output frequencies [Hz] (n,); shape (h, n).

        Paper, equation (3): G = C [sI − (A − N)]⁻¹ B + D. In the convention of (4), Y(jω) = Σ_m G_m(jω) U(j(ω − mω_p)),
        G_m(jω) is the entry of row 0 (the output at ω) and column −m (the input at ω − mω_p) for s = jω.
        Raises InputError at a pole on the imaginary axis: the machine integrates.
        """
        columns = self.order - np.asarray(harmonics)
        s = 2j * np.pi * np.asarray(frequency, dtype=float)
        direct = self.d[self.order, columns][:, None]
        if self._modes is not None:
            values, inputs, outputs = self._modes
            apart = np.abs(s[None, :] - values[:, None])
            if apart.size and apart.min() < INTEGRATES * np.abs(values).max():
                raise InputError(
                    "the machine does not return to its cycle once displaced (nothing restores its position), so it has no "
                    "harmonic transfer functions; `rhythmid diagnose` estimates the parameters of such a model"
                )
            return (inputs[:, columns] * outputs[:, None]).T @ (1.0 / (s[None, :] - values[:, None])) + direct
        found = np.empty((len(columns), len(s)), dtype=complex)
        for i, at in enumerate(s):
            left = np.linalg.solve((at * np.eye(len(self.a_minus_n)) - self.a_minus_n).T, self.c[self.order])
            found[:, i] = left @ self.b[:, columns]
        return found + direct


def harmonic_state_space(linearisation: Linearisation, order: int = TRUNCATION) -> HarmonicStateSpace:
    """Equation (2) from (1), truncated to `order` harmonics on either side."""
    omega = linearisation.cycle.pumping.omega
    coefficients = linearisation.fourier(2 * order)
    q = coefficients.shape[1] - 1
    n = np.repeat(np.arange(-order, order + 1), q)
    a = toeplitz_blocks(coefficients[:, :q, :q]) - np.diag(1j * omega * n)
    b = toeplitz_blocks(coefficients[:, :q, q:])
    c = toeplitz_blocks(coefficients[:, q:, :q])
    d = toeplitz_blocks(coefficients[:, q:, q:])
    return HarmonicStateSpace(a, b, c, d, omega)
