"""The nonparametric scan on laws of no library, against an independent integrator; its parts one by one."""

from __future__ import annotations

import sys
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
import unmodelled
from udd import _core
from udd.discovery.curve_effects import fit_curve, fit_formula
from udd.discovery.nonparametric.bsplines import Spline, along, product, rough_product
from udd.discovery.nonparametric.confounding import confounded_directions, identifiable_part
from udd.discovery.nonparametric.curve_scan import refined, scan_curves
from udd.discovery.nonparametric.penalized_curves import chance, smooth
from udd.discovery.scoring.coordinates import coordinate, coordinates, slots
from udd.discovery.scoring.forcing import Score, responses, score_forcings
from udd.discovery.symbolic.expressions import evaluate, read, sensible, simplify, write
from udd.discovery.symbolic.formulas import Formula, _Target, formulas_for, power_for
from udd.errors import FitError, UddError
from udd.fitting import fit_record, record_of, with_larger_model_error
from udd.plot.curves import curve as draw

E = udd.effects
W = 0.045
#: Laws of `unmodelled` that show clearly at full size: evidences of 100 to 1000 nats remain.
SHARE = 0.25


def weak(case: unmodelled.Case, share: float = SHARE) -> unmodelled.Law:
    return lambda *at: tuple(share * v for v in case.law(*at))  # type: ignore[return-value]


@pytest.fixture(scope="module")
def null() -> udd.Fit:
    return udd.fit(unmodelled.record(None, 3, 40.0), udd.Disk(W))


@pytest.mark.parametrize("case", unmodelled.CASES, ids=lambda case: case.name)
def test_a_law_of_no_library_is_located_and_described(case):
    fit = udd.fit(unmodelled.record(weak(case), 5), udd.Disk(W))
    result = scan_curves(fit)
    best = result.curves[0]
    assert best.name in case.places
    assert (
        min(c.p for c in result.curves) * result.comparisons < 1e-4
    )  # a tenth of what a search takes to accept it
    # Friction over the speed has an infinite slope at rest, where it does nothing; its torque is smooth.
    curve = identifiable_part(refined(next(c for c in result.curves if c.name == case.places[0]), fit), fit)
    described = formulas_for(curve, int(np.isfinite(fit.misfit).sum()))
    assert described[0].nats > -10  # nats: as probable as the curve
    # Some formula within the ten nats is the law, nearly as closely as the curve is known where the data are.
    # The symbolic search depends on the processor's rounding: a grip loss is off by 2.8 with AVX2, by less
    # than 2 with AVX-512.
    x = np.quantile(curve.places[0], np.linspace(0.05, 0.95, 60))
    law = curve.aligned_with(SHARE * case.curve(x), x)
    off = [(curve.aligned_with(f.values(x), x) - law) / curve.errors(x) for f in described]
    assert min(np.sqrt(np.mean(z**2)) for z in off) < 3.5


# Seed 1 asks the same.
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_friction_by_the_load_is_located_over_the_load(seed):
    def law(t, o, y, z, b):
        return -0.5 * float(unmodelled.squeeze(unmodelled.load(o, y, z, W))) * o, 0.0, 0.0

    base = udd.fit(unmodelled.record(law, seed), udd.Disk(W))
    best, second = scan_curves(base).curves[:2]
    assert best.name == ("friction", "load")
    assert best.evidence > second.evidence + 20
    # The record starts anywhere; friction at rest is a part of k0, so only its increase is identifiable.
    low, high = best.values(np.array([-0.05, 0.25]))
    rise = 0.5 * np.subtract(*unmodelled.squeeze(np.array([0.25, -0.05])))
    assert high - low == pytest.approx(rise, rel=0.3)
    # The effect made of it is the curve over the load, and explains the record.
    located = fit_curve(base, best, "curve")
    assert located.effect.spec.slots == ("friction",) and located.fit.converged
    assert located.fit.evidence > base.evidence + 100


def test_the_load_is_the_same_in_formulas_and_for_each_film():
    x = np.random.default_rng(4).normal(0.0, [4.0, 0.02, 0.02, 3.0], (20, 4))
    for w in (0.02, 0.06):
        plain = udd.Disk(w)
        item = coordinate(plain, "load")
        baseline = [unmodelled.load(o, y, z, w) for o, y, z, _ in x]
        np.testing.assert_allclose(item.of(np.zeros(20), x), baseline, rtol=1e-12)
        rates = plain.rates(0.0, x)
        effect = E.formula("friction", f"a * ({item.text})", a=1e-3)
        (friction,) = (s for s in slots(plain) if s.title == "friction")
        made = friction.forcing(plain, x, 1e-3 * item.of(np.zeros(20), x), np.zeros(20))
        np.testing.assert_allclose(plain.with_effects([effect]).rates(0.0, x) - rates, made, atol=1e-9)
        # The text may be the base of a power.
        squared = plain.with_effects([E.formula("friction", f"a * {item.text}^2", a=1e-3)])
        made = friction.forcing(plain, x, 1e-3 * item.of(np.zeros(20), x) ** 2, np.zeros(20))
        np.testing.assert_allclose(squared.rates(0.0, x) - rates, made, atol=1e-9)


def test_films_at_two_drives_have_their_own_loads():
    films = [unmodelled.record(None, seed, 20.0, w) for seed, w in ((1, 0.045), (2, 0.06))]
    fit = udd.fit(films, [udd.Disk(0.045), udd.Disk(0.06)])
    result = responses(fit)
    values = result.along(coordinate(fit.model, "load"))
    for model, film in zip(fit.models, result.films, strict=True):
        each = [unmodelled.load(*state[:3], model.W) for state in result.states[film][:, 0]]
        # The constants are those fitted, which are the true ones to a few per cent.
        assert np.corrcoef(values[film][:, 0], each)[0, 1] > 0.99


def test_the_form_of_a_wave_is_named():
    case = next(c for c in unmodelled.CASES if c.name == "five waves")
    fit = udd.fit(unmodelled.record(weak(case), 6), udd.Disk(W))
    curve = scan_curves(fit).curves[0]
    (only,) = formulas_for(curve, 4500)
    assert only.text == "a * sin(5 * beta)"
    assert only.parameters["a"] == pytest.approx(SHARE * 0.02, rel=0.05)
    # Constants do not take the name of a state, as of a double pendulum's angles a and b.
    (only,) = formulas_for(curve, 4500, taken=["a", "b"])
    assert only.text == "c * sin(5 * beta)"


def test_the_form_of_a_bump_of_an_angle_is_named():
    law = lambda t, o, y, z, b: (0.05 * np.exp(2 * (np.cos(b - 1) - 1)), 0.0, 0.0)  # noqa: E731
    fit = udd.fit(unmodelled.record(law, 1, 40.0), udd.Disk(W))
    curve = scan_curves(fit).curves[0]
    assert curve.name == ("torque", "beta")
    only = formulas_for(curve, 4500)[0]
    assert only.text == "a * exp(b * cos(c + beta))"
    assert only.parameters["b"] == pytest.approx(2, rel=0.2)
    assert only.parameters["c"] == pytest.approx(-1, abs=0.1)
    # No power of an angle has the same value after a turn.
    assert power_for(curve, 4500) is None


def test_a_law_of_two_coordinates_is_located():
    law = lambda t, o, y, z, b: (6 * y * z, 0.0, 0.0)  # noqa: E731
    fit = udd.fit(unmodelled.record(law, 1), udd.Disk(W))
    assert scan_curves(fit, pairs=True).curves[0].name == ("torque", "Y", "Z")


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_nothing_is_located_where_nothing_is_missing(seed):
    result = scan_curves(udd.fit(unmodelled.record(None, seed, 40.0), udd.Disk(W)), pairs=True)
    assert min(c.p for c in result.curves) * result.comparisons > 1e-2
    assert result.curves[0].evidence < 0  # no curve is more likely than any


@pytest.mark.parametrize(
    ("case", "records"),
    [
        # Two records ask the same as twelve, but for the bump, whose share scatters too much.
        *(pytest.param(case, 2, id=case.name) for case in unmodelled.CASES if "bump" not in case.name),
        *(
            pytest.param(case, 12, id=f"{case.name} in 12", marks=pytest.mark.nightly)
            for case in unmodelled.CASES
        ),
    ],
)
def test_bands_hold_the_law(case, records):
    """Records at 0.4 of the law's size.

    A band of a smoothness prior holds its share of the curves that are as smooth everywhere; a bump is not,
    and is rounded off: hence 80 %. The three others measured 98 % and more. The share scatters by 12 % from
    record to record of the bump, by 2 % of the others: twelve records give its mean to 3 % and 1 %.
    """
    inside = []
    for seed in range(records):
        fit = udd.fit(unmodelled.record(weak(case, 0.4), seed), udd.Disk(W))
        only = scan_curves(fit, only=lambda slot, each: (slot.title, each[0].name) == case.places[0])
        curve = identifiable_part(refined(only.curves[0], fit), fit)
        places = curve.places[0]
        places = np.mod(places, 2 * np.pi) if curve.splines[0].periodic else places
        x = np.quantile(places, np.linspace(0.005, 0.995, 199))
        off = curve.values(x) - curve.aligned_with(0.4 * case.curve(x), x)
        inside.append(np.mean(np.abs(off) < 1.96 * curve.errors(x)))
    assert np.mean(inside) > (0.8 if "bump" in case.name else 0.9)


# The parts.


@pytest.mark.parametrize(
    ("effect", "slot", "name", "value"),
    [
        (E.relaxation(b=1.0), "vertical (constraint)", "Z", lambda z: -W * z),
        (E.relaxation(b=1.0, momentum="consistent"), "vertical (consistent)", "Z", lambda z: -W * z),
        (E.lateral_slip(c=1.0), "lateral (constraint)", "Y", None),
        (E.lateral_slip(c=1.0, momentum="consistent"), "lateral (consistent)", "Y", None),
        (E.quadratic_drag(c=1.0), "torque", "Omega", lambda o: -np.abs(o) * o),
        (E.quadratic_drag(c=1.0), "friction", "|Omega|", lambda o: o),
        (E.uneven_disk(a=1.0, b=0.0, n=3), "torque", "beta", lambda b: np.sin(3 * b)),
    ],
    ids=lambda v: v if isinstance(v, str) else getattr(v, "name", ""),
)
def test_slots_act_as_the_effects_of_the_library(effect, slot, name, value):
    """A curve with an effect's formula changes the rates as the effect does, to first order."""
    rng = np.random.default_rng(0)
    x = rng.normal(0, [4.0, 0.02, 0.02, 3.0], (50, 4))
    plain = udd.Disk(W)
    rates = plain.rates(0.0, x)
    small = 1e-6
    little = effect.replace(**{p: small * v for p, v in effect.parameters.items() if p in effect.amplitudes})
    expected = (plain.with_effects([little]).rates(0.0, x) - rates) / small
    each, where = next(s for s in slots(plain) if s.title == slot), coordinate(plain, name)
    at, step = where.of(np.zeros(50), x), 1e-6
    if value is None:
        value = lambda y: expected[:, 1] / at * y  # noqa: E731 (proportional, whatever the sign)
    speed = (value(at + step) - value(at - step)) / (2 * step) * where.rate(x, rates)
    made = each.forcing(plain, x, value(at), speed)
    np.testing.assert_allclose(made, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())


def test_forcings_score_as_the_effects_of_the_library(null):
    """From the flow's response, by quadrature, what the core finds by integrating with the effect."""
    result = responses(null)
    each = {s.title: s for s in slots(null.model)}
    z, o = result.states[..., 2], result.states[..., 0]
    v = result.rates
    columns = [
        result.columns(each["vertical (constraint)"], (-null.model.W * z)[..., None], v[..., 2:3]),
        result.columns(
            each["vertical (consistent)"],
            (-null.model.W * z)[..., None],
            (-null.model.W * v[..., 2])[..., None],
        ),
        result.columns(each["torque"], (-np.abs(o) * o)[..., None], v[..., :1]),
    ]
    scores = score_forcings(null, columns)
    effects = [E.relaxation(b=0.0), E.relaxation(b=0.0, momentum="consistent"), E.quadratic_drag(c=0.0)]
    for score, effect in zip(scores, effects, strict=True):
        wider = null.model.with_effects([effect])
        index = list(wider.parameters).index(f"{effect.name}.{effect.amplitudes[0]}")
        gradient, information, _alone = _core.score(null.problem.at(null.point), [(wider, [index])])
        scale = max(null.scatter, 1.0)
        # Gauss' rule with a few places per frame.
        assert score.information[0, 0] == pytest.approx(information[0, 0] / scale, rel=2e-3)
        error = np.sqrt(information[0, 0] / scale)
        assert score.gradient[0] == pytest.approx(gradient[0] / scale, abs=0.01 * error)


@pytest.mark.parametrize(
    ("model", "spread"),
    [(udd.Disk(W), [4.0, 0.02, 0.02, 3.0]), (udd.Pendulum(0.6, inertia=0.4, k0=0.01), [4.0, 1.0])],
    ids=["disk", "pendulum"],
)
def test_coordinates_change_as_they_are_said_to(model, spread):
    x = np.random.default_rng(1).normal(0, spread, (40, len(spread)))
    rates, step = model.rates(0.0, x), 1e-7
    for item in coordinates(model):
        ahead = item.of(np.full(40, step), x + step * rates)
        back = item.of(np.full(40, -step), x - step * rates)
        np.testing.assert_allclose((ahead - back) / (2 * step), item.rate(x, rates), rtol=1e-4, atol=1e-4)
    with pytest.raises(FitError, match="a function of Omega, "):
        coordinate(model, "X")


def test_the_load_on_a_pivot_is_the_force_along_the_rod():
    model = udd.Pendulum(0.6, inertia=0.4)
    x = np.random.default_rng(4).normal(0, [4.0, 1.0], (20, 2))
    item = coordinate(model, "load")
    # The centre of mass moves on a circle; the part of its acceleration along the rod is length Omega^2.
    force = model.g * np.cos(x[:, 1]) + 0.6 * x[:, 0] ** 2
    np.testing.assert_allclose(item.of(np.zeros(20), x), force / model.g - 1, rtol=1e-12)
    effect = E.formula("friction", f"a * {item.text}", a=1e-3)
    braked = model.with_effects([effect]).rates(0.0, x)[:, 0] - model.rates(0.0, x)[:, 0]
    np.testing.assert_allclose(braked, -1e-3 * (force / model.g - 1) * x[:, 0] / 0.4, atol=1e-12)


def _braked_pendulum(brake, seed, seconds=60):
    """A pendulum of 0.6 m with a friction coefficient over Omega and theta; seen with 5 mrad at 30 Hz."""

    def rates(_t, s):
        return [-(9.81 * 0.6 * np.sin(s[1]) + brake(*s) * s[0]) / 0.36, s[0]]

    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / 30)
    start = [0.0, rng.uniform(0.9, 1.2)]
    theta = solve_ivp(rates, (0, seconds), start, "DOP853", t, rtol=1e-9, atol=1e-11, max_step=0.02).y[1]
    measured = udd.Measurement(t, {"theta": theta + 5e-3 * rng.standard_normal(len(t))})
    return measured, udd.Pendulum(0.6, k0=0.012)


_SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(2, 5))]


@pytest.mark.parametrize("seed", _SEEDS)
@pytest.mark.parametrize("n", [-0.4, pytest.param(-0.7, marks=pytest.mark.nightly)])
def test_a_drag_that_grows_slower_than_the_speed_is_a_power(n, seed):
    # Torques of |Omega|^0.6 and |Omega|^0.3; the exponents' standard errors are about 0.03.
    law = lambda omega, _theta: 0.012 + 0.012 * (omega**2 + 1e-12) ** (n / 2)  # noqa: E731
    result = udd.discover(*_braked_pendulum(law, seed, 90), progress=False)
    forms = [entry.effect for entry in (*result.effects, *result.alternatives)]
    power = next(effect for effect in forms if effect.name == "power_drag")
    assert power.parameters["n"] == pytest.approx(n, abs=0.1)


@pytest.mark.parametrize("seed", _SEEDS)
def test_friction_by_the_load_on_a_pivot_is_a_rival_of_cubic_drag(seed):
    # Over a swing of a radian the two differ by less than ten nats; "cubic drag" was called identified.
    law = lambda omega, theta: 0.012 + 0.006 * (np.cos(theta) + 0.6 * omega**2 / 9.81)  # noqa: E731
    result = udd.discover(*_braked_pendulum(law, seed), progress=False)
    assert result.verdict == "effect present, form not identified"
    named = [entry.title for entry in (*result.effects, *result.alternatives)]
    assert any("cos(theta) + length*Omega^2/g" in title for title in named)


@pytest.mark.parametrize("spline", [Spline(-1.0, 2.0, 7, False), Spline(0.0, 2 * np.pi, 9, True)])
def test_splines(spline):
    rng = np.random.default_rng(2)
    x = rng.uniform(spline.low, spline.high, 30)
    coefficients = rng.standard_normal(spline.size)
    np.testing.assert_allclose(spline.design(x).sum(axis=-1), 1.0, atol=1e-12)
    step = 1e-6
    slope = (spline.design(x + step) @ coefficients - spline.design(x - step) @ coefficients) / (2 * step)
    np.testing.assert_allclose(spline.design(x, 1) @ coefficients, slope, atol=1e-7)
    straight = np.ones(spline.size) if spline.periodic else np.arange(spline.size)
    assert np.abs(spline.roughness @ straight).max() < 1e-12
    if spline.periodic:
        np.testing.assert_allclose(spline.design(x), spline.design(x + 2 * np.pi), atol=1e-12)
    else:  # beyond its ends a curve goes on level
        np.testing.assert_allclose(spline.design(np.array([5.0])), spline.design(np.array([2.0])))
        assert np.abs(spline.design(np.array([5.0]), 1)).max() == 0.0
    full = np.concatenate([coefficients, coefficients[:3]]) if spline.periodic else coefficients
    np.testing.assert_allclose(
        Spline(spline.low, spline.high, spline.intervals, False).design(x) @ full,
        spline.design(x) @ coefficients,
    )


def test_an_angle_that_does_not_go_round_has_ends():
    x = np.random.default_rng(3).uniform(0, 50, 2000)
    assert along(x, True, 12).periodic
    assert not along(0.02 * x, True, 12).periodic
    assert not along(x, False, 12).periodic
    # A curve with a jump from pi to -pi is no law of an angle, wherever the places leave a gap.
    turned = np.mod(x, 2 * np.pi) - np.pi
    assert along(turned[abs(turned + 1) > 1], True, 12).periodic
    assert not along(turned[abs(turned) < 2.5], True, 12).periodic


def test_surfaces_are_products():
    a, b = Spline(0.0, 1.0, 3, False), Spline(0.0, 2 * np.pi, 5, True)
    x, y = np.random.default_rng(4).uniform(0, 1, (2, 20))
    coefficients = np.outer(np.arange(a.size), np.ones(b.size)).ravel()
    np.testing.assert_allclose(
        product(a.design(x), b.design(y)) @ coefficients, a.design(x) @ np.arange(a.size)
    )
    assert np.abs(rough_product(a, b) @ coefficients).max() < 1e-12


def _regression(seed: int, curve, noise: float = 0.3, n: int = 400) -> tuple[Spline, np.ndarray, Score]:
    """Plain regression as a score: known beforehand in every respect."""
    rng = np.random.default_rng(seed)
    spline = Spline(0.0, 1.0, 20, False)
    x = rng.uniform(0, 1, n)
    design = spline.design(x)
    y = curve(x) + noise * rng.standard_normal(n)
    information = design.T @ design / noise**2
    return spline, x, Score(design.T @ y / noise**2, information, np.diag(information))


def test_bands_of_a_plain_regression_hold_the_curve():
    curve = lambda x: np.sin(5 * x) + x  # noqa: E731
    inside, frequencies = [], []
    x = np.linspace(0.01, 0.99, 99)
    for seed in range(60):
        spline, _x, score = _regression(seed, curve)
        result = smooth(score, spline.roughness, 400)
        design = spline.design(x)
        error = np.sqrt(np.einsum("ik,kl,il->i", design, result.covariance, design))
        inside.append(np.mean(np.abs(design @ result.coefficients - curve(x)) < 1.96 * error))
        frequencies.append(result.df)
    # 60 records with some 6 independent places each: +- 1.2 %.
    assert 0.92 < np.mean(inside) < 0.985
    assert 4 < np.mean(frequencies) < 12


def test_a_straight_line_is_charged_as_two_parameters():
    """Without curvature the evidence is approximately that of the Bayesian information criterion."""
    for size in (0.1, 30.0):
        spline, _x, score = _regression(1, lambda x, size=size: size * x)
        result = smooth(score, spline.roughness, 400)
        line = np.column_stack([np.ones(spline.size), np.arange(spline.size)])
        gradient, information = line.T @ score.gradient, line.T @ score.information @ line
        best = gradient @ np.linalg.solve(information, gradient) / 2
        # A line that is seen very well costs more than a parameter's usual price.
        charge = np.log(max(400, 2 * best))
        # How smooth it is was not known beforehand (3 nats); some waves may fit the noise.
        assert best - charge - 5 < result.evidence < best - charge + 3
        assert result.df < 4


def test_chance_is_what_it_says():
    spline, _x, score = _regression(0, np.sin)
    root = np.linalg.cholesky(score.information)
    rng = np.random.default_rng(5)
    p = np.array(
        [
            chance(replace(score, gradient=root @ rng.standard_normal(spline.size)), spline.roughness)[0]
            for _ in range(2000)
        ]
    )
    # Never more often than it says (binomial, three standard deviations); not wastefully less often.
    for level in (0.1, 0.01):
        assert 0.2 * level < np.mean(p < level) < level + 3 * np.sqrt(level / 2000)


def test_what_parameters_absorb_is_left_out(null):
    """A constant upward velocity of the contact is the drive's."""
    only = scan_curves(
        null, only=lambda slot, each: (slot.title, each[0].name) == ("vertical (constraint)", "Z")
    )
    curve = only.curves[0]
    theirs = confounded_directions(curve, null)
    assert theirs.rows.shape[0] >= 1
    narrowed = identifiable_part(curve, null)
    x = np.quantile(curve.places[0], np.linspace(0.05, 0.95, 40))
    assert narrowed.errors(x).mean() < 0.5 * curve.errors(x).mean()
    taken_back = narrowed.aligned_with(narrowed.values(x) + 1e-3, x) - narrowed.values(x)
    assert np.abs(taken_back).mean() < 4e-4


def test_a_wave_between_the_places_is_no_law(null):
    """A wave of which each place of the curve shows the same phase looks like a constant there."""
    spline, _x, score = _regression(0, lambda x: 2.0 + 0.0 * x)
    straight = next(c for c in scan_curves(null).curves if not c.splines[0].periodic)
    even = (np.linspace(0.0, 1.0, 4001),)
    target = _Target(replace(straight, splines=(spline,), places=even, score=score), 400)
    h = float(target.x[1] - target.x[0])
    texts = ("1.9", f"1.9 * cos({2 * np.pi / h} * (x - {float(target.x[0])}))")
    constant, wave = (target.fit(*read(text, {"x": ("x",)})) for text in texts)
    assert constant is not None
    assert constant.values[0] == pytest.approx(2.0, abs=4 * 0.3 / 400**0.5)
    assert wave is None


def test_a_curve_known_without_error_has_formulas_too(null):
    """Where the free parameters can do all that a curve does at a place, it has no error there."""
    curve = next(c for c in scan_curves(null).curves if not c.splines[0].periodic)
    baseline = replace(curve, covariance=0.0 * curve.covariance)
    assert formulas_for(baseline, 3000)


def test_formulas_are_read_by_a_whitelist():
    node, values = read("(0.5 + (1.3 * tanh((1.7 - (2.5 * X1)))))", {"X1": ("x",)})
    x = np.linspace(-1, 1, 9)
    np.testing.assert_allclose(evaluate(node, x, values), 0.5 + 1.3 * np.tanh(1.7 - 2.5 * x))
    simpler = simplify(node, values)
    np.testing.assert_allclose(evaluate(simpler, x, values), evaluate(node, x, values))
    # Several rows at once, each with its own constants.
    rows = evaluate(node, x, [np.array([[v], [2 * v]]) for v in values])
    np.testing.assert_array_equal(rows[1], evaluate(node, x, [2 * v for v in values]))
    assert write(node, "Z", dict(enumerate("abcd"))) == "a + b * tanh(c - d * Z)"
    # A square root is a power, whose exponent is fitted; what numbers alone come to is one number.
    node, values = read("sqrt(X1) + 2*3*X1^-2 + X1^0.5", {"X1": ("x",)})
    assert values == [0.5, 6.0, 0.5]
    assert write(node, "x", dict(enumerate("abc"))) == "x^a + b * x^(-2) + x^c"
    assert write(simplify(*read("(X1^2)^2", {"X1": ("x",)})), "R", {}) == "R^4"
    for bad in (
        "__import__('os')",
        "X1.real",
        "[X1]",
        "X2",
        "X1 if X1 else 1",
        "f(X1)",
        "X1 +",
        "tan(X1)",
        "t",
    ):
        with pytest.raises(ValueError, match="formula"):
            read(bad, {"X1": ("x",)})


@pytest.mark.parametrize(
    "text", ["x - (x - 1)", "x/(2*x)", "(x^2)^3", "-(x + 1)^2", "x - 2*(x + 1)/3", "2^x"]
)
def test_formulas_are_written_as_they_were_meant(text):
    node, values = read(text, {"x": ("x",)})
    x = np.linspace(0.5, 2, 7)
    names = {k: repr(v) if v >= 0 else f"({v!r})" for k, v in enumerate(values)}
    written = write(node, "x", names)
    expected = eval(text.replace("^", "**"), {"x": x})
    np.testing.assert_allclose(eval(written.replace("^", "**"), {"x": x}), expected)
    np.testing.assert_allclose(evaluate(simplify(node, values), x, values), expected)


def test_laws_have_a_form():
    read_one = lambda text: read(text, {"x": ("x",)})[0]  # noqa: E731
    assert sensible(read_one("2*tanh(3*x + 1)"))
    assert not sensible(read_one("tanh(tanh(3*x))"))
    assert not sensible(read_one("2^(3*x)"))
    assert not sensible(read_one("2*exp(x)"))
    assert sensible(read_one("2*sin(x)"), angle=True)
    assert sensible(read_one("2*exp(3*cos(x + 1))"), angle=True)
    assert not sensible(read_one("2*exp(3*cos(x + 1))"))
    assert not sensible(read_one("2*exp(3*cos(5*x))"), angle=True)


def test_without_pyoperon_the_usual_forms_are_tried(monkeypatch):
    case = unmodelled.CASES[0]
    fit = udd.fit(unmodelled.record(weak(case), 5, 40.0), udd.Disk(W))
    monkeypatch.setitem(sys.modules, "pyoperon.sklearn", None)
    only = scan_curves(fit, only=lambda slot, each: (slot.title, each[0].name) == case.places[0])
    assert formulas_for(only.curves[0], 3000)


def test_a_curve_is_drawn(null):
    curve = scan_curves(null).curves[0]
    ax = draw(curve)
    assert len(ax.collections) == 1
    with pytest.raises(UddError, match="a curve of a scan"):
        draw(null)
    plt.close(ax.figure)


def test_a_located_curve_is_fitted_in_full():
    """A strong law, around which nothing is linear: curve and formula explain what is missing."""
    case = unmodelled.CASES[0]
    measured = unmodelled.record(case.law, 1)
    base = fit_record(measured, record_of(measured), udd.Disk(W), search=True)
    plain = udd.fit(unmodelled.record(None, 1), udd.Disk(W))
    assert base.scatter > 3
    result = fit_curve(base, scan_curves(with_larger_model_error(base, 3.0)).curves[0])
    assert result.fit.converged
    assert result.fit.scatter < 1.1 * plain.scatter
    assert 5 < result.curve.df < 20
    x = np.quantile(result.curve.places[0], np.linspace(0.01, 0.99, 99))
    off = result.curve.values(x) - result.curve.aligned_with(case.curve(x), x)
    assert np.mean(np.abs(off) < 1.96 * result.curve.errors(x)) > 0.8
    # The effect is the curve.
    made = result.fit.model.rates(0.0, np.column_stack([0 * x, 0 * x, x, 0 * x]))[:, 2] - result.fit.model.W
    np.testing.assert_allclose(made, result.curve.values(x), atol=1e-12)
    best = formulas_for(result.curve, 4500)[0]
    fitted = fit_formula(base, result.curve, best)
    assert fitted.converged
    # All its constants were free, and it explains the data as well, for less.
    assert {f"formula.{p}" for p in best.parameters} <= set(fitted.parameters)
    assert fitted.chi2 / 2 + np.log(4500) / 2 * len(best.parameters) < result.fit.chi2 / 2 + result.cost


@pytest.mark.nightly  # so far from the known model it depends on the last bits whether a fit is found
def test_moves_that_lead_astray_are_halved():
    """Four times as strong a law, of which full Gauss-Newton moves of the curve find no end."""
    case = unmodelled.CASES[0]
    measured = unmodelled.record(weak(case, 4.0), 1)
    base = fit_record(measured, record_of(measured), udd.Disk(W), search=True)
    curves = scan_curves(with_larger_model_error(base, 3.0)).curves
    result = fit_curve(base, next(c for c in curves if c.name == case.places[0]))
    assert result.fit.converged and result.fit.level == base.level
    # Not to the noise, for so far from the known model one curve does not do; full moves end in no fit.
    assert result.fit.scatter < 0.2 * base.scatter


def test_a_broken_power_can_be_fitted():
    case = unmodelled.CASES[1]
    measured = unmodelled.record(case.law, 1)
    base = fit_record(measured, record_of(measured), udd.Disk(W), search=True)
    curve = scan_curves(with_larger_model_error(base, 3.0)).curves[0]
    assert curve.name == ("friction", "|Omega|")
    root = Formula(
        "a * abs(Omega)^0.5",
        {"a": 1.5e-3},
        ("a",),
        0.0,
        ("*", ("c", 0), ("^", ("x",), ("n", 0.5))),
        "abs(Omega)",
    )
    fitted = fit_formula(base, curve, root)
    assert fitted.converged
    assert fitted.parameters["formula.a"] == pytest.approx(1.5e-3, abs=4 * fitted.errors["formula.a"])
    assert fitted.parameters["k0"] == pytest.approx(unmodelled.K0, abs=4 * fitted.errors["k0"])


def test_one_law_takes_the_place_of_several_that_come_near_it():
    # A push at one angle at the contact: a constant torque, a tilt and a slip together explain most of it.
    def push(theta):
        return 0.01 * np.exp(-4 * (1 - np.cos(theta - 1)))

    law = lambda t, o, y, z, b: (float(push(np.arctan2(y, z))), 0.0, 0.0)  # noqa: E731
    measured = unmodelled.record(law, 5, 25.0, noise=(5e-4, 7e-3))
    result = udd.discover(measured, udd.Disk(W))
    (effect,) = result.effects
    assert effect.curve.name == ("torque", "theta")
    theta = np.arange(-3, 3.1, 0.25)
    curve = effect.curve
    off = (curve.values(theta) - curve.aligned_with(push(theta), theta)) / curve.errors(theta)
    assert np.sqrt(np.mean(off**2)) < 2
    k = result.error_after.horizons.index(1.0)
    assert result.error_after.median[k] < 1.3 * result.error_after.floor[k]  # known to some 10 % each


def test_a_surface_is_added_and_refitted():
    law = lambda t, o, y, z, b: (6 * y * z, 0.0, 0.0)  # noqa: E731
    base = udd.fit(unmodelled.record(law, 1), udd.Disk(W))
    result = scan_curves(
        base,
        pairs=True,
        only=lambda slot, each: slot.name == "torque" and [c.name for c in each] == ["Y", "Z"],
    )
    located = fit_curve(base, result.curves[0], "surface")
    assert located.fit.converged
    # chi2 is no criterion: the plain model needs a larger model error, with which any model fits.
    assert located.fit.evidence > base.evidence + 200
    # A torque over Y or over Z alone may be friction, or a pivot that is off. The surface determines only the
    # mixed second difference.
    y, z = np.meshgrid([-0.015, 0.015], [-0.02, 0.01], indexing="ij")
    mixed = np.diff(np.diff(located.curve.values(y, z), axis=0), axis=1).item()
    assert mixed == pytest.approx(6 * 0.03 * 0.03, rel=0.25)
    # The effect says what the curve says.
    effect = located.effect
    state = np.array([1.0, 0.012, -0.017, 0.4])
    with_it = udd.Disk(W, effects=[effect])
    inertia = with_it.R**2 / 2 + state[1] ** 2 + state[2] ** 2
    change = with_it.rates(0.0, state)[0] - udd.Disk(W).rates(0.0, state)[0]
    assert change * inertia == pytest.approx(located.curve.values(state[1], state[2]), rel=1e-9)


def test_a_velocity_is_scored_with_its_momentum_and_without():
    def law(t, o, y, z, b):
        return 0.0, 0.0, 2.0 * float(unmodelled.grip(z))

    result = scan_curves(udd.fit(unmodelled.record(law, 1, 40.0), udd.Disk(W)))
    first = result.curves[0]
    other = next(c for c in result.curves[1:] if c.key_without_momentum == first.key_without_momentum)
    assert {first.slot.momentum, other.slot.momentum} == {"constraint", "consistent"}
