"""Lifetimes of transients, against the reference list."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import ModelError


def test_chaos_beside_stable_rotation_lasts_as_long_as_is_known() -> None:
    model = udd.DLE(3.7, B=0.2)
    rotation = [rest for rest in udd.equilibria(model) if rest.stable]
    middle = np.array([np.sqrt(3.7), np.sqrt(3.7), -3.2])
    starts = middle + 0.05 * np.random.default_rng(3).normal(size=(128, 3))
    lifetimes = udd.lifetimes(model, starts, rotation, t_max=30_000.0, after=1500.0)
    # The reference list's mean, of another code: 26800.
    assert abs(lifetimes.mean - 26800.0) < 3.0 * lifetimes.standard_error
    ended = (lifetimes.settled & (lifetimes.time > 1500.0)).sum()
    assert ended > 20 and lifetimes.standard_error == pytest.approx(lifetimes.mean / np.sqrt(ended))
    # How near is near does not matter, but for the time that the last of the way takes.
    other = udd.lifetimes(model, starts, rotation, t_max=30_000.0, after=1500.0, near=0.1)
    np.testing.assert_array_equal(other.settled, lifetimes.settled)
    assert other.mean == pytest.approx(lifetimes.mean, rel=0.02)


def test_what_settles_at_once_and_what_never_does() -> None:
    oscillator = udd.Model(["x", "v"], ["v", "(1 - x^2)*v - x"])
    cycle = udd.periodic_orbit(oscillator, [2.0, 0.0], settle=50.0)
    result = udd.lifetimes(oscillator, [[2.0, 0.0], [0.01, 0.0]], cycle, t_max=100.0, after=0.0)
    assert result.settled.all() and result.time[0] < 3.0 < 5.0 < result.time[1] < 30.0
    chaos = udd.DLE(10.0)
    never = udd.lifetimes(chaos, [[1.0, 1.0, 0.01]], udd.periodic_orbit(chaos), t_max=0.5)
    assert not never.settled.any() and never.mean == np.inf and np.isnan(never.standard_error)


def test_only_stable_attractors_keep_anything() -> None:
    model = udd.DLE(2.0)
    with pytest.raises(ModelError, match="a stable equilibrium or cycle is needed"):
        udd.lifetimes(model, [[1.0, 1.0, 0.0]], udd.equilibria(model)[0], t_max=10.0)
    with pytest.raises(ModelError, match="at least one attractor"):
        udd.lifetimes(model, [[1.0, 1.0, 0.0]], [], t_max=10.0)
