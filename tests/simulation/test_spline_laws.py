"""Runs of laws with splines: each cell of a spline has a power series."""

from __future__ import annotations

import numpy as np
import pytest

import udd

COEFFICIENTS = np.array([0.3, -1.0, 0.8, 1.2, -0.6, 0.1, -1.4, 0.9, 0.5, -0.2, 1.1, -0.7])
CURVES = [
    udd.effects.curve("vertical", "Z", -0.03, 0.03, 1e-3 * COEFFICIENTS),
    udd.effects.curve("friction", "abs(Omega)", 0.5, 6.0, 0.01 * np.abs(COEFFICIENTS)),
    udd.effects.curve("torque", "beta", 0.0, 2 * np.pi, 1e-5 * COEFFICIENTS, periodic=True),
]
T = np.arange(0.0, 3.0, 0.04)
START = [0.0, 0.001, 0.02, 0.0]


@pytest.mark.parametrize("curve", CURVES, ids=lambda curve: f"{curve.name}-{curve.slots[0]}")
def test_the_series_of_each_cell_follows_a_curve(curve):
    """Within and beyond its range, also where the coordinate turns back to a cell."""
    model = udd.Disk(0.03, effects=[curve])
    exact = udd.simulate(model, T, START, rtol=1e-13, atol=1e-15, method="dop853").state
    run = udd.simulate(model, T, START, rtol=1e-9, atol=1e-12)
    assert run.stats.method == "taylor"
    off = np.abs(run.state - exact).max(axis=0) / np.ptp(exact, axis=0)
    # Forty random curves: at most 5e-8 by the series, 2e-7 by dop853, 3e-7 by dopri5.
    assert off.max() < 5e-7


def test_a_curve_has_the_same_law_in_a_packet():
    model = udd.Disk(0.03, effects=CURVES[:1])
    starts = np.array([START, [1.0, 0.01, 0.01, 0.5], [-2.0, -0.02, 0.025, 1.0]])
    together = udd.ensemble(model, T, starts, method="taylor")
    for start, states in zip(starts, together.state, strict=True):
        alone = udd.simulate(model, T, start, method="taylor").state
        assert np.abs(states - alone).max() < 1e-6


def test_the_motion_depends_on_a_coefficient_in_the_same_way():
    """The slope of the motion with a coefficient does not depend on the method."""
    step = 1e-6
    coefficients = 1e-3 * COEFFICIENTS
    runs = []
    for sign in (-1, 1):
        moved = coefficients.copy()
        moved[5] += sign * step
        model = udd.Disk(0.03, effects=[udd.effects.curve("vertical", "Z", -0.03, 0.03, moved)])
        runs.append([udd.simulate(model, T[:20], START, method=m).state for m in ("taylor", "dop853")])
    slopes = (np.array(runs[1]) - np.array(runs[0])) / (2 * step)
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-3, atol=1e-4)
