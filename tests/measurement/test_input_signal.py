"""Measured inputs between their samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import udd
from udd.measurement import MeasurementError

T = np.array([0.0, 0.3, 0.5, 1.1, 1.2])
U = np.array([1.0, -2.0, 0.5, 0.7, 3.0])
AT = np.linspace(0.0, 1.2, 241)


def test_straight_lines_are_numpys() -> None:
    np.testing.assert_allclose(udd.InputSignal(T, U)(AT), np.interp(AT, T, U), atol=1e-14)


def test_a_held_sample_lasts_until_the_next() -> None:
    fixed = udd.InputSignal(T, U, hold="zero")
    assert fixed([0.0, 0.29, 0.3, 1.19, 1.2]).tolist() == [1.0, 1.0, -2.0, 0.7, 3.0]


def test_the_spline_is_natural() -> None:
    spline = CubicSpline(T, U, bc_type="natural")
    np.testing.assert_allclose(udd.InputSignal(T, U, hold="cubic")(AT), spline(AT), atol=1e-13)


@pytest.mark.parametrize(
    ("t", "values", "hold", "says"),
    [
        ([0.0, 1.0], [1.0], "linear", "as many samples as times"),
        ([0.0, 1.0, 1.0], [1.0, 2.0, 3.0], "linear", "must increase; sample 2"),
        ([0.0, 1.0], [1.0, np.nan], "linear", "samples must be a list of finite numbers"),
        ([0.0, 1.0], ["a", "b"], "linear", "samples must be numbers"),
        ([0.0, 1.0], [1.0, 2.0], "quintic", "hold must be one of zero, linear, cubic"),
    ],
)
def test_bad_inputs_are_named(t: list[float], values: list[float], hold: str, says: str) -> None:
    with pytest.raises(MeasurementError, match=says):
        udd.InputSignal(t, values, hold)  # type: ignore[arg-type]
