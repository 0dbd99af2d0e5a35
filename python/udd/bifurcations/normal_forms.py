"""Coefficients that say what a bifurcation is like."""

from __future__ import annotations

import numpy as np

from .flow_map import Floats

__all__ = ["first_lyapunov_coefficient"]


def first_lyapunov_coefficient(by_state: Floats, second: Floats, third: Floats) -> float:
    """The first Lyapunov coefficient of the complex pair of eigenvalues nearest to the imaginary axis.

    Negative where cycles are born stable. The formula is (5.39) of Yu. A. Kuznetsov, Elements of Applied
    Bifurcation Theory (2004), with the right eigenvector of length 1; NaN where there is no complex pair.
    """
    values, right = np.linalg.eig(by_state)
    pairs = np.flatnonzero(values.imag > 1e-12 * np.abs(values).max(initial=1e-300))
    if not len(pairs):
        return float("nan")
    k = pairs[np.argmin(np.abs(values[pairs].real))]
    frequency, q = float(values[k].imag), right[:, k] / np.linalg.norm(right[:, k])
    left_values, left = np.linalg.eig(by_state.T)
    p = left[:, np.argmin(np.abs(left_values - values[k].conj()))]
    p = p / np.vdot(p, q).conj()  # <p, q> = 1

    def b(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        result: np.ndarray = np.einsum("nij,i,j->n", second, u, v)
        return result

    # At the bifurcation itself the pair is purely imaginary.
    eye = np.eye(len(q))
    cubic = np.einsum("nijk,i,j,k->n", third, q, q, q.conj())
    # A singular matrix, as at a fold, leaves the least-squares solution.
    slow = b(q, np.linalg.lstsq(by_state.astype(complex), b(q, q.conj()), rcond=None)[0])
    fast = b(q.conj(), np.linalg.solve(2j * frequency * eye - by_state, b(q, q)))
    return float((np.vdot(p, cubic) - 2.0 * np.vdot(p, slow) + np.vdot(p, fast)).real / (2.0 * frequency))
