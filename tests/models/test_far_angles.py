"""Sine, cosine and tangent of angles far from zero in formulas."""

from __future__ import annotations

import numpy as np

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
