"""Sensor properties from a record: steps, noise, and whether it was an encoder."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import FitError
from udd.fitting.sensor import frame_noise, is_encoder, lattice, reads, roughness, stated_noise
from udd.fitting.thinning import thinned


def swing(step: float, noise: float = 0.0, seed: int = 0, duration: float = 20.0) -> udd.Measurement:
    """A pendulum's angle, read in steps (0 for none), without a word about the sensor."""
    t = np.arange(0, duration, 0.02)
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, 0.7]).state[:, 1]
    theta = theta + noise * np.random.default_rng(seed).standard_normal(len(t))
    return udd.Measurement(t, {"theta": np.round(theta / step) * step if step else theta})


@pytest.mark.parametrize("step", [2 * np.pi / 4096, 4.4e-4, 0.25])
@pytest.mark.parametrize("offset", [0.0, 0.1234])
def test_steps_are_found_from_the_values_alone(step, offset):
    values = np.round(np.random.default_rng(0).normal(0, 30 * step, 400) / step) * step + offset
    assert lattice(values) == pytest.approx(step, rel=1e-6)
    assert lattice(values + 0.1 * step * np.random.default_rng(1).standard_normal(400)) == 0.0


def test_the_noise_is_that_of_the_step_or_of_the_frames():
    step = 2 * np.pi / 4096
    assert reads(swing(step).values[:, 0]) == pytest.approx((step / np.sqrt(12), step), rel=0.3)
    # Differences of many orders tell noise from motion: 1000 frames say it to some 5 %.
    assert roughness(swing(0.0, 1e-4).values)[0] == pytest.approx(1e-4, rel=0.2)
    # At rest an encoder repeats itself; its step's noise is still there.
    still = np.where(np.arange(500) < 480, 0.0, step * np.arange(-479, 21))
    assert reads(still)[0] == pytest.approx(step / np.sqrt(12))


@pytest.mark.parametrize(
    ("step", "noise", "encoder"),
    [
        (2 * np.pi / 14400, 0.0, True),
        (2 * np.pi / 14400, 1e-4, True),
        (2 * np.pi / 14400, 2e-3, False),  # steps smaller than the noise
        (1e-3, 0.0, False),  # a table of three decimals
        (np.radians(0.1), 0.0, False),
        (0.0, 1e-3, False),
    ],
)
def test_an_encoder_is_told_by_steps_that_drown_all_else(step, noise, encoder):
    assert is_encoder(swing(step, noise)) == encoder


def test_an_encoder_has_no_camera_and_is_as_good_as_its_steps():
    step = 2 * np.pi / 14400
    result = udd.fit(swing(step), udd.Pendulum(0.79))
    assert "theta0" in result.parameters and not {"aside", "above"} & set(result.parameters)
    sd = float(np.median(result.noise.sd(result.record, result.states[:, 0])))
    assert sd == pytest.approx(step / np.sqrt(12), rel=0.3)
    assert f"read in steps of {1e3 * step:.3g} mrad" in result.summary()
    (said,) = result.to_dict()["doubts"]["noise"]
    assert said["name"] == "theta" and said["step"] == pytest.approx(step, rel=1e-6)


def test_quantised_columns_of_own_models_are_good_to_their_step():
    t = np.arange(0, 20, 0.02)
    model = udd.Model(["x", "v"], ["v", "-k*x"], {"k": 4.0})
    x = udd.simulate(model, t, [1.0, 0.0]).state[:, 0]
    # So coarse that most frames repeat the one before: differences alone would say there is no noise.
    step = 0.2
    result = udd.fit(udd.Measurement(t, {"x": np.round(x / step) * step}), model)
    assert result.record.sigma[:, 0].min() >= 0.99 * step / np.sqrt(12)


def test_readings_that_repeat_tell_what_one_would():
    step = 0.1
    values = step * np.concatenate([np.arange(20), np.full(400, 20), 20 + np.arange(20)])
    noise = frame_noise(values)
    assert noise[5] == pytest.approx(step / np.sqrt(12), rel=0.01)
    assert (1 / noise[20:420] ** 2).sum() == pytest.approx(12 / step**2, rel=0.02)


def test_a_film_that_is_better_than_its_geometry_is_told_both_ways():
    """A search assumes at least half of 5 mrad; the scatter of the frames is reported too."""
    noise = 1e-3
    (result,) = udd.discover(swing(0.0, noise, duration=60.0), udd.Pendulum(0.79)).noise
    # 3000 frames tell their scatter to 1.3 %; three of it.
    assert result.shown == pytest.approx(noise, rel=0.04)
    assert result.noise == pytest.approx(2.5e-3, rel=0.01)
    assert f"theta {1e3 * result.shown:.3g} mrad (counted as 2.5 mrad, because the geometry" in result.text
    # A fit alone takes the frames at their word.
    assert "counted" not in udd.fit(swing(0.0, noise, duration=60.0), udd.Pendulum(0.79)).summary()


def test_stated_noise_is_shared_by_readings_that_repeat():
    step, sigma = 0.1, 0.05
    values = step * np.concatenate([np.arange(20), np.full(400, 20), 20 + np.arange(20)])
    noise = stated_noise(values, np.full(len(values), sigma))
    assert noise[5] == pytest.approx(sigma)
    # 401 readings of one step, whose own error they share, and of other noise, which each has its own.
    assert noise[100] ** 2 == pytest.approx(sigma**2 + 400 * step**2 / 12)
    smooth = np.random.default_rng(0).normal(0, 1, 400)
    assert (stated_noise(smooth, np.full(400, sigma)) == sigma).all()


@pytest.mark.parametrize("stated", [False, True])
def test_an_encoder_at_rest_shows_nothing_missing_whether_its_noise_is_stated_or_not(stated):
    """Two thirds of the record are one reading, with the information of one: the noise is not zero."""
    t, step = np.arange(0, 60, 0.02), 2 * np.pi / 4096
    theta = udd.simulate(udd.Pendulum(0.34, k0=0.1), t, [0.0, 0.7]).state[:, 1]
    theta = theta + 2e-4 * np.random.default_rng(0).standard_normal(len(t))
    sd = float(np.hypot(2e-4, step / np.sqrt(12)))
    sigma = np.full((len(t), 1), sd) if stated else None
    measured = udd.Measurement(t, {"theta": np.round(theta / step) * step}, sigma=sigma)
    result = udd.discover(measured, udd.Pendulum(0.34, k0=0.1))
    assert result.verdict == "nothing missing" and not result.fit.doubts.missing
    # The encoder's own error is reported, with 2e-4 of other noise: not that of 2000 frames that share one.
    assert result.noise[0].noise == pytest.approx(sd, rel=0.15)


def test_an_encoder_that_moves_by_few_steps_is_as_good_as_these():
    step = 2 * np.pi / 400
    t = np.arange(0, 20, 0.02)
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, 0.04]).state[:, 1]
    measured = udd.Measurement(t, {"theta": np.round(theta / step) * step}, meta={"sensor": "encoder"})
    assert len(np.unique(measured.values)) < 9  # which show no lattice
    result = udd.fit(measured, udd.Pendulum(0.79))
    assert result.doubts.sensor[0].noise == pytest.approx(step / np.sqrt(12), rel=0.3)
    assert "film" not in result.summary()


def test_an_encoder_that_never_moves_says_so():
    still = udd.Measurement(np.arange(0, 20, 0.02), {"theta": np.zeros(1000)}, meta={"sensor": "encoder"})
    with pytest.raises(FitError, match="theta: all values are constant"):
        udd.fit(still, udd.Pendulum(0.79))


def test_means_of_an_encoders_readings_are_still_an_encoders():
    record = swing(2 * np.pi / 4096, 1e-4, duration=400.0)
    means = thinned(record)
    assert is_encoder(record) and means.every > 1 and is_encoder(means.measurement)
