"""The related systems: each with the relation that makes it one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import simpson

import udd
from udd import related_systems as systems

Array = NDArray[np.float64]

TIGHT = {"rtol": 1e-12, "atol": 1e-14}


def last(model: udd.Model, t: float, state: list[float]) -> Array:
    return udd.simulate(model, t, state, method="taylor", **TIGHT).state[-1]


def test_lorenz_in_the_variables_of_the_dle_is_lorenz() -> None:
    w, epsilon, b = 2.0, 0.1, 8 / 3
    sigma = 1 / epsilon
    r = w * sigma**2 / b
    omega, y, z = last(systems.scaled_lorenz(w, epsilon, b), 5.0, [1.0, 1.0, 0.01])
    each = last(systems.lorenz(sigma, r, b), 5.0 / sigma, [sigma, sigma, r - sigma * 0.01])
    # Both are exact: what is left is the integration error, 1e-12 grown by the chaos of 5 units of time.
    np.testing.assert_allclose([sigma * omega, sigma * y, r - sigma * z], each, rtol=1e-9)


def test_lorenz_becomes_the_dle_as_diffusion_vanishes() -> None:
    start = [1.0, 1.0, 0.01]
    limit = last(udd.DLE(1.0), 5.0, start)
    gaps = [np.abs(last(systems.scaled_lorenz(1.0, e), 5.0, start) - limit).max() for e in (1e-4, 5e-5)]
    # The difference is of first order in epsilon: halving it halves the gap, but for terms of second order.
    assert gaps[0] / gaps[1] == pytest.approx(2.0, abs=0.01)
    assert gaps[1] < 1e-3


def test_lorenz_strongly_driven_has_the_exponent_of_the_dle() -> None:
    close = udd.lyapunov(systems.scaled_lorenz(1.0, 1e-4), t=2e4, tol=0.005, state0=[1.0, 1.0, 0.01])
    # 0.21016 is the DLE's; the error bar of 2e4 units of time is 0.003.
    assert close == pytest.approx(0.21016, abs=0.012)


@pytest.mark.parametrize("leakage", [0.0, 0.05])
def test_the_waterwheel_is_lorenz_with_b_1_and_without_leakage_the_dle(leakage: float) -> None:
    states = np.random.default_rng(1).normal(size=(20, 3))
    wheel = systems.waterwheel(3.9, leakage).rates(0.0, states)
    np.testing.assert_allclose(
        wheel, systems.scaled_lorenz(3.9, leakage, b=1.0).rates(0.0, states), rtol=1e-15
    )
    if leakage == 0.0:
        np.testing.assert_array_equal(wheel, udd.DLE(3.9).rates(0.0, states))


def test_a_waterwheel_in_other_units_has_the_drive_that_is_said() -> None:
    inflow, friction, gravity = 0.3, 1.7, 6.0
    omega, a, b = last(systems.waterwheel(inflow, 0.0, friction, gravity), 4 / friction, [friction, 0.4, 0.1])
    unit = gravity / friction**2
    dle = last(udd.DLE(gravity * inflow / friction**3), 4.0, [1.0, unit * 0.4, unit * 0.1])
    np.testing.assert_allclose([omega / friction, unit * a, unit * b], dle, rtol=1e-9)


def test_the_pendulum_is_the_dle_without_a_drive() -> None:
    r, theta = 7.0, 2.5
    v, end = last(systems.pendulum(r), 6.0, [0.3, theta])
    dle = last(udd.DLE(0.0), 6.0, [0.3, -r * np.sin(theta), -r * np.cos(theta)])
    np.testing.assert_allclose(dle, [v, -r * np.sin(end), -r * np.cos(end)], rtol=1e-9, atol=1e-11)


def test_the_disk_without_a_drive_is_a_pendulum_in_si_units() -> None:
    k, radius, theta = 0.02, 0.058, 1.0
    disk = last(
        udd.Disk(0.0, k0=k, k1=k, k2=0.0), 3.0, [0, -radius * np.sin(theta), -radius * np.cos(theta), 0]
    )
    each = last(udd.Pendulum(radius, inertia=0.08**2 / 2 + radius**2, k0=k), 3.0, [0.0, theta])
    np.testing.assert_allclose(disk[0], each[0], rtol=1e-9)
    np.testing.assert_allclose(disk[3], each[1] - theta, rtol=1e-9)


def test_a_steady_torque_turns_the_pendulum_or_holds_it() -> None:
    fixed = last(systems.pendulum(1.0, 1.0, 0.9), 60.0, [0.0, 0.0])
    # It rests where gravity balances the torque; exp(-60/2) of the start is left.
    np.testing.assert_allclose(fixed, [0.0, np.arcsin(0.9)], atol=1e-9)
    turning = systems.pendulum(1.0, 1.0, 3.0)
    rounds = udd.simulate(turning, np.arange(0, 80, 0.01), [0.0, 0.0], rtol=1e-10)
    passes = np.interp(2 * np.pi * np.arange(15, 25), rounds.theta, rounds.t)
    # Rotation is a limit cycle: the rounds' times settle on one value. Friction eats the torque's work:
    # <v> = torque / friction less the ripple, which is of second order in r / torque.
    assert np.ptp(np.diff(passes)) < 1e-5  # linear interpolation between samples 0.01 apart
    assert 2 * np.pi / np.diff(passes).mean() == pytest.approx(3.0, rel=0.05)


def test_a_small_periodic_torque_gives_the_linear_response() -> None:
    r, friction, amplitude, frequency = 4.0, 0.5, 1e-4, 1.5
    model = systems.torqued_pendulum(r, friction, amplitude, frequency)
    t = np.linspace(0, 200, 20001)
    run = udd.simulate(model, t, [0.0, 0.0], rtol=1e-10, atol=1e-16)
    late = t > 100  # exp(-friction t/2) has gone
    closed = amplitude / np.hypot(r - frequency**2, friction * frequency)
    assert np.abs(run.theta[late]).max() == pytest.approx(closed, rel=1e-4)  # sampling of the maxima


def test_a_strong_periodic_torque_gives_chaos() -> None:
    # The textbook's case; a periodic orbit would have zero within a few errors.
    model = systems.torqued_pendulum(1.0, 0.5, 1.5, 2 / 3)
    exponent, error = udd.lyapunov(model, t=2e4, tol=0.005, state0=[0.0, 1.0], with_error=True)
    assert exponent > 10 * error > 0


def growth(model: udd.Model, t: float, start: list[float]) -> float:
    """Rate at which the largest swings grow, from the last third against the first."""
    run = udd.simulate(model, np.linspace(0, t, 6001), start, rtol=1e-10, atol=1e-18)
    thirds = np.array_split(np.arange(6001), 3)
    first, last_ = (np.abs(run.theta[k]).max() for k in (thirds[0], thirds[2]))
    at = [run.t[k][np.abs(run.theta[k]).argmax()] for k in (thirds[0], thirds[2])]
    return float(np.log(last_ / first) / (at[1] - at[0]))


def test_shaking_amplifies_as_mathieu_says() -> None:
    model = systems.shaken_pendulum(1.0, 0.02, 0.2, 2.0)
    # amplitude/(4 sqrt(r)) - friction/2, to first order in the amplitude: the next is about 1 % of it.
    assert growth(model, 150.0, [0.0, 1e-8]) == pytest.approx(0.2 / 4 - 0.01, rel=0.03)
    assert growth(model.replace(friction=0.2), 150.0, [0.0, 1e-8]) < 0


@pytest.mark.parametrize(("amplitude", "stays"), [(40.0, True), (20.0, False)])
def test_a_fast_shaken_pendulum_stands_on_its_head(amplitude: float, stays: bool) -> None:
    # Kapitza's bound is amplitude > sqrt(2) * 20 = 28.3.
    theta = last(systems.shaken_pendulum(1.0, 0.1, amplitude, 20.0), 200.0, [0.0, 3.0])[1]
    assert (abs(theta - np.pi) < 1e-3) == stays


def test_pumping_by_the_clock_grows_as_said() -> None:
    # 3/4 of the length's amplitude, to first order; the next order is of the amplitude squared.
    model = systems.pumped_pendulum(1.0, 0.0, 0.02, 2.0)
    assert growth(model, 500.0, [0.0, 1e-8]) == pytest.approx(0.75 * 0.02, rel=0.03)


def test_a_rider_multiplies_the_swing_every_half_period() -> None:
    model = systems.pumped_swing(1.0, depth=0.05, quickness=2000.0, sharpness=1e9)
    ends = udd.poincare(model, "v", 8, state0=[0.0, 0.002, 1.05], direction="both", transient=1, t_max=100.0)
    ratios = np.abs(ends.component("theta")[1:] / ends.component("theta")[:-1])
    # The rider takes 1/2000 of the unit of time, in which the swing goes on.
    np.testing.assert_allclose(ratios, (1.05 / 0.95) ** 1.5, rtol=2e-3)


def test_lengths_must_stay_positive() -> None:
    with pytest.raises(udd.UddError, match="must stay positive"):
        systems.pumped_pendulum(1.0, 0.0, 1.0, 2.0)
    with pytest.raises(udd.UddError, match="depth must be between 0 and 1"):
        systems.pumped_swing(1.0, depth=1.2)


@pytest.mark.parametrize("swing", [0.1, 0.8, 1.4])
def test_between_cycloidal_cheeks_every_swing_takes_as_long(swing: float) -> None:
    r = 2.3
    quarter = last(systems.cycloidal_pendulum(r), np.pi / 2 / np.sqrt(r), [0.0, swing])
    assert abs(quarter[1]) < 1e-10
    # Between plain walls it would not: the largest of these swings takes 14 % longer.
    assert abs(last(systems.pendulum(r, 0.0), np.pi / 2 / np.sqrt(r), [0.0, swing])[1]) > 1e-5


def test_the_droplets_waves_are_an_integral_over_its_past() -> None:
    R, memory = 3.0, 7.0
    t = np.linspace(0.0, 6.0, 6001)
    # Its place is one more state, by which the waves are looked up.
    model = udd.Model(
        ["v", "y", "z", "x"],
        {"v": "y - v", "y": f"v*z - y/{memory}", "z": f"{R} - v*y - z/{memory}", "x": "v"},
        {},
    )
    v, y, z, x = udd.simulate(model, t, [0.4, 0.0, 0.0, 0.0], method="taylor", **TIGHT).state.T
    each = udd.simulate(
        systems.walking_droplet(R, memory), t, [0.4, 0.0, 0.0], method="taylor", **TIGHT
    ).state
    np.testing.assert_allclose(each, np.stack([v, y, z], axis=1), atol=1e-9)
    weight = R * np.exp(-(t[-1] - t) / memory)
    # Simpson's rule over 6000 steps of 0.001: its error is below 1e-10.
    assert y[-1] == pytest.approx(simpson(weight * np.sin(x[-1] - x), x=t), abs=1e-8)
    assert z[-1] == pytest.approx(simpson(weight * np.cos(x[-1] - x), x=t), abs=1e-8)


def test_the_droplet_is_lorenz_and_with_infinite_memory_the_dle() -> None:
    states = np.random.default_rng(1).normal(size=(20, 3))
    np.testing.assert_array_equal(
        systems.walking_droplet(3.9).rates(0.0, states), udd.DLE(3.9).rates(0.0, states)
    )
    np.testing.assert_allclose(
        systems.walking_droplet(3.9, 20.0).rates(0.0, states),
        systems.scaled_lorenz(3.9, 0.05, b=1.0).rates(0.0, states),
        rtol=1e-14,
    )


@pytest.mark.parametrize("bad", [{"R": 0.0}, {"R": 1.0, "memory": -1.0}, {"R": 1.0, "memory": float("nan")}])
def test_a_droplet_needs_waves_and_a_memory(bad: dict[str, float]) -> None:
    with pytest.raises(udd.UddError, match=r"R|memory"):
        systems.walking_droplet(**bad)
