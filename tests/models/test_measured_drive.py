"""Disk and pendulum with a measured drive."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
from udd.errors import FitError, MeasurementError, ModelError

T = np.linspace(0.0, 4.0, 9)


def test_with_a_steady_drive_it_is_the_disk() -> None:
    friction = {"k0": 0.002, "k1": 0.012, "k2": 0.001}
    steady = udd.InputSignal([0.0, 10.0], [0.042, 0.042])
    driven = udd.driven_disk(**friction).with_inputs({"W": steady, "W_rate": steady.rate()})
    states = np.random.default_rng(1).normal(size=(20, 4)) * [8.0, 0.02, 0.02, 3.0]
    plain = udd.Disk(W=0.042, R=0.06, **friction)
    np.testing.assert_allclose(driven.rates(0.0, states), plain.rates(0.0, states), rtol=1e-13)


def test_the_disk_obeys_newton_where_its_drive_changes() -> None:
    """Force and torque about the centre, at the contact, from accelerations by differences of the orbit."""
    drive = udd.InputSignal(T, 0.04 + 0.02 * np.sin(3.0 * T))
    model = udd.driven_disk(0.06, k0=0.01).with_inputs({"W": drive, "W_rate": drive.rate()})
    h = 1e-4
    t = 1.13 + h * np.arange(-2, 3)
    start = udd.simulate(model, [1.0, *t], [0.3, 0.01, -0.02, 0.0], method="dop853", rtol=1e-13, atol=1e-15)
    omega, y, z, _ = start.state[1:].T
    weights = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12 * h**2)
    force = np.array([weights @ y, weights @ z + 9.81])
    turn = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12 * h) @ omega
    # The contact lies at -(Y, Z) from the centre; a clockwise rotation is positive. Rounding: 1e-15/h^2.
    torque = -z[2] * force[0] + y[2] * force[1] - 0.01 * omega[2]
    assert abs(0.06**2 / 2 * turn - torque) < 1e-7


def test_a_pendulum_whose_pivot_is_moved() -> None:
    """In the laboratory's frame: a point mass on a rod whose upper end moves, by Lagrange's equations."""
    x = udd.InputSignal(np.linspace(0.0, 5.0, 201), 0.1 * np.sin(np.linspace(0.0, 10.0, 201)), hold="cubic")
    acceleration = x.rate().rate()
    still = udd.InputSignal([0.0, 5.0], [0.0, 0.0])
    model = udd.moved_pendulum(0.4).with_inputs({"ax": acceleration, "az": still})

    def law(t: float, state: Any) -> Any:
        omega, theta = state
        return [-(9.81 * np.sin(theta) - 0.4 * np.sin(2 * t) * np.cos(theta)) / 0.4, omega]

    run = udd.simulate(model, T, [0.0, 0.5], method="auto", rtol=1e-10, atol=1e-12)
    truth = solve_ivp(law, (0.0, 4.0), [0.0, 0.5], method="DOP853", t_eval=T, rtol=1e-12, atol=1e-13).y.T
    # The spline's second derivative is accurate to h^2/12 of the fourth: 2e-4 of 0.4 m/s^2, but not at its
    # ends.
    np.testing.assert_allclose(run.state, truth, atol=2e-3)


def test_rates_of_signals() -> None:
    t = np.linspace(0.0, 3.0, 61)
    smooth = udd.InputSignal(t, np.sin(t), hold="cubic").rate()
    assert np.abs(smooth(t)[5:-5] - np.cos(t)[5:-5]).max() < 1e-5
    with pytest.raises(MeasurementError, match="hold='zero' jumps and has no rate"):
        udd.InputSignal(t, np.sin(t), hold="zero").rate()


def test_a_pendulum_with_a_gyroscope() -> None:
    plain = udd.Pendulum(0.5, inertia=0.3, k0=0.02)
    model = plain.with_gyroscope(angle=True)
    states = np.random.default_rng(0).normal(size=(50, 2))
    # The same sum, but for the order of its factors.
    np.testing.assert_allclose(model.rates(0.0, states), plain.rates(0.0, states), rtol=1e-14)
    seen = model.replace(bias=0.1, theta0=-0.2).observed(0.0, states)
    np.testing.assert_allclose(seen, states + np.array([0.1, -0.2]), rtol=1e-15)
    with pytest.raises(ModelError, match="cannot have coulomb"):
        udd.Pendulum(0.5, effects=udd.effects.coulomb(c=0.1)).with_gyroscope()
    rates = udd.Measurement(np.arange(20) * 0.1, {"Omega": np.zeros(20)})
    with pytest.raises(FitError, match="with_gyroscope"):
        udd.fit(rates, plain)


def test_what_a_gyroscope_shows_is_enough_to_find_drag() -> None:
    t = np.arange(0, 25, 0.04)
    drag = udd.effects.quadratic_drag(c=0.02)
    rate = udd.simulate(udd.Pendulum(0.5, k0=0.002, effects=drag), t, [0.0, 1.2]).Omega
    seen = rate + 0.05 + 0.01 * np.random.default_rng(3).normal(size=len(t))
    baseline = udd.Pendulum(0.5, k0=0.002).with_gyroscope()
    result = udd.discover(udd.Measurement(t, {"Omega": seen}), baseline)
    assert [added.title for added in result.effects] == ["abs(Omega)*Omega in Omega'"]
    (c,) = result.effects[0].effect.values
    # Over the inertia, 0.25 m^2.
    assert abs(c + 0.02 / 0.25) < 4 * result.fit.errors["abs_Omega_Omega_in_Omega.c"]
