"""Diagnostics of a fit: which films lack something, and which parameters ran away."""

from __future__ import annotations

import functools
import json
import re
from pathlib import Path

import numpy as np
import pytest

import simulated
import udd
from udd.cli import main
from udd.fitting.diagnostics import readings

E = udd.effects
DRIVE = 0.042
HIDDEN = {
    "quadratic drag": E.quadratic_drag(c=0.01),
    "relaxation": E.relaxation(b=6.0),
    "dry friction": E.coulomb(c=0.01),
    "tilt": E.tilt(a=0.04),
    "ripple": E.drive_ripple(a=0.05, b=0.03, f=0.8),
    "eccentric mass": E.eccentric_mass(a=0.01, b=-0.01),
    "uneven disk": E.uneven_disk(a=0.02, b=0.01, n=3),
    "lateral slip": E.lateral_slip(c=0.05),
    "slip of no library": E.formula("vertical", "-0.004*tanh(Z/0.01)", name="hidden"),
    "torque of no library": E.formula("torque", "-0.01*Omega*exp(3*(cos(beta - 1.1) - 1))", name="hidden"),
}


@functools.cache
def fitted(hidden: str | None, seed: int) -> udd.Fit:
    """A film of a minute, fitted with the plain model."""
    effects = [] if hidden is None else [HIDDEN[hidden]]
    measured, _states = simulated.film(udd.Disk(DRIVE, effects=effects), np.random.default_rng(seed), 60.0)
    return udd.fit(measured, udd.Disk(DRIVE))


@pytest.mark.parametrize("seed", range(10))
def test_a_right_model_is_not_doubted(seed):
    result = fitted(None, seed)
    assert not result.doubts.missing and result.doubts.tight and result.doubts.factor == 1.0
    assert result.doubts.ran_off == [] and not result.doubts.coloured
    assert "no sign that something is missing" in str(result)


@pytest.mark.parametrize("W", [0.03, 0.042, 0.05])
@pytest.mark.parametrize("part", [0.2, 1.0, 5.0])
def test_a_plain_disk_lacks_nothing_however_well_it_is_seen(W, part):
    """Noise of 0.1 mm and 1 mrad: while a loose model follows the frames, its estimate is too small."""
    noise = part * np.array([1e-4, 1e-4, 1e-3])
    run = udd.simulate(udd.Disk(W), np.arange(0, 20, 0.04), [2, 0.02, -0.02, 0])
    seen = run.state[:, 1:4] + noise * np.random.default_rng(0).standard_normal((len(run.t), 3))
    result = udd.fit(udd.Measurement(run.t, seen), udd.Disk(W))
    assert not result.doubts.missing
    # With 500 frames the scatter is accurate to 3 %; allow three times that, and the states' leverage.
    assert [item.noise for item in result.doubts.sensor] == pytest.approx(noise, rel=0.12)


def test_a_search_finds_nothing_missing_in_a_plain_disk_that_is_seen_precisely():
    run = udd.simulate(udd.Disk(0.042), np.arange(0, 40, 0.04), [2, 0.02, -0.02, 0])
    noise = np.random.default_rng(1).standard_normal((len(run.t), 3)) * [1e-4, 1e-4, 1e-3]
    result = udd.discover(udd.Measurement(run.t, run.state[:, 1:4] + noise), udd.Disk(0.042))
    assert result.verdict == "nothing missing" and result.baseline.scatter < 1.2


@pytest.mark.parametrize("hidden", HIDDEN)
def test_a_model_that_lacks_something_says_so(hidden, tmp_path: Path, capsys):
    result = fitted(hidden, 1)
    assert result.doubts.missing and result.doubts.factor > 10
    text = result.summary()
    assert text.splitlines()[1] == "something is missing: run udd discover"
    assert "the model misses angular accelerations of" in text and "rad/s^2" in text
    assert re.search(r"k0 +0\.0\d+\(\d\d\)", text) and "m^2/s" in text and len(text.splitlines()) < 30
    assert "something is missing: run udd discover" in result._repr_html_()
    assert result.to_dict()["doubts"]["missing"] is True
    # The errors contain the doubt, the covariance with them.
    truth = {"k0": 0.012, "k1": 0.103, "k2": 0.055, "W": DRIVE}
    for name, value in truth.items():
        assert abs(result.parameters[name] - value) < 3 * result.errors[name], name
    np.testing.assert_allclose(np.sqrt(np.diag(result.covariance)), list(result.errors.values()))


def test_the_command_says_it_too(tmp_path: Path, capsys):
    fitted("quadratic drag", 1).measurement.to_csv(tmp_path / "film.csv")
    assert main(["fit", str(tmp_path / "film.csv"), "--W", str(DRIVE), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["doubts"]["sentences"][0] == "something is missing: run udd discover"
    assert said["doubts"]["model_error"][0]["needed"] > 10 * said["doubts"]["model_error"][0]["right"]


def test_parameters_that_run_off_are_told():
    t = np.arange(0, 40, 0.05)
    rng = np.random.default_rng(1)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.6]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 2e-3 * rng.standard_normal(len(t))})
    assert udd.fit(measured, udd.Pendulum(1.02, k0=0.1)).doubts.ran_off == []
    reported = udd.fit(measured, udd.Pendulum(1.5, k0=0.1), priors={"inertia": (2.25, 0.02)})
    (length,) = [item for item in reported.doubts.ran_off if item.name == "length"]
    assert length.stated == 1.5 and abs(length.value - length.stated) > 3 * length.sd
    assert "warning: length = " in reported.summary() and "standard deviations off" in reported.summary()


def test_friction_that_drives_is_told():
    t = np.arange(0, 40, 0.05)
    theta = 0.2 * np.exp(0.01 * t) * np.cos(3.13 * t)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    result = udd.fit(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.02))
    assert result.parameters["k0"] < 0
    assert "expected a positive value" in result.summary()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("lacking", ["", "- 0.3*abs(v)*v"])
def test_a_model_of_ones_own_is_doubted_where_it_lacks_something(seed, lacking):
    t = np.arange(0, 40, 0.05)
    equations = {"x": "v", "v": "-k*x - c*v"}
    baseline = udd.Model(["x", "v"], equations, {"k": 9.0, "c": 0.1})
    truth = udd.Model(["x", "v"], equations | {"v": equations["v"] + lacking}, {"k": 9.0, "c": 0.1})
    x = udd.simulate(truth, t, [1.0, 0.0]).state[:, 0]
    seen = x + 5e-3 * np.random.default_rng(seed).standard_normal(len(t))
    result = udd.fit(udd.Measurement(t, {"x": seen}), baseline)
    assert result.doubts.missing == bool(lacking)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("drag", [0.0, 0.03])
def test_a_pendulum_is_doubted_where_it_lacks_something(seed, drag):
    t = np.arange(0, 60, 0.04)
    effects = [E.quadratic_drag(c=drag)] if drag else []
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01, effects=effects), t, [0.0, 0.7]).state[:, 1]
    seen = theta + 2e-3 * np.random.default_rng(seed).standard_normal(len(t))
    result = udd.fit(udd.Measurement(t, {"theta": seen}), udd.Pendulum(0.8, k0=0.02))
    assert result.doubts.missing == bool(drag)


def test_a_film_whose_disk_has_come_to_rest_repeats_its_picture():
    """From there on it shows no noise, and by that none of the frames before would be as good as they are."""
    t = np.arange(0, 6, 0.04)
    states = udd.simulate(udd.Disk(0.0), t, [1.17, 0.0425, -0.0395, 1.415]).state
    rng = np.random.default_rng(3)
    sigma = np.array([5e-6, 5e-6, 6e-5])
    seen = states[:, 1:] + sigma * rng.standard_normal((len(t), 3))
    last = int(np.flatnonzero(np.abs(states[:, 0]) > 0.1)[-1])
    seen[last:] = seen[last] + 0.1 * sigma * rng.standard_normal((len(t) - last, 3))
    errors = np.tile(sigma, (len(t), 1))
    film = udd.Measurement(t, seen, sigma=errors, meta={"px_per_m": 1750.0})
    fitted = udd.fit(film, udd.Disk(0.0))
    assert len(fitted.record.t) == last + 1
    assert not fitted.doubts.missing
    assert f"from {t[last]:.4g} s on the disk is at rest" in fitted.summary()
    assert abs(fitted.parameters["k0"] - 0.012) < 4 * fitted.errors["k0"]
    # A film that ends before that is taken whole.
    assert len(udd.fit(film.slice(0, t[last - 5]), udd.Disk(0.0)).record.t) == last - 5


@pytest.mark.parametrize("digits", [None, 6, 4])
@pytest.mark.parametrize("sensors", [1, 2])
def test_the_last_digits_of_exact_data_are_no_missing_effect(digits, sensors):
    """Residuals are coloured by the integrator or by rounding; a search finds no effect in them either."""
    t = np.arange(0, 20, 0.05)
    baseline = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": 9.0, "c": 0.1})
    states = udd.simulate(baseline, t, [1.0, 0.0]).state
    seen = states if digits is None else np.round(states, digits)
    record = udd.Measurement(t, dict(zip(baseline.state_names[:sensors], seen.T, strict=False)))
    result = udd.fit(record, baseline.with_parameters({"k": 8.5, "c": 0.12}))
    assert not result.doubts.missing and "as a right model does" in result.summary()
    if digits == 6:
        assert udd.discover(record, baseline).verdict == "nothing missing"


@pytest.mark.parametrize("plain", [udd.Pendulum(0.8, k0=0.01), udd.Disk(0.042)])
def test_the_last_digits_of_an_exact_device_are_no_missing_effect(plain):
    t = np.arange(0, 20, 0.04)
    start = [0.0, 0.7] if plain.kind == "pendulum" else [2.0, 0.02, -0.02, 0.0]
    states = udd.simulate(plain, t, start).state[:, 1:]
    assert not udd.fit(udd.Measurement(t, states), plain).doubts.missing


def test_colour_alone_does_not_tell_a_film_s_faults_from_what_is_missing():
    """An error of half the noise that comes and goes three times a second, as marks on a wheel would."""
    clean, _states = simulated.film(udd.Disk(DRIVE), np.random.default_rng(2), 60.0)
    fault = 2.5e-4 * np.sin(2 * np.pi * 3.1 * clean.t)[:, None] * [1.0, 1.0, 0.0]
    reported = []
    for meta in ({}, {"px_per_m": 1750.0}):
        seen = udd.Measurement(clean.t, clean.values + fault, meta=meta)
        doubts = udd.fit(seen, udd.Disk(DRIVE)).doubts
        reported.append((doubts.tight, bool(doubts.coloured), doubts.missing, doubts.verdict.split(",")[0]))
    assert reported[0] == (True, True, True, "something is missing: run udd discover")
    assert reported[1] == (True, True, False, "residuals are not white")


def test_an_encoder_has_a_zero_but_no_perspective():
    t = np.arange(0, 20, 0.04)
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, 0.7]).state[:, 1]
    seen = {"theta": theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t))}
    filmed = udd.fit(udd.Measurement(t, seen), udd.Pendulum(0.8))
    assert {"theta0", "aside", "above"} <= set(filmed.parameters)
    coded = udd.fit(udd.Measurement(t, seen, meta={"sensor": "encoder"}), udd.Pendulum(0.8))
    assert set(filmed.parameters) - set(coded.parameters) == {"aside", "above"}


@pytest.mark.parametrize(("other", "told"), [(0.1, ["Y", "Z"]), (1.0, [])])
def test_steps_that_no_other_noise_blurs_are_told(other: float, told: list[str]) -> None:
    """An error of a step of 3 mm is a function of where the disk is, unless noise of 3 mm takes part."""
    measured, _states = simulated.film(udd.Disk(0.045), np.random.default_rng(3), 20.0)
    step, rng = 3e-3, np.random.default_rng(4)
    values = measured.values.copy()
    for k in range(2):
        values[:, k] = step * np.round(
            (values[:, k] + other * step * rng.standard_normal(len(values))) / step
        )
    sigma = np.tile([np.hypot(other, 12**-0.5) * step] * 2 + [0.01], (len(values), 1))
    fitted = udd.fit(udd.Measurement(measured.t, values, sigma=sigma), udd.Disk(0.045))
    assert [item.name for item in readings(fitted) if item.coarse] == told
