"""A camera that was held as perfect, and shows all the same."""

from __future__ import annotations

import numpy as np
import pytest

import udd


def filmed(bend: float, zero: float) -> udd.Measurement:
    """A pendulum with quadratic drag, whose film bends the angle and has its zero elsewhere."""
    t = np.arange(0, 40, 1 / 25)
    truth = udd.Pendulum(0.6, k0=0.004, effects=[udd.effects.quadratic_drag(c=0.006)])
    theta = udd.simulate(truth, t, [0.0, 0.9]).state[:, 1]
    noise = 1e-3 * np.random.default_rng(2).standard_normal(len(t))
    return udd.Measurement(t, {"theta": theta + bend * theta**2 + zero + noise})


@pytest.mark.parametrize(("bend", "zero"), [(0.02, 0.015), (0.0, 0.0)])
def test_what_a_cameras_faults_explain_is_no_claim(bend: float, zero: float) -> None:
    """No form is named for sure where the camera shows; a perfect one held as perfect changes nothing."""
    record, known = filmed(bend, zero), udd.Pendulum(0.6, k0=0.008)
    held = udd.discover(record, known, camera=False)
    said = [remark for remark in held.remarks if "camera=True" in remark]
    if bend:
        assert held.verdict != "effect identified" and (said or not held.effects)
        free = udd.discover(record, known)
        assert free.verdict == "effect identified" and free.excused is None
        assert [e.title for e in free.effects] == ["quadratic drag"]
    else:
        assert held.verdict == "effect identified" and not said and held.excused is None
