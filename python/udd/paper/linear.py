"""Stability of a state at rest, from the model's rates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from udd.models import Model

_STEP = 1e-5  # of a component's size: the error of a central difference is its square, 1e-10


def eigenvalues(model: Model, state: Sequence[float], sizes: Sequence[float]) -> NDArray[np.complex128]:
    """Eigenvalues of the rates' Jacobian by central differences, the real one first.

    Parameters
    ----------
    model : Model
    state : sequence of float, length n
        The first n components; of a disk without its orientation, on which nothing depends.
    sizes : sequence of float, length n
        How large the components typically are.

    Returns
    -------
    ndarray, shape (n,)
        By the absolute imaginary part.
    """
    n, dim = len(state), len(model.state_names)
    steps = _STEP * np.asarray(sizes, dtype=np.float64)
    points = np.zeros((2, n, dim))
    points[..., :n] = state
    for k in range(n):
        points[0, k, k] += steps[k]
        points[1, k, k] -= steps[k]
    rates = model.rates(0.0, points)[..., :n]
    matrix = ((rates[0] - rates[1]) / (2 * steps[:, None])).T
    values = np.linalg.eigvals(matrix).astype(np.complex128)
    order = np.lexsort((values.imag, np.abs(values.imag)))
    result: NDArray[np.complex128] = values[order]
    return result


def growth(model: Model, state: Sequence[float], sizes: Sequence[float]) -> float:
    """The largest real part: positive where the state is unstable."""
    return float(eigenvalues(model, state, sizes).real.max())
