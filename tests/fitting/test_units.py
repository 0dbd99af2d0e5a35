"""Numbers in another unit than they are taken to be in, and strong effects that are not taken for that."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

import discovered
import simulated
import udd
from udd.errors import FitError
from udd.report import as_text, summary_of

E = udd.effects
DRIVE = 0.039
STRONG = {
    "none": [],
    "relaxation": [E.relaxation(b=12.0)],
    "beta": [E.formula("torque", "-0.03*Omega*exp(3*(cos(beta - 1.1) - 1))", name="hidden")],
    "slip": [E.formula("vertical", "-0.012*tanh(Z/0.01)", name="hidden")],
}


@functools.cache
def record(hidden: str, seed: int = 2, duration: float = 40.0) -> udd.Measurement:
    """A film of a disk at a drive that is 2 % faster than stated."""
    truth = udd.Disk(1.02 * DRIVE, effects=STRONG[hidden])
    return simulated.film(truth, np.random.default_rng(seed), duration)[0]


def scaled(measured: udd.Measurement, **factors: float) -> udd.Measurement:
    """The same with columns multiplied."""
    sizes = np.array([factors.get(name, 1.0) for name in measured.names])
    return udd.Measurement(measured.t * factors.get("t", 1.0), measured.values * sizes)


@pytest.mark.parametrize("hidden", ["relaxation", "beta", "slip"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_strong_effect_is_no_wrong_unit(hidden, seed):
    # The fit may go anywhere, and does: what the effect does goes into drive, clock and scale.
    found = udd.fit(record(hidden, seed), udd.Disk(DRIVE))
    assert found.parameters["W"] > 0 and abs(found.parameters["clock"]) < 0.5


def test_a_strong_relaxation_is_found_with_the_drive_as_stated():
    truth = udd.Disk(DRIVE, effects=STRONG["relaxation"])
    measured, _states = simulated.film(truth, np.random.default_rng(2), 40.0)
    found = udd.discover(measured, udd.Disk(DRIVE))
    assert found.verdict == "effect identified"
    assert {"relaxation", "slip"} >= {f.effect.name for f in found.effects} and len(found.effects) == 1
    assert abs(found.fit.parameters["W"] / DRIVE - 1) < 0.01
    ((pull, error),) = [(f.parameters[a], f.errors[a]) for f in found.effects for a in f.effect.amplitudes]
    pull, error = (pull, error) if pull > 1 else (-pull / DRIVE, error / DRIVE)
    assert abs(pull - 12.0) < 4.5 * np.hypot(error, 0.004 * 12)


@pytest.mark.parametrize("hidden", STRONG)
@pytest.mark.parametrize("factor", [0.01, 0.1, 10, 100, 1000])
def test_a_drive_in_another_unit_is_told(hidden, factor):
    try:
        found = udd.fit(record(hidden), udd.Disk(factor * DRIVE))
    except FitError as error:
        assert "check the drive and its unit" in str(error)
        assert f"drive of {DRIVE:.3g} m/s, where {factor * DRIVE:g} m/s was stated" in str(error)
    else:  # where the data alone tell, the drive is found
        assert abs(found.parameters["W"] / DRIVE - 1) < 0.05


@pytest.mark.parametrize("hidden", STRONG)
@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({"t": 1e3}, "are they in ms"),
        ({"beta": 180 / np.pi}, "is beta in degrees"),
        ({"Y": 1e3, "Z": 1e3}, "are Y and Z in mm"),
        ({"Y": 1e2, "Z": 1e2}, "are Y and Z in cm"),
    ],
)
def test_numbers_that_cannot_be_a_disks_are_asked_about(hidden, factors, message):
    with pytest.raises(FitError, match=message):
        udd.fit(scaled(record(hidden), **factors), udd.Disk(DRIVE))


@functools.cache
def swing(amplitude: float) -> udd.Measurement:
    """A pendulum of 0.8 m, filmed for 8 s."""
    t = np.arange(0, 8, 0.04)
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, amplitude]).state[:, 1]
    return udd.Measurement(t, {"theta": theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t))})


@pytest.mark.parametrize(
    ("factors", "length", "message"),
    [
        ({"t": 1e3}, 0.8, "are they in ms"),
        ({"theta": 180 / np.pi}, 0.8, "is it in degrees|in degrees, not in rad"),
        ({}, 80.0, "pendulum of 0.8 m, where 80 m was stated"),
        ({}, 800.0, "pendulum of 0.8 m, where 800 m was stated"),
    ],
)
@pytest.mark.parametrize("amplitude", [0.05, 0.7])
def test_numbers_that_cannot_be_a_pendulums_are_asked_about(factors, length, message, amplitude):
    with pytest.raises(FitError, match=message):
        udd.fit(scaled(swing(amplitude), **factors), udd.Pendulum(length, k0=0.02))


@pytest.mark.parametrize("amplitude", [0.05, 0.7])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_angle_from_the_upright_is_told(amplitude, sign):
    # With y down the angle of a bob's position has the other sign, too.
    upside = udd.Measurement(swing(amplitude).t, np.pi + sign * swing(amplitude).values)
    said = (
        "y points down, or the angle is counted from the upright: y must point up, the angle from the lowest"
    )
    with pytest.raises(FitError, match=said):
        udd.fit(upside, udd.Pendulum(0.8, k0=0.02))


def test_counts_of_an_encoder_are_asked_about():
    counts = np.round(swing(0.7).values * 4096 / (2 * np.pi))
    with pytest.raises(
        FitError, match=r"degrees, or counts of an encoder \(multiply by 2 pi over the counts per"
    ):
        udd.fit(udd.Measurement(swing(0.7).t, counts), udd.Pendulum(0.8, k0=0.02))
    with pytest.raises(FitError, match=r"is it in degrees\?"):
        udd.fit(scaled(swing(0.7), theta=180 / np.pi), udd.Pendulum(0.8, k0=0.02))


def test_a_pendulum_may_go_round():
    t = np.arange(0, 20, 0.05)
    theta = udd.simulate(udd.Pendulum(0.5, k0=0.002), t, [12.0, 0.0]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 2e-3 * np.random.default_rng(1).standard_normal(len(t))})
    assert udd.fit(measured, udd.Pendulum(0.5, k0=0.01)).scatter < 1.5


def test_what_remains_doubtful_after_a_search_is_a_remark(tmp_path):
    found = discovered.disk()
    assert found.remarks == [] and discovered.nothing().remarks == []
    fit = found.fit
    far = replace(fit, parameters={**fit.parameters, "W": 0.2 * discovered.DRIVE})
    doubted = replace(found, fit=far)
    (remark,) = doubted.remarks
    assert remark.startswith("The fit leaves what was stated: W = 0.0084 m/s")
    # It stands beside the verdict, not instead of it.
    assert as_text(summary_of(doubted)).splitlines()[0] == as_text(summary_of(found)).splitlines()[0]
    assert f"  {remark}\n" in as_text(summary_of(doubted))
    doubted.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert f'<p class="warn">{remark}</p>' in page and "<strong>effect" in page
    held = {name: value for name, value in fit.parameters.items() if name not in ("W", "clock")}
    (remark,) = replace(
        found,
        fit=replace(
            fit,
            parameters=held,
            problem=replace(fit.problem, free=tuple(f for f in fit.problem.free if f.name in held)),
        ),
    ).remarks
    assert remark.startswith("Held as stated, because they run away where they are free: W, clock.")
