"""Models of the user's own: what they compute, and what they refuse."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import udd
from lorenz import lorenz
from udd import effects
from udd.effects import formula
from udd.errors import ModelError
from udd.models.serialization import model_from_dict, model_to_dict

X = np.random.default_rng(2).normal(size=(50, 4)) * [5.0, 0.03, 0.03, 3.0]


def double_pendulum() -> udd.Model:
    """Two equal rods without weight, equal masses, g = l = 1: angles and their rates."""
    d = "(a - b)"
    below = f"(3 - cos(2*{d}))"
    return udd.Model(
        ["a", "b", "p", "q"],
        {
            "a": "p",
            "b": "q",
            "p": f"(-3*g*sin(a) - g*sin(a - 2*b) - 2*sin{d}*(q^2 + p^2*cos{d}))/{below}",
            "q": f"2*sin{d}*(2*p^2 + 2*g*cos(a) + q^2*cos{d})/{below}",
        },
        {"g": 1.0},
        angles=["a", "b"],
    )


def driven_pendulum() -> udd.Model:
    return udd.Model(
        ["theta", "v"], ["v", "-sin(theta) - c*v + f*cos(w*t)"], {"c": 0.5, "f": 1.2, "w": 2 / 3}
    )


def test_a_model_as_text_has_the_rates_of_the_built_in_one() -> None:
    dle = udd.Model(
        ["omega", "y", "z"], ["y - omega", "omega*z", "w - omega*y - B*w*z"], {"w": 1.7, "B": 0.2}
    )
    np.testing.assert_array_equal(dle.rates(0.0, X[:, :3]), udd.DLE(1.7, 0.2).rates(0.0, X[:, :3]))
    disk = udd.Model(
        ["Omega", "Y", "Z", "beta"],
        {
            "Omega": "(g*Y - k*Omega - Z*W*Omega)/(R^2/2 + Y^2 + Z^2)",
            "Y": "Z*Omega",
            "Z": "-Y*Omega + W",
            "beta": "Omega",
        },
        {"W": 0.05, "R": 0.08, "g": 9.81, "k": 0.012},
        angles=["beta"],
    )
    built_in = udd.Disk(0.05, k0=0.012, k1=0.0, k2=0.0).rates(0.0, X)
    # Two sums in another order.
    np.testing.assert_allclose(disk.rates(0.0, X), built_in, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "taylor"])
@pytest.mark.parametrize(
    ("model", "start", "end"),
    [
        (lorenz(), [1.0, 1.0, 1.0], 5.0),
        (double_pendulum(), [1.5, 1.0, 0.0, 0.0], 10.0),
        (driven_pendulum(), [0.2, 0.0], 20.0),
        (udd.Model(["x"], ["r*x*(1 - x)"], {"r": 2.0}), [0.01], 5.0),
        (
            udd.Model(list("abcdef"), ["b - a", "c - b", "d - c", "e - d", "f - e", "sin(t) - f"]),
            [1.0, 0.0, 0.0, 0.0, 0.0, 2.0],
            5.0,
        ),
    ],
    ids=["lorenz", "double pendulum", "driven pendulum", "logistic", "chain"],
)
def test_runs_are_those_of_scipy(model: udd.Model, start: list[float], end: float, method: str) -> None:
    from scipy.integrate import solve_ivp

    run = udd.simulate(model, end, start, method=method, rtol=1e-11, atol=1e-13)
    other = solve_ivp(model.rates, (0.0, end), start, method="DOP853", rtol=1e-12, atol=1e-14)
    # Errors of 1e-11 a step, which Lorenz's equations amplify by e^5 or so.
    np.testing.assert_allclose(run.state[-1], other.y[:, -1], rtol=2e-8, atol=2e-8)


def test_the_double_pendulum_keeps_its_energy() -> None:
    run = udd.simulate(
        double_pendulum(), np.linspace(0, 100, 201), [2.0, 2.5, 0.0, 0.0], rtol=1e-13, method="taylor"
    )
    kinetic = run.p**2 + run.q**2 / 2 + run.p * run.q * np.cos(run.a - run.b)
    energy = kinetic - 2 * np.cos(run.a) - np.cos(run.b)
    # Over some thousand steps of 1e-13.
    np.testing.assert_allclose(energy, energy[0], atol=1e-11)


def test_a_force_enters_every_acceleration_through_the_mass_matrix() -> None:
    x = np.array([0.3, 1.2, -0.4, 0.7, -1.1, 2.0])
    mass = [
        ["3 + m", "m*cos(a - b)", "0.3"],
        ["m*cos(a - b)", "2", "0.4*sin(c)"],
        ["0.3", "0.4*sin(c)", "1 + c^2"],
    ]
    free = udd.Model(
        list("abcpqr"), ["p", "q", "r", "0", "0", "-c"], {"m": 0.8}, angles=["a", "b"], mass=mass
    )
    m = np.array(
        [
            [3.8, 0.8 * np.cos(x[0] - x[1]), 0.3],
            [0.8 * np.cos(x[0] - x[1]), 2.0, 0.4 * np.sin(x[2])],
            [0.3, 0.4 * np.sin(x[2]), 1 + x[2] ** 2],
        ]
    )
    assert free.speeds == {"a": "p", "b": "q", "c": "r"}
    np.testing.assert_allclose(free.mass_matrix(np.array([x, x]))[1], m, rtol=1e-15)
    # A force on b with its reaction on a, one along c, and a term of an equation without a mass.
    joint = effects.formula("force(b - a)", "-m*(q - p)", name="joint", m=0.5)
    push = effects.formula("force(c)", "f", name="push", f=2.0)
    added = free.with_effects([joint, push, effects.formula("q'", "d", name="plain", d=10.0)])
    torque = -0.5 * (x[4] - x[3])
    expected = np.linalg.solve(m, [-torque, torque, 2.0]) + np.array([0.0, 10.0, 0.0])
    np.testing.assert_allclose((added.rates(0.0, x) - free.rates(0.0, x))[3:], expected, rtol=1e-13)
    assert joint.expression == "force(b - a) = -0.5*(q - p)"
    for model in (free, added, added.with_parameters({"joint.m": 1.0}), free.with_term("p", "a", z=1.0)):
        assert model.mass == free.mass == tuple(map(tuple, mass))
        assert eval(repr(model), {"Model": udd.Model, "formula": effects.formula}) == model
        assert pickle.loads(pickle.dumps(model)) == model.replace() == model
        assert model_from_dict(json.loads(json.dumps(model_to_dict(model)))) == model
    assert "mass" not in model_to_dict(lorenz())


def test_own_models_are_values() -> None:
    model = lorenz()
    assert isinstance(model, udd.Model) and isinstance(udd.DLE(1.0), udd.Model)
    assert eval(repr(model), {"Model": udd.Model}) == model and hash(model) == hash(lorenz())
    assert eval(repr(double_pendulum()), {"Model": udd.Model}) == double_pendulum()
    for again in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model), copy.copy(model), model.replace()):
        assert again == model
        assert model_from_dict(json.loads(json.dumps(model_to_dict(again), sort_keys=True))) == model
    changed = model.with_parameters({"rho": 14.0})
    assert changed == lorenz(rho=14.0) == model.replace(rho=14.0) and changed != model
    assert changed.parameters["rho"] == 14.0 and list(model.units) == ["sigma", "rho", "beta"]
    assert model.replace(equations=["y", "z", "-x"], parameters={}).equations == {
        "x": "y",
        "y": "z",
        "z": "-x",
    }
    with pytest.raises(AttributeError):
        model.values = ()  # type: ignore[attr-defined]
    with pytest.raises(AttributeError):
        udd.simulate(model, 0.1, [1.0, 1.0, 1.0]).nonsense  # noqa: B018


def test_a_term_is_added_to_an_equation() -> None:
    model = lorenz()
    more = model.with_term("y", "x*z - 1", c=0.5)  # type: ignore[attr-defined]
    x = X[:, :3]
    wanted = model.rates(0.0, x)
    wanted[:, 1] += 0.5 * (x[:, 0] * x[:, 2] - 1)
    np.testing.assert_allclose(more.rates(0.0, x), wanted, rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(more.with_parameters({"c": 0.0}).rates(0.0, x), model.rates(0.0, x))
    assert list(more.parameters) == ["sigma", "rho", "beta", "c"]


def test_expressions_of_sympy_serve_as_text() -> None:
    sympy = pytest.importorskip("sympy", reason="SymPy is not a dependency")
    t = sympy.Symbol("t")
    x, v = sympy.Function("x")(t), sympy.Symbol("v")
    rate = (
        -sympy.sin(x)
        + sympy.Float("0.1") * sympy.Abs(v) ** 3
        - sympy.exp(1) * sympy.sqrt(x**2 + sympy.Rational(1, 3))
    )
    model = udd.Model([x.func, v], {x.func: v, v: rate})
    states = np.random.default_rng(1).normal(size=(20, 2))
    a, b = states.T
    wanted = -np.sin(a) + 0.1 * np.abs(b) ** 3 - np.e * np.sqrt(a**2 + 1 / 3)
    np.testing.assert_allclose(model.rates(0.0, states)[:, 1], wanted, rtol=1e-13, atol=1e-14)
    with pytest.raises(ModelError, match="contains a derivative"):
        udd.Model(["x"], [x.diff(t)])
    c, z = sympy.symbols("c Z")
    each = formula("torque", c * sympy.tanh(z), c=0.1)
    np.testing.assert_array_equal(
        udd.Disk(0.1, effects=each).rates(0.0, X),
        udd.Disk(0.1, effects=formula("torque", "c*tanh(Z)", c=0.1)).rates(0.0, X),
    )


def cart(mass: Any) -> Any:
    return udd.Model(["x", "v"], ["v", "-x"], {"m": 2.0}, mass=mass)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: lorenz(rho=np.inf), "the parameter rho must be finite"),
        (
            lambda: udd.Model(["x"], {"x": "-q*x"}),
            "the equation of x has the unknown name q; allowed are the state x",
        ),
        (lambda: udd.Model(["x", "y"], {"x": "y"}), "the state y has no equation"),
        (lambda: udd.Model(["x"], {"x": "1", "z": "2"}), "there is an equation of 'z'"),
        (lambda: udd.Model(["x", "y"], ["y"]), "2 states but 1 equations"),
        (lambda: udd.Model(["x"], "x"), "equations must be a table or a list"),
        (lambda: udd.Model(["x"], [None]), "the equation of x must be text"),
        (lambda: udd.Model(["x"], ["x' - 1"]), "may not use rates"),
        (lambda: udd.Model(["x"], ["x = 1"]), "has =, but only the right-hand side"),
        (lambda: udd.Model([], []), "a model has 1 to 12 states, not 0"),
        (lambda: udd.Model(list("abcdefghijklm"), ["1"] * 13), "a model has 1 to 12 states, not 13"),
        (lambda: udd.Model("xy", ["1", "2"]), "states must be a list of names"),
        (lambda: udd.Model(["x", "x"], ["1", "2"]), "the name x is given twice"),
        (lambda: udd.Model(["x"], ["x"], {"x": 1.0}), "the name x is given twice"),
        (lambda: udd.Model(["t"], ["1"]), "a state cannot be called t"),
        (lambda: udd.Model(["x"], ["sin*x"], {"sin": 1.0}), "a parameter cannot be called sin"),
        (lambda: udd.Model(["x"], ["1"], {"a b": 1.0}), "must be a single word"),
        (lambda: udd.Model(["x"], ["1"], [1.0]), "parameters must be a table"),
        (lambda: udd.Model(["x"], ["1"], angles=["y"]), "the angle 'y' is no state"),
        (lambda: lorenz().with_parameters({"c": 1.0}), "has no parameter 'c'; it has sigma, rho, beta"),
        (lambda: lorenz().replace(w=1.0), "the model has no 'w'"),
        (lambda: lorenz().with_effects([effects.slip()]), "takes a term: with_term"),
        (lambda: cart([["1", "0"], ["0", "1"]]), "a row and a column for each of x"),
        (lambda: cart("m"), "a row and a column for each of x"),
        (lambda: cart([["-m"]]), "must be positive definite"),
        (lambda: cart([["k"]]), "the mass matrix has the unknown name k"),
        (
            lambda: udd.Model(list("xyvw"), ["v", "w", "-x", "-y"], mass=[["2", "x"], ["y", "2"]]),
            "must be symmetric",
        ),
        (lambda: lorenz().replace(mass=[["1"]]), "a mass matrix needs coordinates"),
        (lambda: lorenz().with_effects([effects.formula("force(x)", "c", c=1.0)]), "needs the model's mass"),
        (
            lambda: cart([["m"]]).with_effects([effects.formula("force(v)", "c", c=1.0)]),
            "acts along one of x",
        ),
        (lambda: cart([["m"]]).mass_matrix([1.0]), "must have 2 components"),
        (lambda: cart(None).mass_matrix([1.0, 2.0]), "was given no mass matrix"),
        (lambda: lorenz().with_term("w", "x", c=1.0), "there is no equation of 'w'"),
        (lambda: lorenz().with_term("x", "x"), "a term has one factor"),
        (lambda: lorenz().with_term("x", "x", rho=1.0), "has a parameter 'rho' already"),
        (lambda: lorenz().with_term("x", "q", c=1.0), "the equation of x has the unknown name q"),
        (lambda: udd.simulate(lorenz(), 1.0, [1.0, 2.0]), "state0 must have the 3 components x, y, z"),
        (
            lambda: udd.simulate(udd.Model(["x"], ["-bspline(x)"]), 1.0, [1.0], method="taylor"),
            "has a comparison",
        ),
    ],
)
def test_a_model_that_cannot_be_used_is_named(make: Callable[[], object], named: str) -> None:
    with pytest.raises(ModelError) as caught:
        make()
    message = str(caught.value)
    assert named in message and "\n" not in message and len(message) < 400


def test_auto_takes_another_method_where_there_is_no_series() -> None:
    model = udd.Model(["x"], ["-x + 0*bspline(x)"])
    run = udd.simulate(model, 1.0, [1.0], method="auto")
    # As exact as ten steps of 1e-9.
    assert run.state[-1, 0] == pytest.approx(np.exp(-1.0), abs=1e-8)


# --- analyses


def test_the_exponents_of_lorenz_are_the_known_ones() -> None:
    result = udd.lyapunov_spectrum(lorenz(), state0=[1.0, 1.0, 1.0], t=1000.0, tol=1.0)
    # Published: 0.9056, 0, -14.5723 (Sprott, Chaos and Time-Series Analysis, 2003); the errors are found.
    assert abs(result.exponents[0] - 0.9056) < 4.0 * result.standard_errors[0] < 0.5
    # The sum is minus the rate at which volumes shrink, everywhere the same.
    assert result.exponents.sum() == pytest.approx(-(10.0 + 1.0 + 8.0 / 3.0), abs=1e-6)
    assert result.verdict == "chaos"


def test_sections_and_ensembles_are_those_of_the_built_in_model() -> None:
    dle = udd.Model(["omega", "y", "z"], ["y - omega", "omega*z", "w - omega*y"], {"w": 2.0})
    start = [1.0, 1.0, 0.01]
    each, built_in = (udd.poincare(m, "z", 20, state0=start) for m in (dle, udd.DLE(2.0)))
    # Packets and single runs have the same bits, and so have the two laws.
    np.testing.assert_array_equal(each.state, built_in.state)
    t, starts = np.linspace(0, 5, 6), np.random.default_rng(1).normal(size=(5, 3))
    runs = [udd.ensemble(m, t, starts, method="dopri5").state for m in (dle, udd.DLE(2.0))]
    np.testing.assert_array_equal(*runs)
    maxima = udd.poincare(lorenz(), n=5, state0=[1.0, 1.0, 1.0])
    assert maxima.section == ("x'",)
    with pytest.raises(ModelError, match="a model of your own has no usual initial state"):
        udd.lyapunov(lorenz())


def test_both_wells_have_their_basin() -> None:
    pytest.importorskip("xarray", reason="the extra scale is not installed")
    wells = udd.Model(["x", "v"], ["v", "x - x^3 - c*v"], {"c": 0.3})
    result = udd.basins(wells, {"x": np.linspace(-1.5, 1.5, 6), "v": np.array([-0.5, 0.5])})
    # The law is odd, and so is the grid.
    np.testing.assert_allclose(result.fraction, [0.5, 0.5])
    np.testing.assert_allclose(np.sort(result.orbit_x.values.ravel()), [-1.0, 1.0], atol=1e-9)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "auto"])
@pytest.mark.parametrize(
    "law", ["-abs(u)^1.5*sign(u) - x", "-abs(u)^n*u - x", "-sqrt(abs(u)/2)*u - x", "-max(u, 0)^0.5 - x"]
)
def test_roots_of_kinks_are_crossed(law: str, method: Any) -> None:
    from scipy.integrate import solve_ivp

    model = udd.Model(["u", "x"], {"u": law, "x": "u"}, {"n": 0.5})
    run = udd.simulate(model, [0.0, 10.0], [1.0, 0.3], method=method)
    assert run.outcome == "finished"
    force: Callable[[float], float] = {
        "-abs(u)^1.5*sign(u) - x": lambda u: -(abs(u) ** 1.5) * np.sign(u),
        "-abs(u)^n*u - x": lambda u: -np.sqrt(abs(u)) * u,
        "-sqrt(abs(u)/2)*u - x": lambda u: -np.sqrt(abs(u) / 2) * u,
        "-max(u, 0)^0.5 - x": lambda u: -np.sqrt(max(u, 0.0)),
    }[law]
    exact = solve_ivp(lambda t, s: [force(s[0]) - s[1], s[0]], [0.0, 10.0], [1.0, 0.3], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(run.state[-1], exact.y[:, -1], atol=1e-6)
