"""Angles that a record keeps within one turn, in models of the user's own, whatever they are called."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import udd
from udd.measurement.unwrapping import unwrapped

TURN = 2 * np.pi
ROTOR = udd.Model(["q", "v"], ["v", "-k*sin(q) - c*v"], {"k": 9.0, "c": 0.15}, angles=["q"])


def rotor(n: int = 400) -> udd.Measurement:
    """A pendulum that goes over the top three times."""
    t = 0.02 * np.arange(n)
    q = udd.simulate(ROTOR, t, [0.3, 9.0]).state[:, 0]
    return udd.Measurement(t, {"q": q + 2e-3 * np.random.default_rng(7).standard_normal(n)})


def wrapped(measured: udd.Measurement, low: float = -np.pi) -> udd.Measurement:
    return udd.Measurement(measured.t, (measured.values - low) % TURN + low, names=measured.names)


@pytest.mark.parametrize("low", [-np.pi, 0.0])
def test_a_wrapped_angle_of_any_name_is_fitted_as_the_continuous_one(low):
    start = ROTOR.with_parameters({"k": 8.5, "c": 0.1})
    right, result = udd.fit(rotor(), start), udd.fit(wrapped(rotor(), low), start)
    assert not right.doubts.missing and not result.doubts.missing
    assert right.errors["k"] < 2e-3
    for name in ("k", "c"):
        assert result.parameters[name] == pytest.approx(right.parameters[name], abs=1e-3 * right.errors[name])
        assert result.errors[name] == pytest.approx(right.errors[name], rel=1e-3)
    assert np.abs(np.diff(result.measurement["q"])).max() < 0.5


def test_nothing_is_missing_in_a_wrapped_angle():
    result = udd.discover(wrapped(rotor(600)), ROTOR)
    assert result.verdict == "nothing missing"


def test_two_wrapped_angles_with_gaps_and_sensors():
    """Sensors of angles count modulo a turn; of rows that lack one the others are not lost."""
    equations = {"a": "u", "u": "-4*sin(a) - 0.1*u + 0.5*sin(b - a)", "b": "w", "w": "-0.2*w"}
    model = udd.Model(list(equations), equations, angles=["a", "b"], observe={"enc": "a", "arm": "b + z"},
                      parameters={"z": 0.2})  # fmt: skip
    t = 0.02 * np.arange(500)
    states = udd.simulate(model, t, [0.5, 3.0, 0.0, 4.0]).state
    seen = states[:, [0, 2]] + [0.0, 0.2] + 2e-3 * np.random.default_rng(1).standard_normal((500, 2))
    seen[100:130, 1] = np.nan
    record = udd.Measurement(t, {"enc": seen[:, 0], "arm": seen[:, 1]})
    assert model.turning == ("enc", "arm")
    for low in (-np.pi, 0.0):
        again = unwrapped(wrapped(record, low), model.turning)
        turns = (again.values - record.values) / TURN
        assert np.nanmax(np.abs(turns - np.round(turns))) < 1e-9
        assert np.nanmax(np.abs(np.diff(again.values, axis=0))) < 0.5


def test_rounding_does_not_hide_that_an_angle_is_wrapped():
    """Six digits of pi, twice, are more than a turn."""
    angle = np.round((0.05 * np.arange(300) + np.pi) % TURN - np.pi, 3)
    angle[[10, 11]] = 3.142, -3.142
    assert np.ptp(angle) > TURN
    assert np.ptp(unwrapped(udd.Measurement(np.arange(300.0), {"q": angle}), ["q"]).values) > 2 * TURN


def test_frames_that_are_not_usable_move_no_other_by_a_turn():
    angle = 0.4 * np.arange(60.0)
    angle = (angle + np.pi) % TURN - np.pi
    flag = np.full(60, "")
    angle[20], flag[20] = angle[20] + 2.9, "lost: elsewhere"
    angle[21], flag[21] = angle[21] - 2.9, "lost: elsewhere"
    once = unwrapped(udd.Measurement(np.arange(60.0), {"theta": angle}, flag=flag))
    good = flag == ""
    assert np.ptp(once["theta"][good] - 0.4 * np.arange(60.0)[good]) < 1e-9


def test_what_is_no_angle_of_the_model_stays_and_is_reported():
    plain = udd.Model(["q", "v"], ["v", "-k*sin(q) - c*v"], {"k": 9.0, "c": 0.15})
    with pytest.warns(UserWarning, match=r'q jumps by a turn.* angles=\["q"\] to udd.Model'):
        result = udd.fit(wrapped(rotor()), plain)
    assert np.ptp(result.measurement["q"]) < TURN


def test_the_kind_or_the_model_says_which_columns_are_angles(tmp_path: Path):
    """A column called theta may be anything in a model of the user's own."""
    t, q = 0.05 * np.arange(100), (0.3 * np.arange(100) + np.pi) % TURN - np.pi
    for header, states, within in [
        ("t,theta", None, False),
        ("t,theta,x", ["theta", "x"], True),
        ("t,q", ["q"], True),
    ]:
        columns = [t, q, q][: len(header.split(","))]
        path = tmp_path / "record.csv"
        np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
        assert (np.ptp(udd.read_measurement(path, states=states).values[:, 0]) <= TURN) == within


def test_noise_is_smoothed_over_a_wrap_only_if_the_column_is_an_angle():
    record = rotor()
    sigma = np.full((len(record), 1), 2e-3)
    stated = udd.Measurement(record.t, wrapped(record).values, sigma, names=("q",))
    quiet = udd.smooth(stated, angles=["q"])
    truth = udd.simulate(ROTOR, record.t, [0.3, 9.0]).state[:, 0]
    assert np.abs(quiet["q"] - truth).max() < 6e-3
    with pytest.raises(udd.UddError, match="angles must be a list of columns"):
        udd.smooth(stated, angles=["r"])


def test_a_forecast_knows_a_wrapped_record_by_its_rows():
    record = wrapped(rotor())
    fitted = udd.fit([record, wrapped(rotor(300))], ROTOR)
    ahead = udd.forecast(record, fitted, t=0.5, members=4, rng=1)
    assert np.abs(ahead.median[0] - fitted.measurements[0]["q"][-1]).max() < 0.3
