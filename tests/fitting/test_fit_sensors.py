"""Fits of models that are seen through sensors: gains, offsets, delays, and rates of their own."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
from udd.errors import FitError, ModelError

T = np.arange(0.0, 20.0, 0.02)
TRUTH = {"k": 21.3, "c": 0.13, "gain": 2.5, "zero": 0.3, "bias": 0.2, "late": 0.03}
SWING = udd.Model(
    ["theta", "w"],
    ["w", "-k*sin(theta) - c*w"],
    TRUTH,
    angles=["theta"],
    observe={"volts": "gain*theta + zero", "gyro": "w + bias"},
    delays={"gyro": "late"},
)
OFF = SWING.with_parameters({"k": 18.0, "c": 0.3, "gain": 2.0, "zero": 0.0, "bias": 0.0, "late": 0.0})
NOISE = (0.02, 0.03)


def seen(seed: int, model: Any = SWING, noise: Any = NOISE, t: Any = T) -> udd.Measurement:
    rng = np.random.default_rng(seed)
    run = udd.simulate(model, t, [rng.uniform(1.0, 2.0), rng.uniform(-1.0, 1.0)], rtol=1e-10, atol=1e-12)
    values = model.observed(t, run.state)
    values = values + rng.normal(size=values.shape) * noise
    return udd.Measurement(t, dict(zip(model.channels, values.T, strict=True)))


def test_a_late_sensor_sees_the_state_of_before() -> None:
    def law(_t: float, x: Any) -> Any:
        return [x[1], -TRUTH["k"] * np.sin(x[0]) - TRUTH["c"] * x[1]]

    now = np.array([1.2, -0.7])
    before = solve_ivp(law, (0.0, -TRUTH["late"]), now, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    # One Runge-Kutta step of order four: (omega tau)^5/120 of a radian, omega = 4.6 rad/s.
    assert abs(SWING.observed(0.0, now)[1] - (before[1] + TRUTH["bias"])) < 5e-6
    assert SWING.observed(0.0, now)[0] == TRUTH["gain"] * now[0] + TRUTH["zero"]


def test_gain_zero_bias_and_delay_are_found() -> None:
    pulls = []
    for seed in range(8):
        result = udd.fit(seen(seed), OFF)
        pulls.append([(result.parameters[n] - value) / result.errors[n] for n, value in TRUTH.items()])
    # 48 pulls: the largest of as many normal ones exceeds 4.3 in 1 of 1000, and their mean square is
    # chi2/48: within 0.5 to 1.8 but in 1 of 1000.
    assert np.abs(pulls).max() < 4.3
    assert 0.5 < np.square(pulls).mean() < 1.8


def test_sensors_have_rates_and_clocks_of_their_own() -> None:
    gyro_times = np.arange(0.0031, 20.0, 1 / 31.0)
    t = np.union1d(T, gyro_times)
    whole = seen(3, t=t)
    volts = np.where(np.isin(t, T), whole["volts"], np.nan)
    gyro = np.where(np.isin(t, gyro_times), whole["gyro"], np.nan)
    result = udd.fit(udd.Measurement(t, {"volts": volts, "gyro": gyro}), OFF)
    for name, value in TRUTH.items():
        assert abs(result.parameters[name] - value) < 4.0 * result.errors[name], name
    # Nothing is made up where a sensor was silent.
    assert np.isfinite(result.misfit).sum() == len(T) + len(gyro_times)


def test_the_step_of_an_encoder_is_its_noise() -> None:
    counts = SWING.replace(observe={"counts": "theta + zero"}, delays={})
    smooth = seen(1, counts, noise=0.0)
    step = 2 * np.pi / 500
    coarse = udd.Measurement(T, {"counts": step * np.round(smooth["counts"] / step)})
    result = udd.fit(coarse, counts.with_parameters({"k": 18.0, "zero": 0.0}), free=["k", "c", "zero"])
    assert abs(result.parameters["k"] / TRUTH["k"] - 1.0) < 1e-3
    assert abs(result.parameters["zero"] - TRUTH["zero"]) < 4.0 * result.errors["zero"] < 1e-2
    (reading,) = result.doubts.sensor
    assert abs(reading.step / step - 1.0) < 1e-6
    assert abs(reading.noise / (step / np.sqrt(12.0)) - 1.0) < 0.3


def test_an_angle_is_one_for_a_sensor_too() -> None:
    sensors = {"read": "theta + zero", "volts": "gain*theta", "other": "-theta"}
    wide = udd.Model(
        ["theta", "w", "u"], ["w", "-sin(theta)", "-u"], {"zero": 0.1, "gain": 1.0}, angles=["theta"],
        observe=sensors,
    )  # fmt: skip
    assert wide.turning == ("read", "other")  # volts only by the accident that its gain is 1
    assert udd.Model(["theta"], ["-theta"], observe={"y": "theta"}).turning == ()


def test_where_a_tip_is_tells_both_angles() -> None:
    arm = udd.pendulum_chain([1.0, 1.0], [0.5, 0.4], [0.25, 0.2], [0.09, 0.05], friction=[0.02, 0.02])
    tips = {
        "x1": "l1*sin(a1)", "y1": "-l1*cos(a1)",
        "x2": "l1*sin(a1) + l2*sin(a2)", "y2": "-l1*cos(a1) - l2*cos(a2)",
    }  # fmt: skip
    arm = arm.replace(parameters=dict(arm.values) | {"l2": 0.4}, observe=tips)
    t = np.arange(0.0, 6.0, 0.01)
    start = [0.8, -0.5, 0.0, 0.0]
    run = udd.simulate(arm, t, start, rtol=1e-10, atol=1e-12)
    rng = np.random.default_rng(5)
    values = arm.observed(t, run.state) + 1e-3 * rng.normal(size=(len(t), 4))
    measured = udd.Measurement(t, dict(zip(tips, values.T, strict=True)))
    result = udd.fit(measured, arm.with_parameters({"b1": 0.01, "b2": 0.03}), free=["b1", "b2", "l1", "l2"])
    for name in ("b1", "b2", "l1", "l2"):
        assert abs(result.parameters[name] - arm.parameters[name]) < 4.0 * result.errors[name], name


def test_an_accelerometer_feels_what_is_missing() -> None:
    """Its reading contains the rate of a state, that of an effect that was added among it."""
    cart = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": 9.0, "c": 0.1}, observe={"a": "v'"})
    drag = udd.effects.formula("v'", "q*abs(v)*v", q=-0.2)
    state = np.array([0.5, 2.0])
    assert cart.with_effects([drag]).observed(0.0, state)[0] == pytest.approx(-4.5 - 0.2 - 0.8, abs=1e-14)


def test_a_phone_on_a_pendulum_has_more_sensors_than_states() -> None:
    """A gyroscope and an accelerometer of two axes: one along the rod, one across it."""
    phone = udd.Model(
        ["theta", "w"],
        ["w", "-g*sin(theta)/l - c*w"],
        {"g": 9.81, "l": 0.6, "c": 0.08, "r": 0.2, "bias": 0.05, "tilt": 0.02},
        angles=["theta"],
        observe={
            "gyro": "w + bias",
            "along": "g*cos(theta + tilt) + r*w^2",
            "across": "g*sin(theta + tilt) + r*w'",
            "check": "theta",
        },
    )
    names = ["l", "c", "r", "bias", "tilt"]
    pulls = []
    for seed in range(6):
        measured = seen(seed, phone, noise=[0.02, 0.05, 0.05, 0.01])
        alone = udd.Measurement(measured.t, {name: measured[name] for name in ("gyro", "along", "across")})
        result = udd.fit(alone, phone.with_parameters({"l": 0.55, "c": 0.1, "r": 0.25, "bias": 0.0}), names)
        pulls.append([(result.parameters[n] - phone.parameters[n]) / result.errors[n] for n in names])
    # 30 pulls: the largest of as many normal ones exceeds 4.2 in 1 of 1000, their mean square 2 as rarely.
    assert np.abs(pulls).max() < 4.2
    assert 0.3 < np.square(pulls).mean() < 2.0


def test_what_is_missing_is_found_through_a_gyroscope_alone() -> None:
    baseline = udd.Model(
        ["theta", "w"], ["w", "-k*sin(theta) - c*w"], {"k": 21.3, "c": 0.05, "bias": 0.1},
        angles=["theta"], observe={"gyro": "w + bias"},
    )  # fmt: skip
    truth = baseline.with_effects([udd.effects.formula("w'", "q*abs(w)*w", q=-0.08)])
    result = udd.discover(seen(2, truth, noise=0.01), baseline)
    assert result.verdict == "effect identified"
    (effect,) = result.effects
    assert "abs(w)*w" in effect.expression or "w*abs(w)" in effect.expression
    assert result.error_after.whole < 0.3 * result.error_before.whole


def test_forecasts_are_of_the_sensors() -> None:
    measured = seen(4)
    ahead = udd.forecast(measured, OFF, start=12.0, t=2.0)
    assert ahead.names == ("volts", "gyro")
    truth = np.column_stack([np.interp(ahead.t, measured.t, column) for column in measured.values.T])
    assert np.abs(ahead.median - truth).max() < 0.4  # noise of 0.02 and 0.03, 4 swings of 3 V


def test_it_comes_back_the_same() -> None:
    assert pickle.loads(pickle.dumps(SWING)) == SWING
    assert "observe={'volts': 'gain*theta + zero', 'gyro': 'w + bias'}" in repr(SWING)
    assert SWING.replace(c=0.2).channels == ("volts", "gyro")
    assert SWING.with_term("w", "w^3", cubic=0.0).observe == SWING.observe


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"observe": ["theta"]}, "observe must be a table of sensors and formulas, not"),
        ({"observe": {"a b": "theta"}}, "a sensor's name must be a single word other than t, not 'a b'"),
        ({"observe": {"y": "gian*theta"}}, "what y sees has the unknown name gian"),
        ({"observe": {"y": "theta = 3"}}, "what y sees has =, but only what is seen is wanted"),
        ({"observe": {f"y{k}": "w" for k in range(13)}}, "a model has at most 12 sensors, not 13"),
        ({"observe": {"y": "w"}, "delays": {"y": "late"}}, "the delay of y must be one of the parameters"),
        ({"observe": {"y": "w"}, "delays": {"z": "c"}}, "inputs are none and the sensors y"),
        ({"observe": {"u": "w"}, "inputs": ["u"]}, "a sensor has the name of the input u"),
    ],
)
def test_what_is_wrong_is_told(options: dict[str, Any], told: str) -> None:
    with pytest.raises(ModelError, match=told):
        udd.Model(["theta", "w"], ["w", "-theta - c*w"], {"c": 0.1}, **options)


def test_a_column_that_no_sensor_has_is_told() -> None:
    with pytest.raises(FitError, match="columns theta, gyro, but the model's sensors are volts, gyro"):
        udd.fit(udd.Measurement(T, {"theta": np.sin(T), "gyro": np.cos(T)}), SWING)


def test_a_late_sensor_of_a_driven_machine_sees_through_the_steps_of_its_input() -> None:
    rng = np.random.default_rng(0)
    fixed = udd.InputSignal(np.arange(0, 10.05, 0.05), rng.normal(size=201), hold="zero")
    cart = udd.Model(
        ["x", "v"],
        ["v", "-4*x - 0.5*v + 20*u"],
        {"d": 0.12},
        inputs=["u"],
        observe={"g": "v"},
        delays={"g": "d"},
    )
    t = np.arange(1.0, 9.0, 0.0137)
    now, before = (
        udd.simulate(
            cart, [0.0, *at], [0.2, 0.0], inputs={"u": fixed}, method="dop853", rtol=1e-11, atol=1e-12
        )
        for at in (t, t - 0.12)
    )
    seen = cart.with_inputs({"u": fixed}).observed(t, now.state[1:])[:, 0]
    # The way back is followed to 1e-8.
    assert np.abs(seen - before.v[1:]).max() < 1e-6


def test_columns_with_gaps_are_not_averaged_in_blocks() -> None:
    t = np.arange(0.0, 90.0, 0.01)
    swing = udd.Model(["a", "b"], ["b", "-k*a"], {"k": 4.0})
    rng = np.random.default_rng(0)
    a = np.cos(2 * t) + 1e-3 * rng.normal(size=len(t))
    b = -2 * np.sin(2 * t) + 1e-3 * rng.normal(size=len(t))
    b[::7] = np.nan
    result = udd.discover(udd.Measurement(t, {"a": a, "b": b}), swing)
    assert result.verdict == "nothing missing" and not result.thinned


@pytest.mark.parametrize("few", [0, 1, 9])
def test_a_column_that_is_hardly_there_is_told(few: int) -> None:
    values = np.cos(T)
    other = np.where(np.arange(len(T)) < few, -np.sin(T), np.nan)
    swing = udd.Model(["a", "b"], ["b", "-k*a"], {"k": 1.0})
    with pytest.raises(FitError, match=f"b was observed in {few} rows; a column needs at least 10"):
        udd.fit(udd.Measurement(T, {"a": values, "b": other}), swing)


def test_where_a_sensor_has_no_value_a_start_is_asked_for() -> None:
    level = udd.Model(["h", "w"], ["w", "-k*(h - 2)"], {"k": 4.0}, observe={"p": "sqrt(h)"})
    run = udd.simulate(level, T, [2.5, 0.0])
    seen = level.observed(T, run.state)[:, 0] + 1e-3 * np.random.default_rng(0).normal(size=len(T))
    measured = udd.Measurement(T, {"p": seen})
    with pytest.raises(FitError, match="no value around h = 0, w = 0: say where the motion starts"):
        udd.fit(measured, level)
    assert abs(udd.fit(measured, level, state0={"h": 2.0}).parameters["k"] - 4.0) < 1e-3


@pytest.mark.parametrize("ruler", [0.5, 0.75, 0.9])
def test_a_gyroscope_measures_the_length_whatever_was_given_to_begin_with(ruler: float) -> None:
    from udd.measurement import read_gyroscope

    seen = read_gyroscope(udd.examples.path("phone.csv"))
    fit = udd.fit(seen, udd.Pendulum(ruler).with_gyroscope())
    assert abs(fit.parameters["length"] - 0.8) < 4 * fit.errors["length"] < 0.001
    # The inertia that is given stays: only the length is fitted.
    heavy = udd.fit(seen, udd.Pendulum(ruler, inertia=0.58).with_gyroscope())
    assert heavy.parameters["length"] == pytest.approx(0.58 / 0.8, rel=1e-3)
