"""Kinks in formulas: runs land on them, and derivatives pass through them."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd import _core
from udd.errors import ModelError


def chua() -> udd.Model:
    """Chua's circuit with its double scroll (Matsumoto, Chua and Komuro, IEEE Trans. CAS 32 (1985) 797)."""
    return udd.Model(
        ["x", "y", "z"],
        ["a*(y - x - (m1*x + (m0 - m1)/2*(abs(x + 1) - abs(x - 1))))", "x - y + z", "-b*y"],
        {"a": 9.0, "b": 100 / 7, "m0": -8 / 7, "m1": -5 / 7},
    )


STARTS = {
    "abs": (udd.Model(["x", "v"], ["v", "abs(x)/2 - 2*x + cos(t)"]), "x"),
    "min": (udd.Model(["x", "v"], ["v", "-2*x + min(v, x)/2 + cos(t)"]), "v - x"),
    "max": (udd.Model(["x", "v"], ["v", "-x - max(v/2, x) + cos(t)"]), "v/2 - x"),
    "sign": (udd.Model(["x", "v"], ["v", "-sign(x) - 0.1*v + cos(t)"]), "x"),
    "where": (udd.Model(["x", "v"], ["v", "where(x < 0.2, -x, -3*x) + cos(t)"]), "x - 0.2"),
    "nested": (udd.Model(["x", "v"], ["v", "-abs(abs(x) - 0.5) - x + cos(t)"]), "x"),
}


@pytest.mark.parametrize("name", STARTS)
def test_all_methods_land_on_the_kinks(name: str) -> None:
    model, surface = STARTS[name]
    assert _core.has_series(model)
    runs = {
        method: udd.simulate(model, np.linspace(0, 15, 31), [1.0, 0.2], method=method, rtol=1e-11, atol=1e-13)
        for method in ("taylor", "dop853", "dopri5", "rodas", "auto")
    }
    best = runs["taylor"]
    assert len(best.events) > 3
    for run in runs.values():
        assert run.events.kind == best.events.kind
        np.testing.assert_allclose(run.state, best.state, atol=1e-8)
        np.testing.assert_allclose(run.events.t, best.events.t, atol=1e-8)
    # On the surface to 1e-12 of its size.
    values = {"t": best.events.t, "x": best.events.state[:, 0], "v": best.events.state[:, 1], "abs": np.abs}
    off = np.abs(eval(surface, values))
    own = off if name != "nested" else np.minimum(off, np.abs(off - 0.5))
    assert own.max() < 1e-11
    assert set(best.events.kind) == {"jump" if name in ("sign", "where") else "kink"}


@pytest.mark.parametrize("name", STARTS)
def test_derivatives_pass_through_the_kinks(name: str) -> None:
    model, _ = STARTS[name]
    start, by = np.array([1.0, 0.2]), 1e-6
    pieces = _core.shoot(model, np.zeros((1, 0)), start[None], np.zeros(1), np.full(1, 6.0), [], 1e-12, 1e-14)

    def end(x: np.ndarray) -> np.ndarray:
        return udd.simulate(model, [0, 6], x, method="dop853", rtol=1e-13, atol=1e-15).state[-1]

    apart = [(end(start + by * e) - end(start - by * e)) / (2 * by) for e in np.eye(2)]
    # Central differences of runs to 1e-13 over 2e-6.
    np.testing.assert_allclose(pieces["by_state"][0], np.transpose(apart), atol=3e-6)


def test_more_kinks_than_surfaces_are_compared() -> None:
    text = " + ".join(f"abs(x - {k / 10})" for k in range(8))
    model = udd.Model(["x"], [f"cos(3*t) - ({text})/8"])
    assert not _core.has_series(model)
    ends = [udd.simulate(model, [0, 5], [0.3], method=method).state[-1, 0] for method in ("auto", "dopri5")]
    # Steps over a kink are rejected until they are short, not short enough for the tolerance's sake.
    np.testing.assert_allclose(*ends, rtol=1e-6)


def test_the_spectrum_of_chuas_circuit() -> None:
    spectrum = udd.lyapunov_spectrum(chua(), state0=[0.1, 0.0, 0.0], t=400.0, tol=0.1)
    # A flow has one that vanishes; the largest was 0.326 +- 0.004 by the core without kinks (8 s).
    assert abs(spectrum.exponents[1]) < 0.02
    assert 0.1 < spectrum.exponents[0] < 0.5


def test_values() -> None:
    model = udd.Model(["x", "v"], ["min(x, v) + 10*max(x, v)", "where(x >= v, 1, 2) + 10*sign(x)"])
    states = np.array([[1.0, 2.0], [2.0, 1.0], [-3.0, 0.5]])
    np.testing.assert_array_equal(model.rates(0.0, states), [[21, 12], [21, 11], [2, -8]])


def test_sympys_kinks_are_ours() -> None:
    sympy = pytest.importorskip("sympy", reason="SymPy is not a dependency")

    x, v = sympy.symbols("x v")
    cases = sympy.Piecewise((1, x > 1), (v, x <= -1), (x * v, True))
    model = udd.Model(["x", "v"], [sympy.Min(x, v, 0) + 2 * sympy.Max(x, v), cases + sympy.sign(v)])
    states = np.array([[2.0, -1.0], [-2.0, 3.0], [0.5, 3.0]])
    np.testing.assert_array_equal(model.rates(0.0, states), [[3, 0], [4, 4], [6, 2.5]])
    with pytest.raises(ModelError, match="one inequality for each case"):
        udd.Model(["x"], [sympy.Piecewise((1, x > 1))])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("min(x)", "needs two numbers after min"),
        ("where(x, 1, 2)", "needs a comparison"),
        ("where(x > 0, 1)", "needs a comparison and two numbers"),
        ("x > 0", "has > where an operator is needed"),
    ],
)
def test_what_cannot_be_used_is_named(text: str, named: str) -> None:
    with pytest.raises(ModelError, match=named):
        udd.Model(["x"], [text])
