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
    spread = {name: np.full(len(t), own) for name, own in zip(("Y", "Z", "beta"), noise, strict=True)}
    return udd.Measurement(t, dict(zip(spread, values.T, strict=True)), sigma=spread)


def fits(seen: udd.Measurement) -> tuple[udd.Fit, udd.Fit]:
    """Return the fits of the compiled disk and of the text, with the same priors."""
    priors = {name: (VALUES[name], VALUES[name] * (0.05 if name == "W" else 1.0)) for name in NAMES}
    compiled, written = (
        udd.fit(seen, model, NAMES, camera=False, priors=priors)
        for model in (udd.Disk(0.039, edge="ignore"), text())
    )
    return compiled, written


@pytest.mark.parametrize(("seed", "sigma"), [(1, 5e-4), (2, 5e-5), (3, 5e-4)])
def test_a_right_law_has_the_same_numbers_and_standard_errors(seed: int, sigma: float) -> None:
    compiled, written = fits(record(seed, sigma))
    assert compiled.level > compiled.problem.right and compiled.level == written.level
    for name in NAMES:
        assert written.errors[name] == pytest.approx(compiled.errors[name], rel=0.01), name
        assert abs(written.parameters[name] - compiled.parameters[name]) < 0.02 * compiled.errors[name], name


def test_a_wrong_law_is_fixed_as_tightly_either_way() -> None:
    compiled, written = fits(record(4, 1e-4, relaxation=2.0))
    assert compiled.level == written.level < compiled.problem.right
    assert compiled.doubts.missing and written.doubts.missing
    for name in NAMES:
        assert written.errors[name] == pytest.approx(compiled.errors[name], rel=0.01), name


def test_standard_errors_are_those_of_the_law_itself() -> None:
    """Scaled errors of 16 records, four numbers each, correlated: their r.m.s. scatters by about 15 %."""
    z = []
    for seed in range(16):
        fit = udd.fit(record(seed, 5e-5), udd.Disk(0.039, edge="ignore"), NAMES, camera=False)
        z.append([(fit.parameters[name] - VALUES[name]) / fit.errors[name] for name in NAMES])
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.4
