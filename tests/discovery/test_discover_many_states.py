"""Missing terms of a chain of four oscillators, which has eight states."""

from __future__ import annotations

import numpy as np

import udd
from many_states import chain
from udd.discovery.scoring.term_library import terms


def test_a_cubic_spring_of_one_oscillator_of_four_is_named() -> None:
    t = 0.1 * np.arange(120)
    true = chain(4, v3="-0.5*x3^3")
    state = udd.simulate(true, t, 1.2 * np.cos(np.arange(8.0)), rtol=1e-10).state
    noisy = state + 0.01 * np.random.default_rng(0).standard_normal(state.shape)
    baseline = chain(4)
    seen = udd.Measurement(t, dict(zip(baseline.state_names, noisy.T, strict=True)))
    result = udd.discover(seen, baseline)
    assert result.verdict == "effect identified"
    (effect,) = result.effects
    assert effect.title == "x3^3 in v3'"
    (value,) = effect.parameters.values()
    (error,) = effect.errors.values()
    assert abs(value + 0.5) < 4.0 * error < 0.1


def test_the_library_stays_bounded() -> None:
    """Twelve states get squares and cubes, no products of three; angles get no products with states."""
    listed = [c.title for c in terms(chain(6))]
    # In each of six equations: a constant, 12 states, their 78 products, 12 cubes and 12 times their sizes.
    assert len(listed) == 6 * (1 + 12 + 78 + 12 + 12)
    assert {"x3^3 in v3'", "x2*v5 in v1'", "abs(v6)*v6 in v6'"} <= set(listed)
    assert "x1*x2*x3 in v1'" not in listed
    names = [name for i in range(6) for name in (f"q{i}", f"w{i}")]
    texts = [text for i in range(6) for text in (f"w{i}", f"-sin(q{i})")]
    swings = udd.Model(names, texts, angles=names[::2])
    per_equation = len(terms(swings)) / 6
    # 6 speeds: 1 + 6 + 21 + 6 + 6; 6 angles and 15 differences: sine, cosine and the sine of twice.
    assert per_equation == 40 + 3 * 21
    assert "sin(q1 - q2) in w3'" in [c.title for c in terms(swings)]
