"""Coefficients that say what a bifurcation is like.

The formulas are those of Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory (2004), and of his paper in
SIAM J. Numer. Anal. 36 (1999) 1104.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .flow_map import Floats

__all__ = [
    "Derivatives",
    "bogdanov_takens_coefficients",
    "cusp_coefficient",
    "first_lyapunov_coefficient",
    "second_lyapunov_coefficient",
    "zero_hopf_coefficients",
]

_STEP = 5e-3  # typical sizes, for differences of the third derivatives


@dataclass(frozen=True, eq=False)
class Derivatives:
    """The rates' derivatives by the state at a point: (n, n), (n, n, n) and (n, n, n, n)."""

    by_state: Floats
    second: Floats
    third: Floats

    def b(self, u: Any, v: Any) -> Any:
        """Return the second derivative along two vectors."""
        return np.einsum("nij,i,j->n", self.second, u, v)

    def c(self, u: Any, v: Any, w: Any) -> Any:
        """Return the third derivative along three vectors."""
        return np.einsum("nijk,i,j,k->n", self.third, u, v, w)


def _hopf_vectors(by_state: Floats) -> tuple[float, Any, Any] | None:
    """Frequency, right and left eigenvector of the complex pair that is nearest to the imaginary axis."""
    values, right = np.linalg.eig(by_state)
    pairs = np.flatnonzero(values.imag > 1e-12 * np.abs(values).max(initial=1e-300))
    if not len(pairs):
        return None
    k = pairs[np.argmin(np.abs(values[pairs].real))]
    frequency, q = float(values[k].imag), right[:, k] / np.linalg.norm(right[:, k])
    left_values, left = np.linalg.eig(by_state.T)
    p = left[:, np.argmin(np.abs(left_values - values[k].conj()))]
    return frequency, q, p / np.vdot(p, q).conj()  # <p, q> = 1


def first_lyapunov_coefficient(at: Derivatives) -> float:
    """Return the first Lyapunov coefficient of the complex pair of eigenvalues nearest to the imaginary axis.

    Negative where cycles are born stable. The formula is (5.39) of the book, with the right eigenvector of
    length 1; NaN where there is no complex pair.
    """
    vectors = _hopf_vectors(at.by_state)
    if vectors is None:
        return float("nan")
    frequency, q, p = vectors
    # At the bifurcation itself the pair is purely imaginary.
    eye = np.eye(len(q))
    cubic = at.c(q, q, q.conj())
    # A singular matrix, as at a fold, leaves the least-squares solution.
    slow = at.b(q, np.linalg.lstsq(at.by_state.astype(complex), at.b(q, q.conj()), rcond=None)[0])
    fast = at.b(q.conj(), np.linalg.solve(2j * frequency * eye - at.by_state, at.b(q, q)))
    return float((np.vdot(p, cubic) - 2.0 * np.vdot(p, slow) + np.vdot(p, fast)).real / (2.0 * frequency))


def second_lyapunov_coefficient(at: Callable[[Floats], Derivatives], x: Floats, size: Floats) -> float:
    """Return the second Lyapunov coefficient where the first one is zero (a Bautin point).

    Fourth and fifth derivatives are differences of third ones, of the fourth order in the step.

    Parameters
    ----------
    at : callable
        The derivatives at a state.
    x, size : ndarray, shape (n,)
        The equilibrium, and the typical sizes of its components.
    """
    here = at(x)
    vectors = _hopf_vectors(here.by_state)
    if vectors is None:
        return float("nan")
    w, q, p = vectors
    a, b, c, eye = here.by_state, here.b, here.c, np.eye(len(x))
    first, second = np.zeros_like(here.third, dtype=complex), np.zeros_like(here.third)
    for part, unit in ((q.real, 1.0), (q.imag, 1j)):
        reach = float(np.abs(part / size).max())
        if reach == 0.0:
            continue
        h = _STEP / reach
        one, two, minus, far = (at(x + k * h * part).third for k in (1.0, 2.0, -1.0, -2.0))
        first += unit * (8.0 * (one - minus) - (two - far)) / (12.0 * h)
        second += (16.0 * (one + minus) - (two + far) - 30.0 * here.third) / (12.0 * h * h)
    qc = q.conj()

    def d(u: Any, v: Any, z: Any, conjugate: bool = False) -> Any:
        """Return the fourth derivative along q, or its conjugate, and three vectors."""
        return np.einsum("nijk,i,j,k->n", first.conj() if conjugate else first, u, v, z)

    h20 = np.linalg.solve(2j * w * eye - a, b(q, q))
    h11 = -np.linalg.solve(a, b(q, qc))
    c2 = c(q, q, qc) + b(qc, h20) + 2.0 * b(q, h11)
    c1 = 0.5 * np.vdot(p, c2)
    h30 = np.linalg.solve(3j * w * eye - a, c(q, q, q) + 3.0 * b(q, h20))
    # Across the eigenvector, where the matrix is regular.
    bordered = np.block([[1j * w * eye - a, q[:, None]], [p.conj()[None], np.zeros((1, 1))]])
    h21 = np.linalg.solve(bordered, np.append(c2 - 2.0 * c1 * q, 0.0))[:-1]
    h31 = np.linalg.solve(
        2j * w * eye - a,
        d(q, q, q, True) + 3.0 * c(q, q, h11) + 3.0 * c(q, qc, h20) + 3.0 * b(h20, h11)
        + b(qc, h30) + 3.0 * b(q, h21) - 6.0 * c1 * h20,
    )  # fmt: skip
    h22 = -np.linalg.solve(
        a,
        d(q, qc, qc) + 4.0 * c(q, qc, h11) + c(qc, qc, h20) + c(q, q, h20.conj()) + 2.0 * b(h11, h11)
        + 2.0 * b(q, h21.conj()) + 2.0 * b(qc, h21) + b(h20.conj(), h20) - 4.0 * h11 * (c1 + c1.conj()),
    )  # fmt: skip
    fifth = np.einsum("nijk,i,j,k->n", second, q, q, qc)
    terms = (
        fifth + d(q, q, h20.conj()) + 3.0 * d(q, qc, h20, True) + 6.0 * d(q, q, h11, True)
        + c(qc, qc, h30) + 3.0 * c(q, q, h21.conj()) + 6.0 * c(q, qc, h21) + 3.0 * c(q, h20.conj(), h20)
        + 6.0 * c(q, h11, h11) + 6.0 * c(qc, h20, h11) + 2.0 * b(qc, h31) + 3.0 * b(q, h22)
        + b(h20.conj(), h30) + 3.0 * b(h21.conj(), h20) + 6.0 * b(h11, h21)
    )  # fmt: skip
    return float(np.vdot(p, terms).real / 12.0 / w)


def _null_vectors(by_state: Floats) -> tuple[Floats, Floats]:
    """Right and left vectors of the least singular value; the largest part of the right one is positive."""
    left, _, right = np.linalg.svd(by_state)
    q, p = right[-1], left[:, -1]
    return q * np.sign(q[np.argmax(np.abs(q))]), p


def cusp_coefficient(at: Derivatives) -> float:
    """Return the coefficient ``c`` of ``w' = b1 + b2 w + c w^3`` at a cusp, for a null vector of length 1."""
    q, p = _null_vectors(at.by_state)
    p = p / (p @ q)
    quadratic = at.b(q, q)
    bordered = np.block([[at.by_state, p[:, None]], [q[None], np.zeros((1, 1))]])
    second_order = np.linalg.solve(bordered, np.append(-quadratic + (p @ quadratic) * q, 0.0))[:-1]
    return float(p @ (at.c(q, q, q) + 3.0 * at.b(q, second_order))) / 6.0


def bogdanov_takens_coefficients(at: Derivatives) -> tuple[float, float]:
    """Return ``a`` and ``b`` of ``u' = v, v' = ... + a u^2 + b u v`` at a Bogdanov-Takens point.

    The null vector has length 1.
    """
    matrix = at.by_state
    q0, p1 = _null_vectors(matrix)
    q1 = np.linalg.lstsq(matrix, q0, rcond=1e-6)[0]
    q1 = q1 - (q0 @ q1) * q0
    p1 = p1 / (p1 @ q1)
    p0 = np.linalg.lstsq(matrix.T, p1, rcond=1e-6)[0]
    p0 = p0 - (p0 @ q1) * p1
    return 0.5 * float(p1 @ at.b(q0, q0)), float(p0 @ at.b(q0, q0) + p1 @ at.b(q0, q1))


def zero_hopf_coefficients(at: Derivatives) -> tuple[float, float]:
    """Return the coefficients ``s`` and ``theta`` at a zero-Hopf point, which decide its unfolding.

    With ``u' = b u^2 + c |z|^2``, ``z' = i w z + d u z`` to the second order they are ``b c`` over its
    absolute value, and ``Re d / b``.
    """
    vectors = _hopf_vectors(at.by_state)
    if vectors is None:
        return float("nan"), float("nan")
    _, q1, p1 = vectors
    q0, p0 = _null_vectors(at.by_state)
    p0 = p0 / (p0 @ q0)
    b = 0.5 * float(p0 @ at.b(q0, q0))
    c = float((p0 @ at.b(q1, q1.conj())).real)
    d = float(np.vdot(p1, at.b(q0, q1)).real)
    return float(np.sign(b * c)), d / (2.0 * b) if b else float("nan")
