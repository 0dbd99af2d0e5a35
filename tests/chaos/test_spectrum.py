"""The Lyapunov spectrum against reference values, exact sums and exact averages."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import udd
from udd.chaos.spectrum import kaplan_yorke

REFERENCE = {
    1.0: (0.21016, 7e-5, 2.17366),
    3.4693: (0.30803, 1.5e-4, 2.23549),
    3.9: (0.21479, 1.9e-4, 2.1768),
}


@pytest.mark.parametrize("w", REFERENCE)
def test_chaos(w):
    spectrum = udd.lyapunov_spectrum(w, tol=2e-3)
    value, error, dimension = REFERENCE[w]
    assert spectrum.verdict == "chaos"
    assert spectrum.converged
    # Three standard errors, ours and the reference's.
    assert abs(spectrum.exponents[0] - value) < 3 * np.hypot(spectrum.standard_errors[0], error)
    assert abs(spectrum.exponents[1]) < 4 * spectrum.standard_errors[1] + 20.0 / spectrum.t
    # The volume shrinks at the rate -1 everywhere: exact but for the integration's errors.
    assert abs(spectrum.invariants["sum of exponents + 1 + B w"]) < 1e-8
    # D = 2 + l1/(1 + l1), so its error is that of l1 over (1 + l1)^2.
    assert abs(spectrum.dimension - dimension) < 3 * spectrum.standard_errors[0] + 1e-3
    # Averages scatter as the exponents do, with a few times their error.
    assert max(map(abs, spectrum.invariants.values())) < 0.02 * w


@pytest.mark.parametrize(("w", "period"), [(0.25, 22.737375), (7.1, 3.98808575286), (10.0, 3.35832224912)])
def test_periodic_orbits(w, period):
    spectrum = udd.lyapunov_spectrum(w)
    assert spectrum.verdict == "periodic orbit"
    assert spectrum.dimension == 1.0
    # The points come back to 1e-4 of their size, the times with them.
    assert spectrum.period == pytest.approx(period, rel=1e-6)
    if w == 7.1:
        # The slowest transient of the paper's figures decays at this rate.
        assert abs(spectrum.exponents[1] + 0.000444) < 4 * spectrum.standard_errors[1]


def test_an_equilibrium():
    # B = 0.2 above its Hopf point: the rotation is stable.
    spectrum = udd.lyapunov_spectrum(udd.DLE(5.0, B=0.2), state0=[np.sqrt(5.0), np.sqrt(5.0), 0.01])
    assert spectrum.verdict == "equilibrium"
    assert spectrum.dimension == 0.0
    # The real parts of the eigenvalues: l^3 + (1 + B w) l^2 + w (1 + B) l + 2 w = 0.
    roots = np.sort(np.roots([1.0, 2.0, 6.0, 10.0]).real)[::-1]
    assert np.abs(spectrum.exponents - roots).max() < 4 * spectrum.standard_errors.max() + 2e-3
    assert abs(spectrum.exponents.sum() + 2.0) < 1e-8


def test_a_motion_of_two_frequencies_is_a_torus():
    equations = ["v", "(1-x^2)*v-x", "w", "2*(1-y^2)*w-y"]
    result = udd.lyapunov_spectrum(udd.Model(["x", "v", "y", "w"], equations), state0=[1.0, 0.0, 0.5, 0.3])
    assert result.verdict == "torus"
    # Exponents along it are averages that go to zero as 1/t; the dimension is that of the torus.
    assert result.dimension == 2.0


@pytest.mark.parametrize(("energy", "y"), [(1 / 12, 0.25), (1 / 8, 0.3), (1 / 12, 0.1)])
def test_neighbours_that_part_in_proportion_to_time_are_no_chaos(energy, y):
    model = udd.Model(["x", "y", "u", "v"], ["u", "v", "-x-2*x*y", "-y-x^2+y^2"])
    start = np.array([0.0, y, np.sqrt(2 * energy - y**2 + 2 * y**3 / 3), 0.0])
    near = udd.ensemble(
        model, [0.0, 20_000.0], [start, start + 1e-9 * np.array([0.0, 1.0, 0.0, 1.0])], rtol=1e-13
    )
    # Chaos at the exponents' accuracy, 1e-3, would part them by e^20; these part by a few times the time.
    assert np.linalg.norm(np.diff(near.state[:, -1], axis=0)) < 10.0 * 20_000 * 1e-9
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", udd.ConvergenceWarning)
        assert udd.lyapunov_spectrum(model, t=20_000, state0=start).verdict in ("torus", "undecided")


def test_chaos_where_energy_is_kept():
    model = udd.Model(["x", "y", "u", "v"], ["u", "v", "-x-2*x*y", "-y-x^2+y^2"])
    start = [0.0, -0.25, np.sqrt(0.25 - 0.0625 - 2 * 0.25**3 / 3), 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", udd.ConvergenceWarning)
        assert udd.lyapunov_spectrum(model, t=20_000, state0=start).verdict == "chaos"


def test_a_chaotic_transient_is_told_as_one():
    # Figure 16b: chaos that lives some 27,000 units and ends in rotation, which is stable.
    w, B = 3.7, 0.2
    spectrum = udd.lyapunov_spectrum(udd.DLE(w, B=B), state0=[np.sqrt(w), np.sqrt(w), -3.5])
    assert spectrum.verdict == "equilibrium" and spectrum.converged
    # The exponents are those of the end: l^3 + (1 + B w) l^2 + w (1 + B) l + 2 w = 0.
    roots = np.sort(np.roots([1.0, 1.0 + B * w, w * (1.0 + B), 2.0 * w]).real)[::-1]
    assert np.abs(spectrum.exponents - roots).max() < 4 * spectrum.standard_errors.max() + 1e-3
    assert 1000.0 < spectrum.transient < 2e5 and "after a transient" in repr(spectrum)
    # An orbit that begins where it ends has none.
    there = udd.lyapunov_spectrum(udd.DLE(w, B=B), state0=spectrum.end)
    assert there.verdict == "equilibrium" and there.transient == 0.0


def test_a_section_on_request():
    model = udd.DLE(1.0)
    spectrum = udd.lyapunov_spectrum(model, tol=5e-3, section="maxima of z")
    points = spectrum.section
    assert len(points.t) == 600
    # On the surface z' = 0, from above: to rounding of rates of order one.
    rates = model.rates(points.t, points.state)
    assert np.abs(rates[:, 2]).max() < 1e-12
    assert points.residual < 1e-12
    # The continuation of the orbit.
    next_ = udd.poincare(model, "maxima of z", 1, state0=spectrum.end, transient=0)
    np.testing.assert_array_equal(points.state[0], next_.state[0])
    # Other requests change no bit of the rest.
    alone = udd.lyapunov_spectrum(model, tol=5e-3)
    assert alone.section is None
    np.testing.assert_array_equal(alone.exponents, spectrum.exponents)


@pytest.mark.parametrize(
    ("w", "section", "count"),
    [(0.25, "z", 2), (7.1, "z", 2), (10.0, "maxima of z", 2), (10.0, "omega = y", 1)],
)
def test_the_section_of_a_periodic_orbit_has_as_many_points_as_its_period(w, section, count):
    spectrum = udd.lyapunov_spectrum(w, section=section)
    x, t = spectrum.section.state, spectrum.section.t
    assert spectrum.section.outcome == "finished"
    # They come back after `count` points, within the distance of a periodic orbit (1e-4), and not before.
    assert np.abs(x[count:] - x[:-count]).max() < 1e-3
    assert t[count] - t[0] == pytest.approx(spectrum.period, rel=1e-4)
    apart = np.abs(x[:count, None] - x[None, :count]).max(axis=2)
    assert apart[~np.eye(count, dtype=bool)].min(initial=np.inf) > 0.05


def test_a_surface_that_is_not_crossed_is_said():
    with pytest.warns(udd.errors.IncompleteWarning, match="0 crossings instead of 600"):
        result = udd.lyapunov_spectrum(1.0, tol=0.02, section="z = 100")
    assert result.section.found == 0
    assert result.verdict == "chaos"


def test_the_disk():
    spectrum = udd.lyapunov_spectrum(udd.Disk(0.055, edge="ignore"), tol=0.02)
    assert spectrum.verdict == "chaos"
    # Along the flow, and along the angle that nothing depends on.
    assert np.abs(spectrum.exponents[1:3]).max() < 0.01
    assert abs(spectrum.invariants["<Y Omega> - W"]) < 1e-3 * 0.055


def test_a_contact_that_sticks_has_an_exponent_of_minus_infinity():
    rod = udd.Pendulum(0.5, k0=0.0).with_effects(udd.effects.coulomb(c=0.2, treatment="set-valued"))
    result = udd.lyapunov_spectrum(rod, state0=[0.0, 1.0], t=60.0, transient=0.0, tol=1.0)
    assert result.exponents[-1] == -np.inf


def test_covariant_vectors():
    model = udd.DLE(1.0)
    vectors = udd.covariant_vectors(model, 400)
    flow = model.rates(vectors.t, vectors.state)
    flow /= np.linalg.norm(flow, axis=1, keepdims=True)
    # The second one is the flow; convergence backwards over 200 is complete to rounding.
    assert np.abs(np.einsum("kn,kn->k", flow, vectors.vectors[:, 1])).min() > 1 - 1e-8
    assert np.linalg.norm(vectors.vectors, axis=2) == pytest.approx(np.ones((401, 3)))
    # The flow carries each vector over into the one of the next interval.
    step, small = vectors.t[1] - vectors.t[0], 1e-7
    for k in (0, 100, 399):
        ends = [
            udd.simulate(model, [0.0, step], vectors.state[k] + sign * small * vectors.vectors[k, 0]).state[
                -1
            ]
            for sign in (1.0, -1.0)
        ]
        carried = (ends[0] - ends[1]) / np.linalg.norm(ends[0] - ends[1])
        # Differences of this size are good to 1e-7.
        assert abs(carried @ vectors.vectors[k + 1, 0]) > 1 - 1e-6
    # Each interval's rates sum to the divergence.
    assert vectors.local_exponents.sum(axis=1) == pytest.approx(-np.ones(400), abs=1e-8)


@pytest.mark.parametrize("dt", [20.0, 50.0, 300.0])
def test_covariant_vectors_of_long_intervals(dt):
    """Within them tangents become parallel: with dt = 50 the last exponent was -0.53 instead of -1.2."""
    vectors = udd.covariant_vectors(udd.DLE(1.0), 4, dt=dt, transient=200.0)
    flow = udd.DLE(1.0).rates(vectors.t, vectors.state)
    flow /= np.linalg.norm(flow, axis=1, keepdims=True)
    assert np.abs(np.einsum("kn,kn->k", flow, vectors.vectors[:, 1])).min() > 1 - 1e-6
    assert vectors.local_exponents.sum(axis=1) == pytest.approx(-np.ones(4), abs=1e-7)


@pytest.mark.parametrize("dt", [1e3, 1e10, 1e300])
def test_an_interval_in_which_tangents_leave_the_range_of_numbers_is_said(dt):
    with pytest.raises(udd.IntegrationError, match=r"within an interval, by t = .*: use a shorter dt"):
        udd.covariant_vectors(udd.DLE(1.0), 2, dt=dt)


def test_kaplan_yorke():
    assert kaplan_yorke([-1.0, -2.0]) == 0.0
    assert kaplan_yorke([0.5, 0.0, -0.5]) == 3.0
    assert kaplan_yorke([0.5, 0.0, -1.0]) == 2.5
    assert kaplan_yorke([1.0, -np.inf]) == 1.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: udd.lyapunov_spectrum(-1.0), "w must not be below 0"),
        (lambda: udd.lyapunov_spectrum(1.0, tol=0.0), "tol must be above 0"),
        (lambda: udd.lyapunov_spectrum(1.0, section="speed"), "speed"),
        (lambda: udd.lyapunov_spectrum(1.0, section=3), "section must be an expression"),
        (lambda: udd.covariant_vectors(udd.DLE(1.0), 0), "n must be a whole number"),
        (lambda: udd.covariant_vectors(1.0), "a model is needed"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(udd.errors.ModelError, match=message):
        call()


@pytest.mark.slow
def test_error_bars_are_honest():
    """A hundred orbits scatter by their standard errors."""
    starts = np.random.default_rng(5).normal(size=(100, 3))
    with pytest.warns(udd.ConvergenceWarning):
        results = [udd.lyapunov(udd.DLE(1.0), state0=s, t=3e4, tol=1e-9, with_error=True) for s in starts]
    values, errors = np.array(results).T
    chi2 = ((values - 0.21016) ** 2 / errors**2).mean()
    # The mean of 100 squares of normal deviates, 1 +- 0.14; blocks are few, which widens their tails.
    assert 0.6 < chi2 < 1.6
