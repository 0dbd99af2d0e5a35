"""Block means of records with uneven or missing frames."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.fitting.thinning import thinned

N, STEP, NOISE = 3000, 0.03, 3e-4


def _times(kind: str, rng: np.random.Generator) -> np.ndarray:
    t = STEP * np.arange(N)
    if kind == "uneven":
        return np.sort(t + rng.uniform(-0.3, 0.3, N) * STEP)
    return t[rng.uniform(size=N) > 0.04] if kind == "missing" else t


def _motion(t: np.ndarray) -> np.ndarray:
    return 0.1 * np.cos(4.0 * t) * np.exp(-0.02 * t)


@pytest.mark.parametrize("kind", ["even", "uneven", "missing"])
def test_block_means_follow_the_motion(kind: str) -> None:
    rng = np.random.default_rng(1)
    t = _times(kind, rng)
    x = _motion(t) + NOISE * rng.standard_normal(len(t))
    result = thinned(udd.Measurement(t, {"x": x}, inputs={"F": np.sin(t)}))
    means = result.measurement
    assert result.every > 1
    assert len(means) > 0.97 * len(t) / result.every
    off = (means.values[:, 0] - _motion(means.t))[1:]
    expected = NOISE / np.sqrt(result.every)
    assert np.sqrt(np.mean(off**2)) < 1.15 * expected
    # The motion's curvature leaves no bias.
    curved = _motion(means.t[1:])
    assert abs(off @ curved / np.linalg.norm(curved)) < 4 * expected


def test_a_cart_with_uneven_frames_lacks_nothing() -> None:
    rng = np.random.default_rng(2)
    cart = udd.Model(["x", "v"], {"x": "v", "v": "F - k*x - c*v"}, {"k": 17.4, "c": 0.13}, inputs=["F"])
    t = _times("uneven", rng)
    force = np.sin(1.7 * t)
    x = udd.simulate(cart, t, [0.05, 0.0], inputs={"F": force}).state[:, 0]
    record = udd.Measurement(t, {"x": x + NOISE * rng.standard_normal(N)}, inputs={"F": force})
    discovery = udd.discover(record, cart.replace(k=17.6))
    assert discovery.verdict == "nothing missing"
