"""Sine, cosine and tangent of angles far from zero in formulas."""

from __future__ import annotations

import numpy as np
import pytest

import udd


def test_formulas_of_large_angles_are_exact() -> None:
    # From mpmath.
    exact = {1e12: -0.6112387023768895, 1e18: -0.9929693207404051, 1e22: -0.8522008497671888}
    for angle, sine in exact.items():
        for text, value in (
            (f"sin({angle!r}*x)", sine),
            (f"cos({angle!r}*x)^2", 1.0 - sine**2),
            (f"tan({angle!r}*x)^2", sine**2 / (1.0 - sine**2)),
        ):
            law = udd.Model(["x"], [text], {})
            assert np.isclose(law.rates(0.0, [[1.0]]).item(), value, rtol=1e-13), text


def test_packets_of_large_angles_have_the_bits_of_single_runs() -> None:
    law = udd.Model(["x"], ["sin(1e17*t + x) - x"], {})
    starts = np.linspace(0.0, 1.0, 24)[:, None]
    many = udd.ensemble(law, 1e-16, starts, method="dopri5")
    for start, end in zip(starts, many.end, strict=True):
        assert np.array_equal(udd.simulate(law, [0.0, 1e-16], start, method="dopri5").state[-1], end)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "taylor", "rodas", "auto"])
def test_the_hyperbolic_sine_of_small_numbers_is_not_zero(method: str) -> None:
    """As half a difference of exponentials it was 0 below 1e-16, and a run stood still there."""
    sizes = np.array([1e-300, 1e-139, 1e-20, 1e-8, 0.1, 1.0, 30.0, 700.0])
    law = udd.Model(["x"], ["sinh(x)"])
    for sign in (1.0, -1.0):
        result = law.rates(0.0, sign * sizes[:, None])[:, 0]
        np.testing.assert_allclose(result, np.sinh(sign * sizes), rtol=1e-14)
    run = udd.simulate(law, 2.0, [1e-20], method=method, atol=1e-40)
    assert run.state[-1, 0] == pytest.approx(1e-20 * np.exp(2.0), rel=1e-7)
