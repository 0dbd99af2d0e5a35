"""Basin fractions, and the uncertainty exponent of basin boundaries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.models.state_scaling import Floats

_BLOCKS = 64  # of the grid, as many along each axis
_REPEATS = 200
_FAR = 0.8  # of what unrelated points would show: beyond this the law bends


def basin_fractions(ends: NDArray[np.int32], count: int) -> tuple[Floats, Floats]:
    """Estimate the share of each end among the points of a grid, with standard errors.

    Parameters
    ----------
    ends : ndarray of int
        End of each point of the grid, below `count`. It is -1 if the end is not known.
    count : int

    Returns
    -------
    share, standard_error : ndarray (count,)

    Notes
    -----
    Every point represents its cell of the grid, as in stratified sampling with one point in each stratum. The
    variance is that between neighbours (strata collapsed two by two along each axis): where neighbours have
    nothing in common it is the binomial one; where the basins are large only the cells at their edges count.
    """
    is_known = ends >= 0
    total = int(is_known.sum())
    if not total:
        return np.full(count, np.nan), np.full(count, np.nan)
    groups = _groups(ends)
    seen = groups >= 0
    size = seen.sum(axis=1)
    share, error = np.zeros(count), np.zeros(count)
    for k in range(count):
        here = (groups == k).sum(axis=1)
        share[k] = here.sum() / total
        with np.errstate(divide="ignore", invalid="ignore"):
            # n/(n - 1) sum (x - mean)^2 of zeros and ones; a single cell counts as a typical one.
            alone = share[k] * (1 - share[k])
            within = np.where(size > 1, size / (size - 1) * here * (1 - here / size), alone)
        error[k] = np.sqrt(within[size > 0].sum()) / total
    return share, error


def _groups(ends: NDArray[np.int32]) -> NDArray[np.int32]:
    """Neighbours two by two along each axis, shape (groups, 2^dim); -1 beyond the edge."""
    padded = np.pad(ends, [(0, n % 2) for n in ends.shape], constant_values=-1)
    split = padded.reshape([m for n in padded.shape for m in (n // 2, 2)])
    dim = ends.ndim
    order = [*range(0, 2 * dim, 2), *range(1, 2 * dim, 2)]
    return split.transpose(order).reshape(-1, 2**dim)


@dataclass(frozen=True, eq=False)
class UncertaintyExponent:
    """Growth of the share of pairs that end differently with their distance.

    Attributes
    ----------
    stride : ndarray of int (k,)
        Distances between the states of a pair, in steps of the grid.
    fraction : ndarray (k,)
        Share of pairs along the axes whose ends differ. The pairs have the distance `stride`.
    exponent, standard_error : float
        Exponent in fraction ~ stride^exponent. NaN if it cannot be determined.
    fitted : ndarray of bool (k,)
        True for the distances that the exponent is fitted to.
    """

    stride: NDArray[np.int32]
    fraction: Floats
    exponent: float
    standard_error: float
    fitted: NDArray[np.bool_]


def uncertainty(ends: NDArray[np.int32]) -> UncertaintyExponent:
    """Estimate the uncertainty exponent of the basins on a grid; `ends` as in :func:`basin_fractions`.

    Notes
    -----
    C. Grebogi, S. W. McDonald, E. Ott and J. A. Yorke, Phys. Lett. A 99 (1983) 415: if points known to
    within eps are uncertain with probability f ~ eps^alpha, the boundary's dimension is that of the space
    less alpha. Distances at which f nears that of unrelated points are left out; three must remain. The
    standard error is from 200 bootstrap samples of 64 blocks of the grid, and from how far the fractions
    are from a power law.
    """
    longest = max(min(ends.shape) // 8, 1)
    stride = 2 ** np.arange(int(np.log2(longest)) + 1, dtype=np.int32)
    pairs = np.array([_per_block(ends, int(s)) for s in stride])  # (strides, blocks, [differ, all])
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = pairs[:, :, 0].sum(axis=1) / pairs[:, :, 1].sum(axis=1)
    counts = np.bincount(ends[ends >= 0])
    unrelated = 1.0 - ((counts / max(counts.sum(), 1)) ** 2).sum()
    fitted = np.isfinite(fraction) & (fraction > 0) & (fraction < _FAR * unrelated)
    exponent, misfit = _slope(stride, pairs, fitted)
    draws = np.random.default_rng(0).integers(0, pairs.shape[1], (_REPEATS, pairs.shape[1]))
    again = np.array([_slope(stride, pairs[:, draw], fitted)[0] for draw in draws])
    again = again[np.isfinite(again)]
    is_determined = np.isfinite(exponent) and len(again) > _REPEATS // 2
    error = float(np.hypot(again.std(ddof=1), misfit)) if is_determined else float("nan")
    return UncertaintyExponent(stride, fraction, exponent, error, fitted)


def _per_block(ends: NDArray[np.int32], stride: int) -> NDArray[np.int64]:
    """Count the pairs at this distance that end differently, and all pairs, in each block of the grid."""
    block = np.zeros(ends.shape, dtype=np.int64)
    along = round(_BLOCKS ** (1 / ends.ndim))
    for axis, n in enumerate(ends.shape):
        place = np.arange(n) * along // n
        block = block * along + place.reshape([-1 if a == axis else 1 for a in range(ends.ndim)])
    result = np.zeros((along**ends.ndim, 2), dtype=np.int64)
    for axis, n in enumerate(ends.shape):
        one = np.take(ends, np.arange(n - stride), axis)
        other = np.take(ends, np.arange(stride, n), axis)
        where = np.take(block, np.arange(n - stride), axis)
        is_pair = (one >= 0) & (other >= 0)
        result[:, 0] += np.bincount(where[is_pair & (one != other)], minlength=len(result))
        result[:, 1] += np.bincount(where[is_pair], minlength=len(result))
    return result


def _slope(
    stride: NDArray[np.int32], pairs: NDArray[np.int64], fitted: NDArray[np.bool_]
) -> tuple[float, float]:
    """Least squares in the logarithms: the slope, and its standard error by the residuals."""
    differ, all_ = pairs[fitted].sum(axis=1).T if fitted.any() else (np.zeros(0), np.zeros(0))
    if len(differ) < 3 or not (differ > 0).all():
        return float("nan"), float("nan")
    x, y = np.log(stride[fitted]), np.log(differ / all_)
    x, y = x - x.mean(), y - y.mean()
    slope = x @ y / (x @ x)
    residual = y - slope * x
    return float(slope), float(np.sqrt(residual @ residual / (len(x) - 2) / (x @ x)))
