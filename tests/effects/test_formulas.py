"""Effects as formulas and curves: what they compute, and what they refuse."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
from udd import effects
from udd.effects import Effect, curve, formula, serialization, surface
from udd.errors import ModelError
from udd.models.serialization import model_from_dict, model_to_dict

X = np.random.default_rng(2).normal(size=(50, 4)) * [5.0, 0.03, 0.03, 3.0]
T = np.linspace(0.0, 5.0, 50)


@pytest.mark.parametrize(
    ("library", "own"),
    [
        (effects.quadratic_drag(c=1e-3), formula("torque", "-c*abs(Omega)*Omega", c=1e-3)),
        (
            effects.coulomb(c=1e-3),
            formula("torque", "-c*tanh(Omega/eps)", amplitudes=["c"], c=1e-3, eps=0.05),
        ),
        (effects.radial_friction(c=0.1), formula("friction", "c*(Y^2 + Z^2)", c=0.1)),
        (effects.relaxation(b=5.0), formula("vertical", "-b*W*Z", momentum="constraint", b=5.0)),
        (effects.slip(c=0.3, momentum="consistent"), formula("vertical", "-c*Z", c=0.3)),
        (
            effects.drive_ripple(a=0.1, b=0.2, f=1.3),
            formula(
                "vertical", "W*(a*cos(w*t) + b*sin(w*t))", amplitudes=["a", "b"], a=0.1, b=0.2, w=2.6 * np.pi
            ),
        ),
    ],
    ids=lambda effect: effect.name,
)
def test_a_formula_acts_as_the_librarys_effect_does(library: Effect, own: Effect) -> None:
    wanted, result = (udd.Disk(0.05, effects=[effect]).rates(T, X) for effect in (library, own))
    # Roundings of the same sums in another order.
    np.testing.assert_allclose(result, wanted, rtol=1e-12, atol=1e-13)


def test_a_formula_goes_wherever_an_effect_goes() -> None:
    def warped(a: float) -> effects.Effect:
        given = {"amplitudes": ["a"], "ranges": {"n": (1, 9)}, "name": "warp", "title": "a warp"}
        return formula("torque", "a*sin(n*beta)", **given, a=a, n=2)

    warp = warped(0.01)
    disk = udd.Disk(0.039, effects=[effects.slip(c=0.1), warp, curve("lateral", "Z", -0.1, 0.1, [0.0] * 5)])
    assert list(disk.parameters)[6:9] == ["slip.c", "warp.a", "warp.n"]
    assert (warp.title, warp.equation, warp.amplitudes, warp.slots) == (
        "a warp",
        "torque = a*sin(n*beta)",
        ("a",),
        ("torque",),
    )
    assert disk.effects[2].momentum == "consistent" and disk.units["curve.c4"] == "m/s"
    changed = disk.with_parameters({"warp.a": 0.5, "curve.c0": 1.0})
    assert changed.effects[1] == warped(0.5)
    with pytest.raises(ModelError, match="n of warp must be between 1 and 9"):
        disk.with_parameters({"warp.n": 10.0})
    for model in (disk, changed):
        assert eval(repr(model), {**vars(effects), "slip": effects.slip, "Disk": udd.Disk}) == model
        assert pickle.loads(pickle.dumps(model)) == model and hash(model) == hash(copy.deepcopy(model))
        assert model_from_dict(json.loads(json.dumps(model_to_dict(model)))) == model
    # One pendulum and one name serve too.
    drag = formula("torque", "-c*Omega^3", c=0.1)
    each, library = (
        udd.Pendulum(0.5, effects=e).rates(0.0, X[:, :2]) for e in (drag, effects.cubic_drag(c=0.1))
    )
    np.testing.assert_allclose(each, library, rtol=1e-12)


def test_a_run_with_a_formula_is_that_with_the_librarys_effect() -> None:
    start, end = [1.0, 0.01, -0.02, 0.3], 3.0
    library = effects.relaxation(b=3.0, momentum="consistent"), effects.quadratic_drag(c=1e-3)
    each = formula("vertical", "-b*W*Z", name="own", b=3.0), formula("torque", "-c*abs(Omega)*Omega", c=1e-3)
    for method in ("dopri5", "taylor"):
        runs = [udd.simulate(udd.Disk(0.05, effects=e), end, start, method=method) for e in (library, each)]
        # The same steps but for roundings, which chaos lets grow over 3 s by less than a thousand.
        np.testing.assert_allclose(runs[0].state[-1], runs[1].state[-1], rtol=1e-9, atol=1e-11)
        assert runs[0].events.kind == runs[1].events.kind and len(runs[0].events) > 3


def torque_of(effect: Effect, states: np.ndarray) -> np.ndarray:
    """Compute an effect's contribution to the torque."""
    disk = udd.Disk(0.039)
    change = disk.with_effects([effect]).rates(0.0, states) - disk.rates(0.0, states)
    return change[:, 0] * (0.08**2 / 2 + states[:, 1] ** 2 + states[:, 2] ** 2)


def test_a_curve_is_the_spline_with_these_coefficients() -> None:
    from scipy.interpolate import BSpline

    coefficients = np.random.default_rng(3).normal(size=9)
    bend = curve("torque", "Y", -0.05, 0.07, coefficients)
    spline = BSpline(-0.05 + 0.02 * np.arange(-3, 10), coefficients, 3)
    y = np.linspace(-0.07, 0.09, 101)
    wanted = spline(np.clip(y, -0.05, 0.07))
    # Numbers of order one, over an inertia of 0.003 and beside a rate of 200.
    torque = torque_of(bend, np.stack([0 * y, y, 0 * y, 0 * y], axis=-1))
    np.testing.assert_allclose(torque, wanted, atol=1e-11)
    np.testing.assert_allclose(bend.spec.basis(y) @ coefficients, wanted, atol=1e-13)  # type: ignore[attr-defined]
    assert bend.expression.count("s(") == 8
    # The same by its bumps, within.
    bumps = " + ".join(f"c{i}*bspline((Y + 0.05)/0.02 + 1 - {i})" for i in range(9))
    given = {f"c{i}": c for i, c in enumerate(coefficients)}
    within = (y > -0.05) & (y < 0.07)
    other = torque_of(formula("torque", bumps, **given), np.stack([0 * y, y, 0 * y, 0 * y], axis=-1))
    np.testing.assert_allclose(other[within], wanted[within], atol=1e-11)
    run = udd.simulate(udd.Disk(0.039, effects=bend), 0.1, [1.0, 0.01, 0.0, 0.0], method="auto")
    assert run.outcome == "finished"


def test_a_periodic_curve_begins_anew() -> None:
    from scipy.interpolate import BSpline

    coefficients = np.random.default_rng(4).normal(size=7)
    uneven = curve("torque", "beta", 0.0, 2 * np.pi, coefficients, periodic=True, name="uneven")
    spline = BSpline(2 * np.pi / 7 * np.arange(-3, 11), np.append(coefficients, coefficients[:3]), 3)
    beta = np.linspace(-20.0, 20.0, 203)
    states = np.stack([0 * beta, 0.02 + 0 * beta, 0 * beta, beta], axis=-1)
    wanted = spline(np.mod(beta, 2 * np.pi))
    np.testing.assert_allclose(torque_of(uneven, states), wanted, atol=1e-11)
    np.testing.assert_allclose(uneven.spec.basis(beta) @ coefficients, wanted, atol=1e-12)  # type: ignore[attr-defined]
    assert eval(repr(uneven), vars(effects)) == uneven


def test_a_surface_is_the_product_of_splines() -> None:
    from scipy.interpolate import BSpline

    grid = np.random.default_rng(5).normal(size=(5, 6))
    bent = surface("torque", ("Y", "beta"), (-0.05, 0.0), (0.07, 2 * np.pi), grid, periodic=True, name="bent")
    y, beta = np.random.default_rng(6).uniform((-0.05, -20.0), (0.07, 20.0), (100, 2)).T
    across = BSpline(-0.05 + 0.06 * np.arange(-3, 6), np.eye(5), 3)(y)
    round_ = BSpline(2 * np.pi / 6 * np.arange(-3, 10), np.vstack([np.eye(6), np.eye(6)[:3]]), 3)
    wanted = np.einsum("ni,ij,nj->n", across, grid, round_(np.mod(beta, 2 * np.pi)))
    states = np.stack([0 * y, y, 0 * y, beta], axis=-1)
    np.testing.assert_allclose(torque_of(bent, states), wanted, atol=1e-11)
    assert eval(repr(bent), vars(effects)) == bent
    assert serialization.from_dict(json.loads(json.dumps(serialization.to_dict(bent)))) == bent
    # It keeps its value beyond the second coordinate's end, and fades beyond the first's.
    flat = surface("torque", ("Y", "Z"), (-0.05, -0.05), (0.05, 0.05), np.ones((4, 4)))
    ends = np.array([[0.0, 0.02, 0.07, 0.0], [0.0, 0.36, 0.0, 0.0]])
    np.testing.assert_allclose(torque_of(flat, ends), [1.0, 0.0], atol=1e-11)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: formula("torque", "q*Z"), 'the formula "q*Z" has the unknown name q'),
        (lambda: formula("torque", "c*__import__('os')", c=1.0), "has the unknown name __import__"),
        (lambda: formula("torque", "sin(c*Z)", c=1.0), "not proportional to c"),
        (lambda: formula("tork", "c", c=1.0), "the slot must be one of torque, friction, lateral, vertical"),
        (lambda: formula("torque", "c*Z", c=1.0, d=2.0), "does not use its parameter d"),
        (lambda: formula("torque", "c*Z", c=np.nan), "c of formula must be finite"),
        (lambda: formula("torque", "c*Z", c=1.0, momentum="consistent"), "must be left out"),
        (
            lambda: formula("vertical", "c*Z", c=1.0, momentum="none"),
            "momentum of formula must be 'consistent'",
        ),
        (lambda: formula("torque", "c*Z", c=1.0, name="slip"), "give the formula another name"),
        (lambda: formula("torque", "c*Z", c=1.0, name="a b"), "must be a single word"),
        (lambda: formula("torque", "c*Z", c=1.0, amplitudes="c"), "amplitudes must be a list"),
        (lambda: formula("torque", "c*Z", c=1.0, amplitudes=["d"]), "formula has no parameter 'd'"),
        (lambda: formula("torque", "c*Z", c=1.0, ranges={"c": (1, 0)}), "must be (low, high)"),
        (lambda: formula("torque", "c*Z", c=2.0, ranges={"c": (0, 1)}), "must be between 0 and 1"),
        (lambda: formula("torque", ["c"], c=2.0), "the formula must be text or a SymPy expression"),
        (lambda: udd.Pendulum(0.5, effects=formula("vertical", "c*Z", c=1.0)), "acts on a disk, not on a"),
        (lambda: udd.Disk(0.1, effects=formula("torque", "c*theta", c=1.0)), "acts on a pendulum, not on a"),
        (lambda: curve("torque", "q", 0, 1, [1, 2, 3, 4]), "unknown name q"),
        (lambda: curve("torque", 1j, 0, 1, [1, 2, 3, 4]), "the coordinate must be text or a SymPy"),
        (lambda: formula("torque", "spline(Z, 0, 1, a, b)", a=1.0, b=2.0), "needs spline(x, low, high, c0"),
        (lambda: curve("torque", "Z", 1, 0, [1, 2, 3, 4]), "high must be above 1"),
        (lambda: curve("torque", "Z", 0, 1, [1, 2, 3]), "at least four coefficients"),
        (lambda: surface("torque", ("Y", "Z"), (0, 0), (1, 1), np.ones((3, 4))), "at least four along each"),
        (lambda: surface("torque", "YZ", (0, 0), (1, 1), np.ones((4, 4))), "needs two coordinates"),
        (lambda: surface("torque", ("Y", "Z"), (0, 1), (1, 0), np.ones((4, 4))), "high must be above 1"),
    ],
)
def test_an_effect_that_cannot_be_used_is_named(make: Callable[[], object], named: str) -> None:
    with pytest.raises(ModelError) as caught:
        make()
    message = str(caught.value)
    assert named in message and "\n" not in message and len(message) < 400


def test_a_fit_finds_a_formulas_numbers_as_the_librarys_effects() -> None:
    t = np.arange(0.0, 20.0, 0.05)
    truth = udd.Pendulum(1.0, k0=0.01, effects=effects.quadratic_drag(c=0.05))
    theta = udd.simulate(truth, t, [0.0, 1.5]).state[:, 1]
    seen = udd.Measurement(t, theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t)))
    free = ["k0"]
    library, each = (
        udd.fit(seen, udd.Pendulum(1.0, k0=0.01, effects=effect), free=[*free, f"{effect.name}.c"])
        for effect in (effects.quadratic_drag(), formula("torque", "-c*abs(Omega)*Omega", name="own", c=0.0))
    )
    # The same problem, solved to a part in 1e6 of the errors or so.
    for a, b in zip(library.parameters.values(), each.parameters.values(), strict=True):
        assert a == pytest.approx(b, rel=1e-5)
    assert abs(each.parameters["own.c"] - 0.05) < 4.0 * each.errors["own.c"]
    # A curve over the speed takes the place of both frictions.
    bend = curve("torque", "Omega", -4.5, 4.5, np.zeros(8))
    # The pivot is known here: were it not, an even torque could be its fault.
    free = [f"curve.{c}" for c in bend.amplitudes]
    result = udd.fit(seen, udd.Pendulum(1.0, effects=bend), free=free, camera=["theta0"])
    speed = np.linspace(-3.0, 3.0, 7)
    basis = bend.spec.basis(speed)  # type: ignore[attr-defined]
    order = list(result.parameters)
    coefficients = np.array(list(result.parameters.values()))
    places = [order.index(f"curve.{c}") for c in bend.amplitudes]
    covariance = result.covariance[np.ix_(places, places)]
    error = np.sqrt(np.einsum("ki,ij,kj->k", basis, covariance, basis))
    wanted = -0.01 * speed - 0.05 * np.abs(speed) * speed
    # That a spline bends where the drag's curvature jumps is less than the error.
    assert (np.abs(basis @ coefficients[places] - wanted) < 4.0 * error).all() and (error < 0.02).all()


@pytest.mark.parametrize("kind", ["curve", "surface", "formula"])
def test_a_key_that_an_effect_does_not_have_is_told_with_those_it_has(kind: str) -> None:
    with pytest.raises(udd.UddError, match=rf"a {kind} has no 'slto'; it has slot, .*momentum"):
        serialization.from_dict({kind: {"slto": "torque"}})
    with pytest.raises(udd.UddError) as error:
        serialization.from_dict({kind: {"x" * 5000: 1}})
    assert len(str(error.value)) < 300


def constants(text: str, b: float) -> dict[str, float]:
    return {"b": b, "n": 0.5} if "^n" in text else {"b": b}


@pytest.mark.parametrize(
    "text", ["-b*Omega*sqrt(abs(Omega))", "-b*Omega*abs(Omega)^n", "-b*sqrt(4*speed)*Omega/2"]
)
@pytest.mark.parametrize("method", ["dopri5", "dop853", "auto"])
def test_a_root_of_the_speed_is_crossed(text: str, method: str) -> None:
    # Beyond its kink the speed of a step's side is negative, and the step used to shrink to nothing.
    drag = formula("torque", text, amplitudes=["b"], **constants(text, 0.01))
    pendulum, t = udd.Pendulum(0.5, k0=0.01, effects=[drag]), np.arange(0.0, 20.0, 0.02)

    def rates(_t: float, s: np.ndarray) -> list[float]:
        return [(-9.81 * 0.5 * np.sin(s[1]) - 0.01 * (1 + abs(s[0]) ** 0.5) * s[0]) / 0.25, s[0]]

    exact = solve_ivp(rates, (0.0, 20.0), [0.0, 1.0], "DOP853", t, rtol=1e-11, atol=1e-13)
    run = udd.simulate(pendulum, t, [0.0, 1.0], method=method)
    np.testing.assert_allclose(run.state, exact.y.T, atol=1e-6)


@pytest.mark.parametrize("text", ["-b*v*sqrt(abs(v))", "-b*v*abs(v)^n"])
def test_a_law_with_a_root_of_the_speed_is_fitted(text: str) -> None:
    # A step ends on the root's zero, where its slope is infinite: times zero that was no number.
    t, noise = np.arange(0.0, 40.0, 0.04), 2e-3 * np.random.default_rng(1).standard_normal(1000)

    def own(b: float) -> udd.Model:
        return udd.Model(["x", "v"], ["v", f"-x - 0.02*v {text}"], constants(text, b))

    x = udd.simulate(own(0.02), t, [1.0, 0.0]).state[:, 0]
    result = udd.fit(udd.Measurement(t, {"x": x + noise}), own(0.03), free=["b"])
    assert abs(result.parameters["b"] - 0.02) < 4 * result.errors["b"]
    drag = formula("torque", text.replace("v", "Omega"), amplitudes=["b"], **constants(text, 0.01))
    pendulum = udd.Pendulum(0.5, k0=0.01, effects=[drag])
    theta = udd.simulate(pendulum, t, [0.0, 1.0]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + noise})
    start = pendulum.with_parameters({"formula.b": 0.02})
    result = udd.fit(measured, start, free=["formula.b"], camera=False)
    assert abs(result.parameters["formula.b"] - 0.01) < 4 * result.errors["formula.b"]
