"""Equilibria, cycles and their branches, against closed forms and independent integrators."""

from __future__ import annotations

import json
import math
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize, special
from scipy.integrate import solve_ivp

import udd
from exact_cycles import symmetric_period
from lorenz import lorenz
from udd.bifurcations.pseudo_arclength import CorrectorFailed
from udd.bifurcations.solution_surface import SolutionSurface
from udd.errors import ModelError

# Values that two or three independent integrators agree on, to the digits that are printed.
PERIODS = {7.1: 3.98808575286, 10.0: 3.35832224912}
SYMMETRY_BREAKING, PERIOD_THERE = 7.09642643066, 3.98909410283
DOUBLING = 5.394713224


@pytest.fixture(scope="module")
def figure_eight() -> udd.Branch:
    """The symmetric figure-eight of the DLE over the drive."""
    return udd.continuation(udd.periodic_orbit(udd.DLE(10.0)), "w", (5.0, 300.0), ds_max=1.0)


@pytest.fixture(scope="module")
def rotation() -> udd.Branch:
    """The rotating state of the damped DLE over the drive."""
    rests = udd.equilibria(udd.DLE(2.5, B=0.2))
    return udd.continuation(next(rest for rest in rests if rest.state[0] > 0.1), "w", (0.5, 20.0))


def test_equilibria_of_the_dle_are_those_of_the_closed_form() -> None:
    rests = udd.equilibria(udd.DLE(3.0, B=0.2))
    states = sorted(rest.state.tolist() for rest in rests)
    root = math.sqrt(3.0)
    # Newton's method converges to rounding.
    np.testing.assert_allclose(states, [[-root, -root, 0], [0, 0, 5], [root, root, 0]], atol=1e-14)
    focus = next(rest for rest in rests if rest.state[0] > 0.1)
    # l^3 + (1 + B w) l^2 + w (1 + B) l + 2 w = 0
    np.testing.assert_allclose(
        np.sort_complex(focus.eigenvalues), np.sort_complex(np.roots([1, 1.6, 3.6, 6])), rtol=1e-12
    )
    assert {rest.kind for rest in rests} == {"saddle", "saddle-focus"}


def test_a_pendulum_hangs_or_stands() -> None:
    rests = udd.equilibria(udd.Pendulum(0.3))
    assert [rest.kind for rest in rests] == ["centre", "saddle"]
    assert abs(rests[0].state[1]) < 1e-9 and abs(rests[1].state[1]) == pytest.approx(math.pi)
    # Without friction small swings have the frequency sqrt(g/l).
    assert np.abs(rests[0].eigenvalues.imag) == pytest.approx(math.sqrt(9.81 / 0.3))
    damped = udd.equilibria(udd.Pendulum(0.3, k0=0.01), near=[0.0, 6.0])
    assert [rest.kind for rest in damped] == ["stable focus", "saddle"]


def test_the_disk_has_three_rotating_states_where_friction_falls_with_speed() -> None:
    W = 0.0045
    disk = udd.Disk(W)
    ordered = sorted(rest.state[0] for rest in udd.equilibria(disk) if rest.state[0] > 0)

    def power(omega: float) -> float:
        return max(0.103 - 0.055 * omega, 0.012) * omega**2 - 9.81 * W

    known = [optimize.brentq(power, a, b, xtol=1e-15) for a, b in ((0.1, 1.2), (1.3, 1.65), (1.66, 5.0))]
    np.testing.assert_allclose(ordered, known, rtol=1e-12)


@pytest.mark.parametrize("w", PERIODS)
def test_the_period_of_the_figure_eight(w: float) -> None:
    orbit = udd.periodic_orbit(udd.DLE(w))
    assert orbit.symmetric and orbit.stable
    assert orbit.period == pytest.approx(PERIODS[w], abs=1e-10)  # the reference's last digit is 1e-11


@pytest.mark.parametrize("period", [None, 1.15])
def test_a_cycle_of_a_family_where_energy_is_kept(period: float | None) -> None:
    orbit = udd.periodic_orbit(udd.Pendulum(0.3), [0.0, 1.0], period=period)
    omega, theta = orbit.state
    # T = 4 sqrt(l/g) K(sin(a/2)) for the amplitude a of its own energy.
    m = math.sin(theta / 2) ** 2 + omega**2 * 0.3 / (4 * 9.81)
    assert orbit.period == pytest.approx(4 * math.sqrt(0.3 / 9.81) * special.ellipk(m), abs=1e-11)
    # The other multiplier is 1 too.
    assert orbit.multipliers[0] == pytest.approx(1.0, abs=1e-6)
    assert orbit.neutral and not orbit.stable and "neutral" in repr(orbit)
    with pytest.raises(ModelError, match="cycles come in families"):
        udd.continuation(orbit, "g", (5.0, 12.0))


def test_the_period_of_the_disks_asymmetric_pair() -> None:
    orbit = udd.periodic_orbit(udd.Disk(0.071))
    assert not orbit.symmetric and orbit.stable
    assert orbit.period == pytest.approx(1.384045926, abs=1e-9)


def test_multipliers_agree_with_another_integrators_differences() -> None:
    orbit = udd.periodic_orbit(udd.DLE(10.0))

    def end(x0: np.ndarray) -> np.ndarray:
        run = solve_ivp(
            lambda t, x: [x[1] - x[0], x[0] * x[2], 10.0 - x[0] * x[1]],
            (0.0, orbit.period),
            x0,
            method="DOP853",
            rtol=1e-13,
            atol=1e-13,
        )
        return np.asarray(run.y[:, -1])

    start, h = orbit.state, 1e-5
    np.testing.assert_allclose(end(start), start, atol=1e-9)
    monodromy = np.column_stack([(end(start + h * e) - end(start - h * e)) / (2 * h) for e in np.eye(3)])
    expected = [1.0, *orbit.multipliers]
    # Central differences of this step are good to 1e-8 or so.
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(monodromy)), np.sort_complex(expected), atol=1e-6
    )
    # The divergence is -1.
    assert np.prod(orbit.multipliers).real == pytest.approx(math.exp(-orbit.period), rel=1e-9)


def test_the_figure_eight_loses_its_symmetry(figure_eight: udd.Branch) -> None:
    (point,) = figure_eight.points
    assert point.kind == "symmetry breaking"
    assert point.value == pytest.approx(SYMMETRY_BREAKING, abs=1e-9)  # the reference ends at 1e-11
    assert point.period == pytest.approx(PERIOD_THERE, abs=1e-9)
    assert point.error < 1e-9
    stable = figure_eight.stable[np.abs(figure_eight.values - point.value) > 1e-6]
    above = figure_eight.values[np.abs(figure_eight.values - point.value) > 1e-6] > point.value
    np.testing.assert_array_equal(stable, above)


def test_the_period_at_large_drives(figure_eight: udd.Branch) -> None:
    # T sqrt(w) -> 10.603754512 + 0.1616/w; what is left falls with 1/w^2, 1e-5 at w = 300.
    (orbit,) = figure_eight.at(300.0)
    assert isinstance(orbit, udd.PeriodicOrbit)
    assert orbit.period * math.sqrt(300.0) == pytest.approx(10.603754512 + 0.1616 / 300.0, abs=1e-5)


def test_the_asymmetric_pair_doubles_and_doubles(figure_eight: udd.Branch) -> None:
    cascade = udd.cascade(figure_eight.points[0], n=5)
    assert cascade.values[0] == pytest.approx(DOUBLING, abs=1e-9)  # the reference's last digit
    assert cascade.errors.max() < 1e-9
    periods = np.array([point.period for point in cascade.points])
    # Between doublings the period changes with the drive, most before the first.
    np.testing.assert_allclose(periods[1:] / periods[:-1], 2.0, rtol=0.03)
    for point in cascade.points:
        assert isinstance(point.solution, udd.PeriodicOrbit)
        assert point.solution.multipliers[0] == pytest.approx(-1.0, abs=1e-8)
    # The last ratio of five doublings is within 0.3 % of Feigenbaum's constant.
    assert cascade.ratios[-1] == pytest.approx(4.669201609, rel=3e-3)
    assert cascade.branches[0].ends[0] == "born at a symmetry breaking"


def test_a_cascade_to_the_fifth_digit_of_feigenbaums_constant() -> None:
    cascade = udd.cascade(udd.periodic_orbit(udd.DLE(6.0)), "w", n=9)
    # The ratios come nearer by a factor of 4.67 each: 9e-6 after nine doublings.
    assert cascade.ratios[-1] == pytest.approx(4.669201609, abs=1e-5)
    # Solved for, not followed step by step: the last cycle has 256 rounds, and some 1500 pieces.
    assert max(len(branch) for branch in cascade.branches[3:]) < 10
    # The doublings of the branch followed step by step, of another run.
    assert cascade.values[5] == pytest.approx(5.0045538093, abs=1e-10)
    assert all(branch.ends[0] == "born at a period doubling" for branch in cascade.branches[1:])


def test_a_step_off_a_bifurcation_does_not_jump_over_the_next() -> None:
    # A window of the DLE 3e-5 wide, in which the cycle of 22 section points loses its symmetry and doubles.
    state = [0.6415522621501002, -4.139594982525741, 7.896287533019794e-18]
    orbit = udd.periodic_orbit(udd.DLE(4.500018), state, period=53.11554)
    branch = udd.continuation(
        orbit, "w", (4.4999, 4.51), direction="down", ds=1e-6, ds_max=1e-3, until="symmetry breaking"
    )
    (breaking,) = branch.points
    assert breaking.value == pytest.approx(4.500013676, abs=1e-9)
    born = udd.continuation(breaking, bounds=(4.49, 4.51), max_points=20)
    assert [point.kind for point in born.points] == ["period doubling"]
    assert 4.49999 < born.points[0].value < breaking.value
    assert born.stable[0] and not born.stable[-1]


def test_weak_multipliers_beside_strong_ones_bring_no_false_bifurcations() -> None:
    rest = next(rest for rest in udd.equilibria(lorenz(rho=24.0), near=[7.8, 7.8, 23.0]) if rest.state[0] > 1)
    (hopf,) = udd.continuation(rest, "rho", (20.0, 30.0)).points
    branch = udd.continuation(hopf)
    # From the Hopf bifurcation at 470/19 to the homoclinic one rho falls all the way.
    assert hopf.value == pytest.approx(470 / 19, abs=1e-10)
    assert branch.points == ()
    assert branch.ends[1].startswith("a connection near 13.9265574")
    # The volume shrinks at the rate -41/3: by Liouville's formula the logarithms of the multipliers add up to
    # that, though the strong ones are 1e10 and more, and the weak ones below 1e-70.
    logs = np.log(np.abs(branch.multipliers)).sum(axis=1)
    np.testing.assert_allclose(logs, -41 / 3 * branch.periods, rtol=1e-6)
    assert np.abs(branch.multipliers[-1, 0]) > 1e10
    assert (branch.multipliers.real > 0).all()


def test_the_readmes_cycles_come_to_their_connection_without_bifurcations(rotation: udd.Branch) -> None:
    cycles = udd.continuation(rotation.find("Hopf")[0])
    assert cycles.points == ()
    assert cycles.ends[1].startswith("a connection near 4.2599490")


def test_the_period_is_the_least_whatever_the_number_of_rounds() -> None:
    # In Lorenz's window about rho = 160 the run nearly comes back after each of 19 rounds.
    orbit = udd.periodic_orbit(lorenz(rho=160.0), [1.0, 1.0, 1.0], settle=100.0)
    assert orbit.period == pytest.approx(1.152948928, abs=1e-8)
    # 32 rounds in as many pieces: the nodes are one state.
    orbit = udd.periodic_orbit(lorenz(rho=232.42857142857144), [1.0, 1.0, 1.0], settle=100.0)
    assert orbit.period == pytest.approx(0.4776215936, abs=1e-8)
    # Thirteen rounds of the figure-eight, asked for by their period.
    known = udd.periodic_orbit(udd.DLE(10.0))
    again = udd.periodic_orbit(udd.DLE(10.0), known.state, period=13 * known.period)
    assert again.period == pytest.approx(known.period, abs=1e-10) and again.symmetric


@pytest.mark.parametrize("w", [7.1, 10.0, 100.0])
def test_the_bound_of_a_period_holds_against_thirty_digits(w: float) -> None:
    orbit = udd.periodic_orbit(udd.DLE(w))
    error = abs(float(Decimal(orbit.period) - symmetric_period(orbit)))
    assert error <= orbit.period_error < 1e-12


# 0.9: the bound was that of the value's rounding, 1e-16, and the error 2e-15.
@pytest.mark.parametrize("B", [0.02, 0.1, 0.2, 0.5, 0.9, 0.99])
def test_the_bound_of_a_hopf_bifurcation_holds(B: float) -> None:
    b = Fraction(B)
    exact = (1 - b) / (b * (1 + b))
    known = float(exact)
    rests = udd.equilibria(udd.DLE(0.8 * known, B=B))
    start = next(rest for rest in rests if rest.state[0] > 1e-3)
    (hopf,) = udd.continuation(start, "w", (0.5 * known, 2.0 * known)).points
    assert abs(float(Fraction(hopf.value) - exact)) <= hopf.error < 1e-12 * max(known, 1.0)
    period = 2 * math.pi / math.sqrt((1 - B) / B)
    assert abs(hopf.period - period) <= hopf.period_error < 1e-9


def test_the_bound_of_where_doublings_accumulate_holds() -> None:
    cascade = udd.cascade(udd.periodic_orbit(udd.DLE(6.0)), "w", n=6)
    # From eleven doublings.
    known = 5.0043826710
    assert abs(cascade.limit - known) < cascade.limit_error < 1e-6
    assert "error below" in repr(cascade)


def test_the_bound_of_a_connection_is_not_zero(rotation: udd.Branch) -> None:
    hopf = rotation.find("Hopf")[0]
    a, b = (udd.connection(udd.continuation(hopf, max_period=period)) for period in (12.0, 18.0))
    # Two that were found from cycles of different length, with pieces of their own.
    assert 0.0 < abs(a.value - b.value) + 1e-15 < a.error + b.error < 1e-11


@pytest.mark.parametrize("B", [0.1, 0.2, 0.5])
def test_where_rotation_becomes_stable(B: float) -> None:
    known = (1.0 - B) / (B * (1.0 + B))
    rests = udd.equilibria(udd.DLE(0.8 * known, B=B))
    branch = udd.continuation(next(r for r in rests if r.state[0] > 0.1), "w", (0.5 * known, 2.0 * known))
    (hopf,) = branch.points
    assert hopf.kind == "Hopf" and hopf.criticality == "subcritical"
    assert hopf.value == pytest.approx(known, abs=1e-10)
    assert hopf.frequency == pytest.approx(math.sqrt((1.0 - B) / B), abs=1e-9)


def test_the_first_lyapunov_coefficient(rotation: udd.Branch) -> None:
    assert rotation.find("Hopf")[0].lyapunov_coefficient == pytest.approx(2.003e-3, rel=5e-4)  # four digits


def test_cycles_are_born_at_the_hopf_bifurcation(rotation: udd.Branch) -> None:
    (hopf,) = rotation.find("Hopf")
    cycles = udd.continuation(hopf, bounds=(0.5, 20.0), max_period=20.0)
    # Subcritical: unstable, on the side where rotation is stable; they tend to a connection.
    assert not cycles.stable.any()
    assert (cycles.values[1:20] > hopf.value).all()
    assert cycles.periods[0] == pytest.approx(math.pi, abs=1e-2)
    assert cycles.ends == ("born at a Hopf", "the period exceeds 20")
    # Near by the amplitude grows with the square root of the distance.
    near = udd.continuation(hopf, amplitude=1e-3, ds=2e-3, ds_max=2e-3, max_points=6)
    low, high = near.extremes
    spread, distance = (high - low)[:, 0], near.values - hopf.value
    assert spread[5] / spread[0] > 5.0
    assert spread[5] / spread[0] == pytest.approx(math.sqrt(distance[5] / distance[0]), rel=0.02)


# The three rotating states at W = 0.0045: one on each side of the kink's and of the smooth fold.
@pytest.mark.parametrize(("low", "high"), [(0.5, 1.2), (1.2, 1.65), (1.66, 3.0)])
def test_a_branch_of_the_disk_goes_through_its_folds(low: float, high: float) -> None:
    disk = udd.Disk(0.0045)
    start = next(rest for rest in udd.equilibria(disk) if low < rest.state[0] < high)
    branch = udd.continuation(start, "W", (0.0005, 0.05))
    kinds = {point.kind: point.value for point in branch.points}
    # k(Omega) Omega^2 = g W has its maximum at Omega = 2 k1/(3 k2), its minimum at the kink.
    top, kink = 2 * 0.103 / (3 * 0.055), (0.103 - 0.012) / 0.055
    assert kinds["fold"] == pytest.approx((0.103 - 0.055 * top) * top**2 / 9.81, abs=1e-12)
    assert kinds["nonsmooth fold"] == pytest.approx(0.012 * kink**2 / 9.81, abs=1e-12)
    assert sorted([branch.values[0], branch.values[-1]]) == pytest.approx([0.0005, 0.05])


def test_the_disks_symmetric_cycle_loses_its_symmetry() -> None:
    branch = udd.continuation(udd.periodic_orbit(udd.Disk(0.088)), "W", (0.07, 0.1))
    (point,) = branch.points
    assert point.kind == "symmetry breaking" and point.error < 1e-9
    # The orbit is its own image half a period later, by another integrator's run over the edge too.
    assert isinstance(point.solution, udd.PeriodicOrbit)
    run = udd.simulate(
        udd.Disk(point.value, edge="ignore"),
        [0.0, point.period / 2],
        point.solution.state,
        method="dop853",
        rtol=1e-12,
        atol=1e-15,
    )
    np.testing.assert_allclose(run.state[-1][:3], point.solution.state[:3] * [-1, -1, 1], atol=1e-9)
    assert udd.periodic_orbit(udd.Disk(point.value - 0.001)).symmetric is False
    assert udd.periodic_orbit(udd.Disk(point.value + 0.001)).symmetric is True


def test_a_pitchfork_of_equilibria_is_a_branch_point() -> None:
    model = udd.Model(["x", "y"], {"x": "r*x - x^3", "y": "-y"}, {"r": -0.5})
    rest = udd.equilibria(model)[0]
    branch = udd.continuation(rest, "r", (-1.0, 1.0))
    (point,) = branch.points
    assert point.kind == "branch point" and point.value == pytest.approx(0.0, abs=1e-9)
    born = udd.continuation(point, bounds=(-1.0, 1.0))
    np.testing.assert_allclose(born.states[-1][0] ** 2, born.values[-1], atol=1e-10)


def test_a_neimark_sacker_bifurcation_is_found() -> None:
    # A rotation with a second oscillator that gains energy at mu = 0: the multipliers of the cycle are
    # exp(2 pi (mu +- i s)).
    model = udd.Model(
        ["x", "y", "u", "v"],
        {
            "x": "x*(1 - x^2 - y^2) - y",
            "y": "y*(1 - x^2 - y^2) + x",
            "u": "mu*u - s*v - u*(u^2 + v^2)",
            "v": "mu*v + s*u - v*(u^2 + v^2)",
        },
        {"mu": -0.2, "s": 0.3},
    )
    orbit = udd.periodic_orbit(model, [1.0, 0.0, 0.0, 0.0], period=6.2)
    assert orbit.period == pytest.approx(2 * math.pi, abs=1e-10)
    branch = udd.continuation(orbit, "mu", (-0.5, 0.5))
    (point,) = branch.points
    assert point.kind == "Neimark-Sacker"
    assert point.value == pytest.approx(0.0, abs=1e-9)
    assert point.frequency == pytest.approx(0.3, abs=1e-8)


def test_where_rotation_becomes_stable_over_the_damping(rotation: udd.Branch) -> None:
    curve = udd.locus(rotation.find("Hopf")[0], "B", (0.05, 0.9))
    w, B = curve.values.T
    assert B[0] == pytest.approx(0.05) and B[-1] == pytest.approx(0.9)
    np.testing.assert_allclose(w, (1 - B) / (B * (1 + B)), rtol=1e-10)
    np.testing.assert_allclose(curve.frequencies, np.sqrt((1 - B) / B), rtol=1e-9)
    # Subcritical for every damping.
    assert (curve.lyapunov_coefficients > 0).all()


def test_a_curve_of_points_that_turns_back_ends(
    rotation: udd.Branch, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(*_: object) -> None:
        raise CorrectorFailed("the curve turns too sharply")

    monkeypatch.setattr(SolutionSurface, "zero", lost)
    curve = udd.locus(rotation.points[0], "B", (0.1, 0.4))
    assert len(curve) == 1 and curve.ends == ("lost: the curve turns too sharply",) * 2


def test_the_fold_of_rotation_over_the_friction_at_rest() -> None:
    start = next(rest for rest in udd.equilibria(udd.Disk(0.004)) if 1.2 < rest.state[0] < 1.65)
    (fold,) = udd.continuation(start, "W", (0.003, 0.05)).find("fold")
    W, k1 = udd.locus(fold, "k1", (0.08, 0.15)).values.T
    np.testing.assert_allclose(W, 4 * k1**3 / (27 * 0.055**2 * 9.81), rtol=1e-10)


def test_damping_moves_where_the_symmetry_breaks(figure_eight: udd.Branch) -> None:
    curve = udd.locus(figure_eight.points[0], "B", (0.0, 0.04), ds=0.2, ds_max=0.5)
    assert curve.ends == ("the bound 0", "the bound 0.04")
    # The same from a branch at that damping.
    there = udd.continuation(udd.periodic_orbit(udd.DLE(9.0, B=0.04)), "w", (5.0, 12.0))
    assert curve.values[-1][0] == pytest.approx(there.find("symmetry breaking")[0].value, abs=1e-9)


def test_rotation_has_a_homoclinic_orbit_as_shilnikov_says() -> None:
    cycles = udd.continuation(
        udd.periodic_orbit(udd.DLE(0.3)), "w", (0.29, 3.0), direction="up", max_period=50.0
    )
    connection = udd.connection(cycles)
    assert connection.kind == "homoclinic" and connection.wild
    assert connection.error < 1e-9
    # The folds of the branch accumulate there, from both sides, at the ratio that the eigenvalues give.
    away = np.array([fold.value for fold in cycles.find("fold")]) - connection.value
    periods = np.array([fold.period for fold in cycles.find("fold")])
    assert (np.sign(away[1:]) == -np.sign(away[:-1])).all()
    assert -away[-1] / away[-2] == pytest.approx(connection.fold_ratio, rel=0.02)
    assert (periods[-1] - periods[-3]) / 2 == pytest.approx(connection.fold_spacing, rel=0.1)
    # Forward from its beginning it leaves and comes back, by another integrator.
    k = len(connection.t) // 2
    run = udd.simulate(
        udd.DLE(connection.value),
        connection.t[k - 3 : k + 4],
        connection.state[k - 3],
        method="dop853",
        rtol=1e-12,
        atol=1e-13,
    )
    np.testing.assert_allclose(run.state, connection.state[k - 3 : k + 4], atol=1e-7)


def test_cycles_of_the_hopf_bifurcation_end_on_the_saddle(rotation: udd.Branch) -> None:
    connection = udd.connection(udd.continuation(rotation.find("Hopf")[0], max_period=16.0))
    np.testing.assert_allclose(connection.equilibrium.state, [0.0, 0.0, 5.0], atol=1e-12)
    longer = udd.continuation(rotation.find("Hopf")[0], max_period=22.0)
    # The cycles come nearer by exp(-0.85 T): the branch itself is not there yet.
    assert longer.values[-1] == pytest.approx(connection.value, abs=1e-6)
    assert connection.error < 1e-9 and not connection.wild


@pytest.mark.nightly  # test_rotation_has_a_homoclinic_orbit_as_shilnikov_says asks the same of the DLE
def test_the_disks_connection_has_cycles_that_wind_towards_it() -> None:
    # From the lower end of the symmetric cycles; 0.0126 is where the folds of the branch born there gather.
    lower = udd.continuation(udd.periodic_orbit(udd.Disk(0.088)), "W", (0.009, 0.09), direction="down")
    born = udd.continuation(lower.find("symmetry breaking")[-1], bounds=(0.005, 0.05), max_period=9.0)
    result = udd.connection(born)
    assert result.kind == "homoclinic" and result.wild and result.error < 1e-9
    folds = np.array([fold.value for fold in born.find("fold")])
    assert folds[-2:].min() < result.value < folds[-2:].max()


def test_a_diagram_joins_what_is_seen_and_what_is_behind_it() -> None:
    diagram = udd.diagram(udd.DLE(6.0), "w", np.linspace(5.2, 7.4, 12), n=40, transient=100, generations=1)
    kinds = {(point.kind, round(point.value, 8)) for point in diagram.points}
    assert kinds == {("symmetry breaking", 7.09642643), ("period doubling", 5.39471322)}
    # Stable branches pass through the points of the scan.
    scan, w = diagram.scan, 6.2
    seen = scan["omega"].sel(w=w, path="up").to_numpy().ravel()
    at = [(branch, orbit) for branch in diagram.branches if branch.kind == "cycle" for orbit in branch.at(w)]
    stable = [orbit for _, orbit in at if orbit.stable]
    assert stable
    section = udd.poincare(udd.DLE(w), n=2, state0=stable[0].state, transient=0, rtol=1e-12, atol=1e-14)
    own = section.component("omega")
    # The scan shows one of two mirror images.
    assert min(np.abs(np.sort(sign * own) - np.unique(seen.round(9))).max() for sign in (1, -1)) < 1e-6
    assert diagram.hysteresis.shape[1] == 2 and len(diagram.as_dict()["branches"]) == len(diagram.branches)


def test_pictures_of_branches(figure_eight: udd.Branch, rotation: udd.Branch) -> None:
    for view in ("section", "extremes", "period"):
        ax = udd.plot.branches([figure_eight], view=view)
        labels = [text.get_text() for text in ax.get_legend().get_texts()]
        assert labels == ["stable", "unstable", "symmetry breaking"]
        ax.figure.clear()
    ax = udd.plot.branches(rotation, component="y")
    assert ax.get_xlabel() == "w" and ax.get_ylabel() == "y [1]"
    labels = [text.get_text() for text in udd.plot.branches(rotation).get_legend().get_texts()]
    assert labels == ["stable", "unstable", "Hopf"]
    with pytest.raises(udd.UddError, match="no branches"):
        udd.plot.branches([])
    with pytest.raises(udd.UddError, match="equilibria have no period"):
        udd.plot.branches(rotation, view="period")
    # Cycles that are all unstable, beside an equilibrium that has no period to be marked.
    cycles = udd.continuation(rotation.points[0], bounds=(3.0, 3.6), ds_max=0.05)
    ax = udd.plot.branches([rotation, cycles], view="period")
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["unstable"]


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from udd.cli import main

    files = [tmp_path / "branches.png", tmp_path / "branches.json"]
    out = [word for path in files for word in ("--out", str(path))]
    code = main(["continuation", "w", "--from", "5", "--to", "9", "--at", "8", "--born", "1", "--json", *out])
    assert code == 0
    data = json.loads(capsys.readouterr().out)
    points = [(p["kind"], round(p["value"], 8)) for branch in data["branches"] for p in branch["points"]]
    assert points == [("symmetry breaking", 7.09642643), ("period doubling", 5.39471322)]
    assert files[0].read_bytes()[:4] == b"\x89PNG"
    assert json.loads(files[1].read_text())["parameter"] == "w"
    assert main(["continuation", "w", "--from", "9", "--to", "5"]) == 1
    assert "must be below" in capsys.readouterr().err


def test_the_command_follows_branches_born_at_mirror_images_once(capsys: pytest.CaptureFixture[str]) -> None:
    from udd.cli import main

    span = ["--from", "3", "--to", "3.7", "--at", "3.2"]
    assert (
        main(["continuation", "w", "--of", "equilibria", "--B", "0.2", *span, "--born", "2", "--json"]) == 0
    )
    result = json.loads(capsys.readouterr().out)["branches"]
    # Two rotating states, mirror images of one another; the cycles born at their Hopf points come once.
    assert [branch["kind"] for branch in result] == ["equilibrium"] * 3 + ["cycle"]


def test_the_command_passes_over_a_branch_that_is_not_found(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from udd.bifurcations import branch_diagram
    from udd.cli import main

    def lost(*_: object, **__: object) -> udd.Branch:
        raise ModelError("the branch is not found")

    monkeypatch.setattr(branch_diagram, "continuation", lost)
    assert main(["continuation", "w", "--from", "6.9", "--to", "7.3", "--born", "1"]) == 0
    out, err = capsys.readouterr()
    assert "symmetry breaking at w = 7.09642643" in out
    assert err.strip() == "udd: warning: w = 7.096426431: the branch is not found"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--component", "Q"], "the state has no component 'Q'; it has omega, y, z"),
        (["--born", "-1"], "--born must not be below 0"),
        (["--out", "branches.txt"], "must end in .json, .png, .svg, .pdf"),
        (["--of", "equilibria", "--view", "period", "--out", "x.png"], "equilibria have no period"),
        (["--state", "0,0,0.1", "--at", "1"], "a cycle at w = 1 is wanted: try another --at"),
    ],
)
def test_the_command_refuses_in_one_sentence(
    options: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from udd.cli import main

    monkeypatch.chdir(tmp_path)
    assert main(["continuation", "w", "--from", "0.5", "--to", "9", *options]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: udd.equilibria(3), "a model is needed"),
        (lambda: udd.periodic_orbit(udd.DLE(7.1), [1.0, 2.0]), "3 components"),
        (lambda: udd.periodic_orbit(udd.DLE(7.1), [1.0, 2.0, 0.0], period=0.01), "no cycle"),
        (lambda: udd.continuation(udd.periodic_orbit(udd.DLE(7.1)), "q"), "no parameter 'q'"),
        (lambda: udd.continuation(udd.periodic_orbit(udd.DLE(7.1)), "w", (8, 9)), "outside the bounds"),
        (lambda: udd.continuation(udd.periodic_orbit(udd.DLE(7.1))), "which parameter"),
        (
            lambda: udd.continuation(udd.periodic_orbit(udd.DLE(7.1)), "w", max_points=0),
            "max_points must be a whole number",
        ),
        (lambda: udd.cascade(udd.periodic_orbit(udd.DLE(6.0)), "w", n=0), "n must be a whole number"),
        (
            lambda: udd.equilibria(udd.DLE(1.0), initial_states="many"),
            "initial_states must be a whole number",
        ),
        (
            lambda: udd.equilibria(udd.Model(["x", "y"], {"x": "sin(t)", "y": "-y"})),
            "depend on time",
        ),
    ],
)
def test_bad_input_gets_a_sentence(call: object, message: str) -> None:
    with pytest.raises(udd.UddError, match=message):
        call()  # type: ignore[operator]


def test_a_multiplier_without_a_sign_of_its_own_decides_nothing() -> None:
    from udd.bifurcations.floquet_multipliers import Multipliers

    one = np.ones(1, dtype=complex)
    assert Multipliers(np.log([3.0]), one, np.array([1e-9])).decided
    # Of the order of 1, and not known: on which side of the unit circle is open.
    assert not Multipliers(np.log([0.9]), one, np.array([2.0])).decided
    assert Multipliers(np.array([-60.0]), one, np.array([2.0])).decided
    # A contact that sticks: a multiplier that is zero.
    assert Multipliers(np.array([-np.inf]), one, np.array([np.inf])).decided


def test_multipliers_that_break_liouvilles_formula_bring_no_bifurcation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from dataclasses import replace

    from udd.bifurcations import floquet_multipliers, orbit_geometry, shooting_curve

    orbit, right = udd.periodic_orbit(udd.DLE(7.3)), floquet_multipliers.multipliers_at

    def wrong(curve: object, u: np.ndarray) -> floquet_multipliers.Multipliers:
        result = right(curve, u)  # type: ignore[arg-type]
        return replace(result, log=result.log + np.array([0.0, 5.0]))

    monkeypatch.setattr(orbit_geometry, "multipliers_at", wrong)
    monkeypatch.setattr(shooting_curve, "multipliers_at", wrong)
    assert udd.continuation(orbit, "w", (6.9, 7.4)).find("symmetry breaking") == []


def test_from_an_attractor_to_its_cycle() -> None:
    scan = udd.bifurcation(udd.DLE(1.0), "w", [1.0, 6.0, 9.0])
    one = scan.isel(path=0, start=0)
    orbit = udd.periodic_orbit(udd.DLE(1.0), one.sel(w=9.0))
    assert orbit.model.parameters["w"] == 9.0 and orbit.symmetric
    assert orbit.period == pytest.approx(float(one["period_time"].sel(w=9.0)), rel=1e-6)
    with pytest.raises(ModelError, match="not periodic"):
        udd.periodic_orbit(udd.DLE(1.0), one.sel(w=1.0))
    with pytest.raises(ModelError, match="select it"):
        udd.periodic_orbit(udd.DLE(1.0), scan)
    with pytest.raises(ModelError, match="a model of Omega"):
        udd.periodic_orbit(udd.Disk(0.06), one.sel(w=9.0))
