"""A penalised curve from its score, smoothness by marginal likelihood, with a test of known level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from udd._util import chi_squared
from udd.discovery.scoring.forcing import Score

Array = NDArray[np.float64]

#: Numbers of smooth directions, beside the straight line or the constant, that the test looks at.
ORDERS = (0, 2, 4, 7, 12, 20, 36)
_SMALL = 1e-7  # of the information's size: the roughness that decides where the data say nothing
_NOTHING = 1e-10  # a direction of less than this size is none
_SEEN = 0.5  # share of a direction that must be the data's, for the test
_STRETCH = 18.0  # the logarithms of the prior's precision that are tried, each way


@dataclass(frozen=True)
class DemmlerReinschBasis:
    """Combinations of the coefficients that data and prior both treat as independent, the smooth ones first.

    Attributes
    ----------
    vectors : ndarray (k, r)
        Their coefficients.
    gradient : ndarray (r,)
    information, roughness : ndarray (r,)
        The diagonals that remain of the two matrices.
    straight : int
        How many have no roughness: the constant, and the straight line where there is no period.
    """

    vectors: Array
    gradient: Array
    information: Array
    roughness: Array
    straight: int


@dataclass(frozen=True)
class PenalizedFit:
    """A curve's coefficients under the smoothness prior that the evidence asks for.

    Attributes
    ----------
    coefficients : ndarray (k,)
    covariance : ndarray (k, k)
    precision : float
        Of the prior on second differences.
    df : float
        Effective degrees of freedom.
    evidence : float
        Logarithm of the evidence over that for no curve.
    """

    coefficients: Array
    covariance: Array
    precision: float
    df: float
    evidence: float


@dataclass(frozen=True)
class Confounding:
    """What the free parameters of a fit do as well as a curve would.

    A constant that moves the wheels is the drive's speed, a torque proportional to Omega is friction: how
    much of these belongs to the curve cannot be known.

    Attributes
    ----------
    rows : ndarray (a, k)
        How much of each of a such curves there is in coefficients.
    vectors : ndarray (k, a)
        By how much the coefficients change, most likely, with each.
    """

    rows: Array
    vectors: Array

    def aligned(self, coefficients: Array, to: Array) -> Array:
        """The coefficients with as much of these curves as others have, to compare the two."""
        result: Array = coefficients + self.vectors @ (self.rows @ (to - coefficients))
        return result

    def left(self, covariance: Array) -> Array:
        """The covariance of a curve of which these are agreed upon."""
        result: Array = covariance - self.vectors @ self.rows @ covariance
        return result


def directions(score: Score, roughness: Array) -> DemmlerReinschBasis:
    """Diagonalise information and roughness together (Demmler and Reinsch)."""
    information = score.information
    size = float(np.trace(information)) or 1.0
    unit = roughness * (size / np.trace(roughness))
    both, turn = eigh(information + _SMALL * unit)
    keep = both > _NOTHING * both[-1]
    whiten = turn[:, keep] / np.sqrt(both[keep])
    rough, turn = eigh(whiten.T @ unit @ whiten)
    rough = np.maximum(rough, 0.0)
    vectors = whiten @ turn
    nothing = 1e-6 * float(np.median(rough))
    straight = int((rough <= nothing).sum())
    rough[:straight] = 0.0
    own = np.maximum(np.einsum("ka,kl,la->a", vectors, information, vectors), 0.0)
    return DemmlerReinschBasis(
        vectors, vectors.T @ score.gradient, own, rough * (np.trace(roughness) / size), straight
    )


def smooth(score: Score, roughness: Array, observations: int, at: Array | None = None) -> PenalizedFit:
    """The curve under the prior of the highest evidence.

    Second differences are normal with a common variance, which the evidence chooses; a constant and a slope
    are each charged as a parameter is by the Bayesian information criterion.

    Parameters
    ----------
    score : Score
    roughness : ndarray (k, k)
    observations : int
        Numbers in the record.
    at : ndarray (k,), optional
        Coefficients of the curve that the model of the score already holds; by default none.
    """
    d = directions(score, roughness)
    # As if from no curve at all: the quadratic form is moved there.
    g = d.gradient if at is None else d.vectors.T @ (score.gradient + score.information @ at)
    f, bent = d.information, d.roughness > 0

    # What is far beyond a unit's information is not held back by it.
    straight = f / np.maximum(observations, g**2 / np.maximum(f, 1e-300))

    def prior(log_precision: float) -> Array:
        return np.where(bent, np.exp(log_precision) * d.roughness, straight)

    def evidence(log_precision: float) -> float:
        own = prior(log_precision)
        use = f > 0
        gain = g[use] ** 2 / (f + own)[use] - np.log1p(f[use] / own[use])
        return float(gain.sum() / 2)

    # Over a few values alone no curve can bend.
    middle = float(np.log(_typical(f[bent]) / np.median(d.roughness[bent]))) if bent.any() else 0.0
    grid = middle + np.arange(-_STRETCH, _STRETCH + 0.25, 0.5)
    likely = np.array([evidence(v) for v in grid])
    # How smooth the curve is, is not known for sure: the evidence says how much each precision counts.
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
    """The median information, of those directions that the record moves where most it does not."""
    middle = float(np.median(information + 1e-300))
    moved = information[information > _NOTHING * information.max()]
    return middle if middle > _NOTHING * information.max() or not len(moved) else float(np.median(moved))


def chance(score: Score, roughness: Array) -> tuple[float, float, int]:
    """Score test of a penalised curve: the p-value of the largest fall of chi2 in few smooth directions.

    Without an effect the components of the gradient in the Demmler-Reinsch basis are independent and normal.
    The fall of chi2 in the first k directions is then exactly chi2-distributed. A few values of k are tested;
    the smallest p-value counts, times their number (Bonferroni).

    Returns
    -------
    p : float
    fall : float
        Of chi2, by those directions.
    number : int
        Of directions.
    """
    d = directions(score, roughness)
    seen = d.information > _SEEN
    z = np.where(seen, d.gradient**2 / np.maximum(d.information, 1e-300), 0.0)[seen]
    straight = int(seen[: d.straight].sum())
    falls = np.cumsum(z)
    numbers = sorted({min(straight + more, len(z)) for more in ORDERS} - {0})
    if not numbers:
        return 1.0, 0.0, 0
    by_chance = [float(chi_squared.sf(falls[n - 1], n)) for n in numbers]
    k = int(np.argmin(by_chance))
    return min(by_chance[k] * len(numbers), 1.0), float(falls[numbers[k] - 1]), numbers[k]
