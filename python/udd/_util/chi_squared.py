"""The distribution of chi2, by the names of scipy.stats, which takes half a second to import."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import special


def cdf(x: ArrayLike, n: ArrayLike) -> Any:
    """Probability that chi2 of `n` degrees of freedom is at most `x`."""
    return special.chdtr(n, np.maximum(x, 0.0))


def sf(x: ArrayLike, n: ArrayLike) -> Any:
    """Probability that it is larger."""
    return special.chdtrc(n, np.maximum(x, 0.0))


def ppf(p: ArrayLike, n: ArrayLike) -> Any:
    """Return the value that a chi-squared variable stays below with probability `p`."""
    return 2 * special.gammaincinv(np.asarray(n) / 2, p)


def isf(p: ArrayLike, n: ArrayLike) -> Any:
    """Return the value that a chi-squared variable exceeds with probability `p`."""
    return special.chdtri(n, p)
