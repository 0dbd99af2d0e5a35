"""A law as text and the same law compiled: fits with the same numbers and standard errors."""

from __future__ import annotations

import numpy as np
import pytest

import udd

NAMES = ("k0", "k1", "k2", "W")
VALUES = {"W": 0.039, "k0": 0.012, "k1": 0.103, "k2": 0.055, "g": 9.81, "R": 0.08}


def text() -> udd.Model:
    """Return the disk as text."""
    rate = "(g*Y - max(k1 - k2*abs(Omega), k0)*Omega - Z*W*Omega)/(R^2/2 + Y^2 + Z^2)"
    equations = {"Omega": rate, "Y": "Z*Omega", "Z": "W - Y*Omega", "beta": "Omega"}
    return udd.Model(list(equations), equations, VALUES)


def record(seed: int, sigma: float, **effects: float) -> udd.Measurement:
    """Return a chaotic record of 20 s with white noise."""
    rng = np.random.default_rng(seed)
    t, noise = np.arange(0.0, 20.0, 0.04), sigma * np.array([1.0, 1.0, 14.0])
    disk = udd.Disk(0.039, edge="ignore", effects=[udd.effects.relaxation(b=b) for b in effects.values()])
    start = [3.75 + rng.normal(), 0.0046, 0.001 * rng.normal(), 0.0]
    motion = udd.simulate(disk, t, start, rtol=1e-11, atol=1e-12).state[:, 1:]
    values = motion + noise * rng.standard_normal(motion.shape)
    spread = {name: np.full(len(t), sd) for name, sd in zip(("Y", "Z", "beta"), noise, strict=True)}
    return udd.Measurement(t, dict(zip(spread, values.T, strict=True)), sigma=spread)


def fitted(seen: udd.Measurement, model: udd.models.Model) -> udd.Fit:
    """Return a fit by the same priors for either model."""
    priors = {name: (VALUES[name], VALUES[name] * (0.05 if name == "W" else 1.0)) for name in NAMES}
    return udd.fit(seen, model, NAMES, camera=False, priors=priors)


@pytest.mark.parametrize(("seed", "sigma"), [(0, 5e-5), (1, 5e-4), (2, 5e-5)])
def test_a_right_law_has_the_same_numbers_and_standard_errors(seed: int, sigma: float) -> None:
    seen = record(seed, sigma)
    compiled, written = fitted(seen, udd.Disk(0.039, edge="ignore")), fitted(seen, text())
    for name in NAMES:
        # The noise of a disk may grow with its speed, a text's may not: a few records differ by 1 to 4 %.
        assert written.errors[name] == pytest.approx(compiled.errors[name], rel=0.01), name
        assert abs(written.parameters[name] - compiled.parameters[name]) < 0.1 * compiled.errors[name], name
    assert not compiled.doubts.missing and not written.doubts.missing


def test_standard_errors_are_those_of_the_law_itself() -> None:
    """Scaled errors of 24 records, four numbers each, correlated: their r.m.s. scatters by about 12 %."""
    z = []
    for seed in range(24):
        fit = fitted(record(seed, 5e-5), udd.Disk(0.039, edge="ignore"))
        z.append([(fit.parameters[name] - VALUES[name]) / fit.errors[name] for name in NAMES])
    # With the last level's model error it is 0.7.
    assert 0.85 < np.sqrt(np.mean(np.square(z))) < 1.4


def test_a_wrong_law_keeps_the_model_error_that_its_record_needs() -> None:
    fit = fitted(record(4, 1e-4, relaxation=2.0), udd.Disk(0.039, edge="ignore"))
    assert fit.limit is None and fit.doubts.missing


def test_a_budget_moves_the_numbers_at_their_own_model_error() -> None:
    fit = fitted(record(1, 5e-5), udd.Disk(0.039, edge="ignore"))
    assert fit.limit is not None
    budget = fit.budget(fixed={"g": 1e-9})
    # At another model error the numbers would move without any change of gravity.
    share = budget.contributions[:, budget.sources.index("g")]
    assert (share < 0.02 * np.array([fit.errors[name] for name in NAMES])).all()
