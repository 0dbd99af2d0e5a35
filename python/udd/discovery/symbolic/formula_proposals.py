"""Formula proposals for a curve: common forms, and symbolic regression."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from udd.discovery.nonparametric.curve_scan import Curve

from .expressions import Node, X, constants, read, scaled, simplify

Array = NDArray[np.float64]

_PLACES = 160  # places of the curve that the regression uses
_SURE = 1e-3  # share of the largest error: lower limit of the errors


def usual(curve: Curve) -> Iterator[tuple[Node, list[float]]]:
    """Yield common forms, each from a few starts, with and without a constant."""
    spline, x = curve.splines[0], curve.places[0]
    size = float(np.abs(curve.values(np.quantile(x, np.linspace(0.02, 0.98, 50)))).max()) or 1.0
    low, high = (0.0, 2 * np.pi) if spline.periodic else np.quantile(x, (0.01, 0.99))
    span, most = float(high - low), float(np.abs((low, high)).max())
    # Each with the value of n, a literal.
    forms: list[tuple[str, float]] = []
    if spline.periodic:
        forms += [(f"{size} * sin(n * x) + {size} * cos(n * x)", float(n)) for n in range(1, 11)]
        forms += [(f"{size} * exp(2.0 * cos(x - {low + span * k / 6}))", 0.0) for k in range(6)]
    else:
        powers = [f"{size / most**n} * x^{n}" for n in (1, 2, 3)]
        texts = [*powers, f"{powers[0]} + {powers[1]}", f"{powers[0]} + {powers[2]}", " + ".join(powers)]
        texts += [f"{size / most} * abs(x)", f"{size / most**2} * x * abs(x)"]
        texts += [f"{size / most**p} * abs(x)^{p}" for p in (0.5, 1.5, 2.5)]
        texts += [f"{size / most ** (1 + p)} * x * abs(x)^{p}" for p in (0.5, 1.5)]
        texts += [f"{size} * exp({b / span} * x)" for b in (-2.0, 2.0)]
        for share, width in itertools.product((0.2, 0.5, 0.8), (0.05, 0.15)):
            centre, w = low + share * span, width * span
            texts += [
                f"{size} * tanh((x - {centre}) * {1 / w})",
                f"{size} * exp(n * ((x - {centre}) * {1 / w})^2)",
            ]
        if curve.coordinates[0].angle:
            texts += [f"{size} * sin({b} * x)" for b in (1.0, 2.0, 3.0)]
        forms += [(text, -1.0) for text in texts]
    for (text, n), constant in itertools.product(forms, ("", f" + {size}")):
        yield read(text + constant, {"x": X, "n": ("n", n)})
    if not spline.periodic:
        for share in (0.2, 0.4, 0.6):  # zero below a threshold, then proportional
            yield ("*", ("c", 0), ("ramp", ("-", X, ("c", 1)))), [size / span, float(low) + share * span]


def powers(curve: Curve) -> Iterator[tuple[Node, list[float]]]:
    """Yield a power of the coordinate's size, from several exponents."""
    x = curve.places[0]
    size = float(np.abs(curve.values(np.quantile(x, (0.1, 0.5, 0.9)))).max()) or 1.0
    most = float(np.abs(np.quantile(x, (0.01, 0.99))).max()) or 1.0
    for exponent in (0.3, 0.7, 1.0, 1.5, 2.0):
        yield read(f"{size / most**exponent} * abs(x)^{exponent}", {"x": X})


def regression(curve: Curve, most: int, seed: int) -> list[tuple[Node, list[float]]]:
    """Run symbolic regression with at most `most` constants; the list is empty without pyoperon."""
    if curve.splines[0].periodic:
        return []  # a formula of an angle must be periodic, as waves and bumps are
    try:
        from pyoperon.sklearn import SymbolicRegressor
    except ImportError:
        return []
    x = _sample(curve)
    y = curve.values(x)
    wide, size = float(np.abs(x).max()), float(y.std())
    if size == 0.0:
        return []
    regressor = SymbolicRegressor(
        allowed_symbols="add,sub,mul,div,exp,tanh,sin,abs,square,constant,variable",
        objectives=["mse", "length"],
        optimizer_iterations=10,
        max_length=16,
        population_size=300,
        generations=100,
        max_evaluations=60_000,
        uncertainty=[float(curve.errors(x).mean()) / size],
        n_threads=1,
        random_state=seed,
    )
    regressor.fit((x / wide)[:, None], y / size)
    result = []
    for individual in regressor.pareto_front_:
        text = regressor.get_model_string(individual["tree"], 8)
        try:
            node, values = read(text, {"X1": ("x",)})
        except ValueError:
            continue
        values.append(size)
        node = simplify(scaled(("*", ("c", len(values) - 1), node), wide, values), values)
        if 0 < len(constants(node)) <= most:
            result.append((node, values))
    return result


def _sample(curve: Curve) -> Array:
    """Sample places with a density that grows with the curve's precision, within the data."""
    low, high = np.quantile(curve.places[0], (0.002, 0.998))
    grid = np.linspace(low, high, 600)
    errors = curve.errors(grid)
    # The error would be zero if the known model can absorb all of the curve.
    weight = np.cumsum(1.0 / np.maximum(errors, (_SURE * errors.max()) or 1.0) ** 2)
    result: Array = np.interp((np.arange(_PLACES) + 0.5) / _PLACES, weight / weight[-1], grid)
    return result
