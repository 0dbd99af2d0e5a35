"""Stiff models: recognised, told, and run by a method for them."""

from __future__ import annotations

import time
import warnings

import numpy as np
import pytest

import udd
from udd.errors import ModelError


def van_der_pol(mu: float) -> udd.Model:
    return udd.Model(["x", "v"], ["v", "mu*(1 - x^2)*v - x"], {"mu": mu})


def robertson() -> udd.Model:
    return udd.Model(
        ["a", "b", "c"],
        ["-0.04*a + 1e4*b*c", "0.04*a - 1e4*b*c - 3e7*b^2", "3e7*b^2"],
    )


@pytest.mark.parametrize("method", ["dopri5", "dop853", "taylor"])
def test_a_stiff_run_is_told_within_a_second(method: str) -> None:
    # The slow branch alone takes a million steps. A warning made an error ends the run.
    begun = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("error", udd.StiffnessWarning)
        with pytest.raises(udd.StiffnessWarning, match=r"held down by stability.*rodas"):
            udd.simulate(van_der_pol(1e3), [0, 3000], [2.0, 0.0], method=method)
    assert time.perf_counter() - begun < 1.0


@pytest.mark.parametrize(
    ("model", "start", "end"),
    [
        (udd.Model(["x", "v"], ["v", "-x"]), [1.0, 0.0], 3e4),
        (udd.Model(["x", "y", "z"], ["10*(y - x)", "x*(28 - z) - y", "x*y - 8/3*z"]), [1.0, 1.0, 1.0], 600.0),
        (van_der_pol(3.0), [2.0, 0.0], 3e3),
    ],
)
@pytest.mark.parametrize("method", ["dopri5", "dop853", "taylor", "auto"])
def test_what_is_not_stiff_is_not_told(model: udd.Model, start: list[float], end: float, method: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for rtol in (1e-4, 1e-9):
            run = udd.simulate(model, [0, end], start, method=method, rtol=rtol, atol=1e-3 * rtol)
            assert run.stats.accepted > 5000 or rtol > 1e-9 or method in ("dop853", "taylor", "auto")


@pytest.mark.parametrize("method", ["rodas", "auto"])
def test_van_der_pols_oscillator(method: str) -> None:
    # E. Hairer and G. Wanner, Solving ODEs II, test set: VDPOL with mu = 1000 at t = 2000.
    begun = time.perf_counter()
    run = udd.simulate(van_der_pol(1e3), [0, 2000], [2.0, 0.0], method=method, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(run.state[-1], [1.706167732170469, -0.8928097010248125e-3], rtol=1e-6)
    assert time.perf_counter() - begun < 2.0
    assert run.stats.accepted < 20_000


@pytest.mark.parametrize("method", ["rodas", "auto"])
def test_robertsons_reaction(method: str) -> None:
    # Mazzia and Magherini, Test Set for IVP Solvers (2008): ROBER, by PSIDE at t = 1e11; Hairer's at t = 4e7.
    times = [0.0, 0.4, 40.0, 4e4, 4e7, 1e11]
    run = udd.simulate(robertson(), times, [1.0, 0.0, 0.0], method=method, rtol=1e-9, atol=1e-16)
    np.testing.assert_allclose(run.state.sum(axis=1), 1.0, rtol=1e-10)
    np.testing.assert_allclose(
        run.state[-1], [0.2083340149701255e-07, 0.8333360770334713e-13, 0.9999999791665050], rtol=1e-5
    )
    # A. Hindmarsh's table for LSODE.
    np.testing.assert_allclose(run.state[1], [9.8517e-01, 3.3864e-05, 1.4794e-02], rtol=5e-5)
    np.testing.assert_allclose(run.state[2], [7.1583e-01, 9.1855e-06, 2.8416e-01], rtol=5e-5)


def test_dense_output_and_order() -> None:
    model = udd.Model(["x", "y"], ["y*cos(t)", "-x*y + sin(t)"])
    best = udd.simulate(model, [0, 2], [0.7, 0.4], method="dop853", rtol=1e-13, atol=1e-15, dense=True)
    times, steps = np.linspace(0, 2, 101), []
    for rtol in (1e-6, 1e-9):
        run = udd.simulate(model, [0, 2], [0.7, 0.4], method="rodas", rtol=rtol, atol=rtol, dense=True)
        np.testing.assert_allclose(run(times), best(times), atol=30 * rtol)
        steps.append(run.stats.accepted)
    # An error estimate of order 4: a thousandth of it takes 4 times as many steps (5.6 of order 3).
    assert 3.0 < steps[1] / steps[0] < 5.0


def test_an_ensemble_refuses() -> None:
    with pytest.raises(ModelError, match=r"for single runs, by udd\.simulate"):
        udd.ensemble(van_der_pol(1e3), [0, 1], [[2.0, 0.0]], method="rodas")
