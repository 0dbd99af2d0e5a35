"""Models with up to twelve states, whose arrays also have unused components."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import udd
from many_states import chain, chain_rates, ring, ring_rates
from udd.errors import ModelError


def start(n: int) -> NDArray[np.float64]:
    return np.linspace(0.8, -0.6, 2 * n)


def reference(n: int, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """By SciPy's DOP853, at the least tolerance that it takes."""
    run = solve_ivp(chain_rates, (0.0, t[-1]), start(n), "DOP853", t, rtol=1e-12, atol=1e-13)
    return np.asarray(run.y.T)


@pytest.mark.parametrize("n", [4, 6])
def test_a_chain_of_oscillators_agrees_with_scipy(n: int) -> None:
    t = np.linspace(0.0, 20.0, 101)
    wanted = reference(n, t)
    # Growth of an error of 1e-12 a step: neighbouring orbits diverge by e^(0.1 t) at most.
    bounds = {"dopri5": 1e-9, "dop853": 1e-9, "taylor": 1e-9, "auto": 1e-9, "rodas": 1e-7}
    for method, bound in bounds.items():
        tolerance = 1e-9 if method == "rodas" else 1e-12
        run = udd.simulate(chain(n), t, start(n), method=method, rtol=tolerance, atol=0.1 * tolerance)
        assert run.state.shape == (101, 2 * n)
        np.testing.assert_allclose(run.state, wanted, atol=bound, rtol=0.0, err_msg=method)


@pytest.mark.parametrize("n", range(4, 13))
def test_every_number_of_states_runs(n: int) -> None:
    model, first = ring(n), np.sin(np.arange(n)) + 2.0
    np.testing.assert_allclose(model.rates(0.0, first), ring_rates(first), rtol=1e-13)
    t = np.linspace(0.0, 2.0, 21)
    run = udd.simulate(model, t, first, rtol=1e-12, atol=1e-12, dense=True)
    wanted = solve_ivp(lambda _, x: ring_rates(x), (0.0, 2.0), first, "DOP853", t, rtol=1e-12, atol=1e-12).y.T
    # The largest exponent is below 3 for F = 8: e^6 times the errors of some hundred steps.
    np.testing.assert_allclose(run.state, wanted, atol=1e-8, rtol=0.0)
    assert run(0.55).shape == (n,)
    np.testing.assert_allclose(run(t), run.state, atol=1e-9, rtol=0.0)


def test_idle_states_are_not_seen() -> None:
    """A run of seven states is that of eight of which the last one rests, but for its steps."""
    seven = [f"x{i}" for i in range(7)]
    texts = [f"-{i + 1}*x{i} + sin(x{(i + 1) % 7}) + abs(x{i})" for i in range(7)]
    small = udd.Model(seven, texts)
    large = udd.Model([*seven, "rest"], [*texts, "0"])
    x0 = np.linspace(1.0, -1.0, 7)
    a = udd.simulate(small, 3.0, x0, rtol=1e-10, atol=1e-12)
    b = udd.simulate(large, 3.0, [*x0, 0.0], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(a.state[-1], b.state[-1, :7], atol=1e-9, rtol=0.0)
    assert a.state.shape[1] == 7 and all(event.state.shape == (7,) for event in a.events)
    assert len(a.events) > 0  # where |x| has its kink
    with pytest.raises(ModelError, match="7 components"):
        udd.simulate(small, 1.0, np.ones(8))


@pytest.mark.parametrize("n", [7, 8, 11, 12])
def test_ensembles_are_the_runs_one_by_one(n: int) -> None:
    model = ring(n)
    starts = np.random.default_rng(n).normal(2.0, 1.0, (5, n))
    t = np.linspace(0.0, 1.0, 6)
    many = udd.ensemble(model, t, starts)
    assert many.state.shape == (5, 6, n)
    for own, first in zip(many.state, starts, strict=True):
        np.testing.assert_allclose(own, udd.simulate(model, t, first).state, atol=1e-7, rtol=0.0)


def test_inputs_of_many_states() -> None:
    """A chain that is driven through an input of straight pieces, against a run from piece to piece."""
    names = [f"x{i}" for i in range(9)]
    texts = [f"u - x{i} + 0.3*x{i - 1}" if i else "u - x0" for i in range(9)]
    model = udd.Model(names, texts, inputs=["u"])
    times, values = np.arange(0.0, 2.01, 0.25), np.sin(3.0 * np.arange(0.0, 2.01, 0.25))
    run = udd.simulate(
        model, 2.0, np.zeros(9), inputs={"u": udd.InputSignal(times, values)}, rtol=1e-11, atol=1e-12
    )
    x = np.zeros(9)
    lag = np.eye(9, k=-1) * 0.3 - np.eye(9)
    for a, b in itertools.pairwise(times):
        piece = solve_ivp(
            lambda t, x: lag @ x + np.interp(t, times, values), (a, b), x, "DOP853", rtol=1e-12, atol=1e-13
        )
        x = piece.y[:, -1]
    np.testing.assert_allclose(run.state[-1], x, atol=1e-9, rtol=0.0)


def test_equilibria_of_many_states() -> None:
    """F in every component is Lorenz's equilibrium; its eigenvalues are those of a circulant matrix."""
    n = 7
    results = [e for e in udd.equilibria(ring(n)) if np.allclose(e.state, 8.0)]
    assert len(results) == 1 and results[0].state.shape == (n,)
    k = 2.0 * np.pi * np.arange(n) / n
    wanted = 8.0 * (np.exp(1j * k) - np.exp(-2j * k)) - 1.0
    np.testing.assert_allclose(
        np.sort_complex(np.round(results[0].eigenvalues, 9)), np.sort_complex(np.round(wanted, 9)), atol=1e-7
    )


@pytest.mark.parametrize("n", [7, 12])
def test_exponents_of_many_states_add_up_to_the_divergence(n: int) -> None:
    spectrum = udd.lyapunov_spectrum(ring(n), t=20.0, transient=5.0, tol=10.0, state0=np.arange(float(n)))
    assert spectrum.exponents.shape == (n,)
    assert spectrum.exponents.sum() == pytest.approx(-n, abs=1e-6)
    drives, options = np.linspace(7.0, 9.0, 5), {"t": 20.0, "tol": 10.0, "state0": np.arange(float(n))}
    many = udd.lyapunov(ring(n), parameters={"F": drives}, **options)
    alone = [udd.lyapunov(ring(n).replace(F=drive), **options) for drive in drives]
    # One in each lane of a packet, with the same bits.
    np.testing.assert_array_equal(many, alone)


def test_sections_of_many_states_agree_with_scipy() -> None:
    n = 8
    section = udd.poincare(ring(n), "x0 - 2", 4, state0=np.arange(8.0), direction="up", transient=0)

    def surface(_t: float, x: NDArray[np.float64]) -> float:
        return float(x[0] - 2.0)

    surface.direction = 1.0  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda _t, x: ring_rates(x),
        (0.0, 6.0),
        np.arange(8.0),
        "DOP853",
        rtol=1e-12,
        atol=1e-13,
        events=surface,
    )
    np.testing.assert_allclose(section.t[:3], run.t_events[0][:3], atol=1e-8)
    np.testing.assert_allclose(section.state[:3], run.y_events[0][:3], atol=1e-7)


def test_a_cycle_of_eight_states_has_the_multipliers_of_its_divergence() -> None:
    """Beyond its Hopf bifurcation the ring has a travelling wave."""
    model = ring(8).replace(F=1.5)
    wave = udd.simulate(model, [0.0, 200.0], 1.5 + 0.1 * np.cos(np.arange(8.0))).state[-1]
    cycle = udd.periodic_orbit(model, wave)
    turn = udd.simulate(model, [0.0, cycle.period], cycle.state, rtol=1e-12, atol=1e-13).state[-1]
    np.testing.assert_allclose(turn, cycle.state, atol=1e-8)
    assert cycle.multipliers.shape == (7,)  # without the trivial one
    assert np.log(np.abs(cycle.multipliers)).sum() == pytest.approx(-8.0 * cycle.period, rel=1e-3)
