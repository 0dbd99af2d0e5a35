"""Penalised curve from its score, with smoothness by marginal likelihood and a test of exact level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from udd._util import chi_squared
from udd.discovery.scoring.forcing import Score

Array = NDArray[np.float64]

#: Numbers of smooth directions, in addition to the straight line or the constant, that are tested.
ORDERS = (0, 2, 4, 7, 12, 20, 36)
# share of the information's size at which the roughness decides, where the data have no information
_SMALL = 1e-7
_NOTHING = 1e-10  # relative size below which a direction is dropped
_SEEN = 0.5  # information of a direction in units of its prior, above which it is tested
_STRETCH = 18.0  # range of the log precision of the prior that is tried, each way


@dataclass(frozen=True)
class DemmlerReinschBasis:
    """Combinations of the coefficients that are independent in data and prior, the smooth ones first.

    Attributes
    ----------
    vectors : ndarray (k, r)
        Coefficients of the combinations.
    gradient : ndarray (r,)
    information, roughness : ndarray (r,)
        Diagonals of the two matrices in this basis.
    straight : int
        Count of directions without roughness: the constant, and the straight line unless periodic.
    """

    vectors: Array
    gradient: Array
    information: Array
    roughness: Array
    straight: int


@dataclass(frozen=True)
class PenalizedFit:
    """Coefficients of a curve under the smoothness prior with the highest evidence.

    Attributes
    ----------
    coefficients : ndarray (k,)
    covariance : ndarray (k, k)
    precision : float
        Precision of the prior on second differences.
    df : float
        Effective degrees of freedom.
    evidence : float
        Log evidence relative to no curve.
    """

    coefficients: Array
    covariance: Array
    precision: float
    df: float
    evidence: float


@dataclass(frozen=True)
class Confounding:
    """Directions in which a curve is confounded with the free parameters of a fit.

    A constant velocity of the contact is equivalent to the drive's speed, and a torque proportional to Omega
    to friction: these parts of a curve are not identifiable.

    Attributes
    ----------
    rows : ndarray (a, k)
        Amount of each confounded curve in the coefficients.
    vectors : ndarray (k, a)
        Most probable change of the coefficients with each of them.
    """

    rows: Array
    vectors: Array

    def aligned(self, coefficients: Array, to: Array) -> Array:
        """Return the coefficients with the confounded part of other ones, for comparison."""
        result: Array = coefficients + self.vectors @ (self.rows @ (to - coefficients))
        return result

    def left(self, covariance: Array) -> Array:
        """Return the covariance of a curve whose confounded part is fixed."""
        result: Array = covariance - self.vectors @ self.rows @ covariance
        return result


def directions(score: Score, roughness: Array) -> DemmlerReinschBasis:
    """Diagonalise information and roughness together (Demmler and Reinsch)."""
    information = score.information
    size = float(np.trace(information)) or 1.0
    unit = roughness * (size / np.trace(roughness))
    eigenvalues, turn = eigh(information + _SMALL * unit)
    keep = eigenvalues > _NOTHING * eigenvalues[-1]
    whiten = turn[:, keep] / np.sqrt(eigenvalues[keep])
    rough, turn = eigh(whiten.T @ unit @ whiten)
    rough = np.maximum(rough, 0.0)
    vectors = whiten @ turn
    nothing = 1e-6 * float(np.median(rough))
    straight = int((rough <= nothing).sum())
    rough[:straight] = 0.0
    diagonal = np.maximum(np.einsum("ka,kl,la->a", vectors, information, vectors), 0.0)
    return DemmlerReinschBasis(
        vectors, vectors.T @ score.gradient, diagonal, rough * (np.trace(roughness) / size), straight
    )


def smooth(score: Score, roughness: Array, observations: int, at: Array | None = None) -> PenalizedFit:
    """Fit the curve under the prior with the highest evidence.

    Second differences are normal with a common variance, which the evidence chooses. A constant and a slope
    each cost a parameter in the Bayesian information criterion. `at` are the coefficients of the curve that
    the scored model already has.
    """
    d = directions(score, roughness)
    # The quadratic form is moved to the origin, as if the model had no curve.
    g = d.gradient if at is None else d.vectors.T @ (score.gradient + score.information @ at)
    f, has_roughness = d.information, d.roughness > 0

    # The prior of a straight part far beyond unit information is widened, so that it does not shrink it.
    straight = f / np.maximum(observations, g**2 / np.maximum(f, 1e-300))

    def prior(log_precision: float) -> Array:
        return np.where(has_roughness, np.exp(log_precision) * d.roughness, straight)

    def evidence(log_precision: float) -> float:
        prior_precision = prior(log_precision)
        use = f > 0
        gain = g[use] ** 2 / (f + prior_precision)[use] - np.log1p(f[use] / prior_precision[use])
        return float(gain.sum() / 2)

    # Over a few distinct values no curve has any curvature.
    middle = (
        float(np.log(_typical(f[has_roughness]) / np.median(d.roughness[has_roughness])))
        if has_roughness.any()
        else 0.0
    )
    grid = middle + np.arange(-_STRETCH, _STRETCH + 0.25, 0.5)
    likely = np.array([evidence(v) for v in grid])
    # The smoothness is uncertain: the precisions are averaged with their evidence as weights.
    weight = np.exp(likely - likely.max())
    weight /= weight.sum()
    total = np.maximum(f + np.array([prior(v) for v in grid]), 1e-300)
    mean = weight @ (g / total)
    off = np.sqrt(weight)[:, None] * (g / total - mean)
    covariance = np.diag(weight @ (1.0 / total)) + off.T @ off
    return PenalizedFit(
        coefficients=d.vectors @ mean,
        covariance=d.vectors @ covariance @ d.vectors.T,
        precision=float(np.exp(grid[int(np.argmax(likely))])),
        df=float(weight @ (f / total).sum(axis=1)),
        evidence=float(np.log(np.mean(np.exp(likely - likely.max()))) + likely.max()),
    )


def _typical(information: Array) -> float:
    """Return the median information, of the moved directions if the record hardly moves most of them."""
    middle = float(np.median(information + 1e-300))
    moved = information[information > _NOTHING * information.max()]
    return middle if middle > _NOTHING * information.max() or not len(moved) else float(np.median(moved))


def chance(score: Score, roughness: Array) -> tuple[float, float, int]:
    """Test a penalised curve by the decrease in chi2 in few smooth directions.

    Return the p-value, the decrease, and the number of directions. Without an effect the components of the
    gradient in the Demmler-Reinsch basis are independent and normal. The decrease in chi2 in the first k
    directions is then exactly chi2-distributed. A few values of k are tested; the smallest p-value is
    multiplied by their number (Bonferroni).
    """
    d = directions(score, roughness)
    is_seen = d.information > _SEEN
    z = np.where(is_seen, d.gradient**2 / np.maximum(d.information, 1e-300), 0.0)[is_seen]
    straight = int(is_seen[: d.straight].sum())
    falls = np.cumsum(z)
    numbers = sorted({min(straight + more, len(z)) for more in ORDERS} - {0})
    if not numbers:
        return 1.0, 0.0, 0
    by_chance = [float(chi_squared.sf(falls[n - 1], n)) for n in numbers]
    k = int(np.argmin(by_chance))
    return min(by_chance[k] * len(numbers), 1.0), float(falls[numbers[k] - 1]), numbers[k]
