"""PySINDy (2.1) as a peer, on Lorenz63 and on the disk.

It is used as its authors use it on noisy data: with smoothed derivatives or the weak form, and an ensemble of
bootstrapped sparse regressions. A term survives if it is in 60 % of them. The caller chooses thresholds and
windows on other records with a known truth, which a user could not do.
"""

from __future__ import annotations

import functools
import itertools
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import pysindy
from scipy.signal import savgol_filter

INCLUSION = 0.6  # Fasel et al. 2022, "Ensemble-SINDy"
MODELS = 20
DOMAINS = 300  # of the weak form; a few hundred per thousand samples


@dataclass(frozen=True)
class Settings:
    """Settings of PySINDy.

    `weak` is the half-width of the test functions, 0 for pointwise derivatives; `smooth` the window of a
    Savitzky-Golay filter of the third degree in samples, 0 for none; `constant` whether the library has one.
    """

    threshold: float
    weak: float
    smooth: int
    constant: bool = True
    models: int = 0

    def __str__(self) -> str:
        form = f"weak {self.weak:g}" if self.weak else "pointwise"
        return f"{form}, window {self.smooth}, threshold {self.threshold:g}"


def _grid(weak: tuple[float, ...], smooth: tuple[int, ...], **more: Any) -> list[Settings]:
    thresholds = (0.2, 0.4, 0.6, 0.8)
    return [Settings(t, w, s, **more) for t, w, s in itertools.product(thresholds, weak, smooth)]


#: Families of settings; without a constant, it has more knowledge than the protocol allows.
GRIDS = {
    "pointwise ensemble": _grid((0.0,), (11, 21, 31), models=MODELS),
    "weak": _grid((0.2, 0.4), (0, 21)),
    "weak ensemble": _grid((0.2, 0.4), (0, 21), models=MODELS),
    "weak ensemble, no constant in its library": _grid((0.2, 0.4), (0, 21), models=MODELS, constant=False),
}


def _kept(coefficients: list[np.ndarray]) -> np.ndarray:
    """The median of an ensemble's coefficients where enough of them are not zero."""
    result = np.array(coefficients)
    return np.where((result != 0).mean(axis=0) >= INCLUSION, np.median(result, axis=0), 0.0)


def _ensemble(optimizer: Any, models: int) -> Any:
    if not models:
        return optimizer
    return pysindy.EnsembleOptimizer(optimizer, bagging=True, n_models=models, ensemble_aggregator=_kept)


def _seed() -> None:
    """PySINDy draws from numpy's global generator: same record, same answer."""
    np.random.seed(0)  # noqa: NPY002


@functools.lru_cache(maxsize=8)
def _polynomials(times: bytes, weak: float, constant: bool) -> Any:
    library = pysindy.PolynomialLibrary(degree=2, include_bias=constant)
    if not weak:
        return library
    _seed()
    return pysindy.WeakPDELibrary(library, spatiotemporal_grid=np.frombuffer(times), K=DOMAINS, H_xt=weak)


def lorenz(t: np.ndarray, noisy: np.ndarray, settings: Settings) -> np.ndarray:
    """Coefficients (10, 3) of the monomials up to the second degree."""
    _seed()
    if settings.weak and settings.smooth:
        noisy = savgol_filter(noisy, settings.smooth, 3, axis=0)
    window = {"window_length": settings.smooth or 5, "polyorder": 3}
    model = pysindy.SINDy(
        optimizer=_ensemble(pysindy.STLSQ(threshold=settings.threshold), settings.models),
        feature_library=_polynomials(t.tobytes(), settings.weak, settings.constant),
        differentiation_method=pysindy.SmoothedFiniteDifference(smoother_kws=window),
    )
    with warnings.catch_warnings():  # that a threshold removes every term is an answer like any other
        warnings.simplefilter("ignore")
        model.fit(noisy, t=t)
    result = np.zeros((10, 3))
    result[0 if settings.constant else 1 :] = model.coefficients().T
    return result


@dataclass(frozen=True)
class Term:
    """A term that was found beyond the plain disk; the coefficient in SI units."""

    equation: str
    name: str
    coefficient: float


EQUATIONS = ("dOmega", "dY", "dZ")
SCALES = np.array([5.0, 0.03, 0.03])  # rad/s, m, m: one threshold serves every term
MONOMIALS = tuple(p for p in itertools.product(range(3), repeat=3) if sum(p) <= 2)
_TYPICAL = 5e-3  # m^2, the moment of inertia by which torques are scaled


def _name(powers: tuple[int, ...]) -> str:
    symbols = zip(("Omega", "Y", "Z"), powers, strict=True)
    return " ".join(s if n == 1 else f"{s}^{n}" for s, n in symbols if n) or "1"


def _monomial(powers: tuple[int, ...], device: Any, torque: bool) -> Any:
    a, b, c = powers

    def value(omega: Any, y: Any, z: Any) -> Any:
        product = omega**a * y**b * z**c + 0 * y
        return product * _TYPICAL / device.inertia(y * SCALES[1], z * SCALES[2]) if torque else product

    return value


def _known(device: Any, equation: int) -> Any:
    """The plain disk's rate of a scaled state, its device's numbers given."""

    def value(omega: Any, y: Any, z: Any) -> Any:
        o, y, z = omega * SCALES[0], y * SCALES[1], z * SCALES[2]
        if equation == 0:
            k = np.maximum(device.k1 - device.k2 * np.abs(o), device.k0)
            rate = (device.g * y - k * o - device.W * z * o) / device.inertia(y, z)
        else:
            rate = z * o if equation == 1 else device.W - y * o
        return rate / SCALES[equation]

    return value


def _library(device: Any) -> tuple[Any, np.ndarray, np.ndarray]:
    """The functions, and the constraints: what is known enters as it is, torques dOmega, speeds dY and dZ."""
    functions = [_known(device, e) for e in range(3)]
    functions += [_monomial(p, device, torque) for torque in (True, False) for p in MONOMIALS]
    n = len(MONOMIALS)
    free = np.zeros((3, 3 + 2 * n), dtype=bool)
    free[0, 3 : 3 + n] = free[1:, 3 + n :] = True
    fixed = np.flatnonzero(~free.ravel())
    left = np.zeros((len(fixed), free.size))
    left[np.arange(len(fixed)), fixed] = 1.0
    right = (np.eye(3, 3 + 2 * n).ravel())[fixed]
    # Interactions only and as many arguments as states: each function is one feature.
    library = pysindy.CustomLibrary(functions, [lambda *_s, i=i: f"f{i}" for i in range(len(functions))])
    return library, left, right


def disk(t: np.ndarray, seen: np.ndarray, device: Any, settings: Settings) -> list[Term]:
    """Terms beyond the plain disk in a record of Y, Z, beta (n, 3), the device's numbers known exactly.

    The angular velocity is the smoothed derivative of the angle. The threshold is that of the scaled
    coefficients, in 1/s.
    """
    _seed()
    seen = np.column_stack([np.interp(t, t[np.isfinite(c)], c[np.isfinite(c)]) for c in seen.T])
    window, dt = settings.smooth, float(t[1] - t[0])
    omega = savgol_filter(seen[:, 2], window, 3, deriv=1, delta=dt)
    states = np.column_stack([omega, seen[:, :2]]) / SCALES  # the weak form smooths these
    functions, left, right = _library(device)
    inner = pysindy.ConstrainedSR3(
        reg_weight_lam=settings.threshold**2 / 2,  # the l0 threshold is sqrt(2 lam nu)
        regularizer="l0",
        relax_coeff_nu=1.0,
        max_iter=200,
        constraint_lhs=left,
        constraint_rhs=right,
        equality_constraints=True,
    )
    grid = dt * np.arange(len(t))
    library = pysindy.WeakPDELibrary(functions, spatiotemporal_grid=grid, K=DOMAINS, H_xt=settings.weak)
    model = pysindy.SINDy(optimizer=_ensemble(inner, settings.models), feature_library=library)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(states, t=grid)
    result = np.asarray(model.coefficients())[:, 3:]
    terms = []
    for e, i in zip(*np.nonzero(result), strict=True):
        powers = MONOMIALS[i % len(MONOMIALS)]
        size = SCALES[e] / np.prod(SCALES ** np.array(powers)) * (_TYPICAL if e == 0 else 1.0)
        terms.append(Term(EQUATIONS[e], _name(powers), float(result[e, i] * size)))
    return terms
