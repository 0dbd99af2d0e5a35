"""Innovations are white where the model is right, coloured where it is not, and those of a Kalman filter."""

from __future__ import annotations

import numpy as np
import pytest

import discovered
import simulated
import udd
from udd.discovery import innovations as module
from udd.discovery.innovations import Innovations, innovations
from udd.plot.fits import binned, coordinates
from udd.report.loose import loosest


@pytest.fixture(scope="module")
def fits() -> list[udd.Fit]:
    """Four records of disks that lack nothing, by a camera whose errors a fit knows."""
    result = []
    for rng in np.random.default_rng(12).spawn(4):
        model = udd.Disk(rng.uniform(0.03, 0.05))
        measured, _ = simulated.film(model, rng, 40.0, simulated.Camera(outliers=0.0, exposure=1e-4))
        result.append(udd.fit(measured, udd.Disk(1.02 * model.W)))
    return result


def test_a_right_model_leaves_white_noise(fits: list[udd.Fit]) -> None:
    squares, scaled = [], []
    for fit in fits:
        found = innovations(fit)
        assert np.isfinite(found.values).mean() > 0.9
        rho, sd = found.autocorrelation(25)
        squares.append(found.chi2)
        scaled.append(rho / sd)
    # The estimate of the noise, and the assumed model error (there is none), move it by a few percent.
    np.testing.assert_allclose(np.mean(squares, axis=0), 1.0, atol=0.15)
    # 300 values, nearly independent, with unit variance: their mean square scatters by 0.08.
    assert 0.7 < np.mean(np.square(scaled)) < 1.5


def test_a_missing_effect_leaves_colour() -> None:
    found = discovered.disk()
    before, after = innovations(found.baseline), innovations(found.fit)
    assert (before.ljung_box(25)[1] < 1e-9).all()
    assert (before.chi2 > 2.0).all()
    assert (after.chi2 < 1.4).all()
    assert (np.abs(after.autocorrelation(25)[0]) < 0.2).all()


def test_chunks_are_one_filter(fits: list[udd.Fit], monkeypatch: pytest.MonkeyPatch) -> None:
    chunks = innovations(fits[0]).values
    monkeypatch.setattr(module, "_CHUNK", 10**6)
    whole = innovations(fits[0]).values
    late = slice(60, None)  # the one filter has its own beginning there
    # What five seconds of frames before each chunk leave of its beginning: 0.015 standard deviations at most.
    np.testing.assert_allclose(chunks[late], whole[late], atol=0.03)


def test_a_gap_starts_the_filter_anew() -> None:
    measured, _ = simulated.film(udd.Disk(0.04), np.random.default_rng(3), 30.0)
    values = measured.values.copy()
    values[300:340] = np.nan
    found = innovations(udd.fit(udd.Measurement(measured.t, values), udd.Disk(0.041)))
    assert np.nanmax(np.abs(found.values)) < 12  # outliers of eight deviations, and nothing from the gap


def test_ljung_box_is_the_textbooks() -> None:
    rng = np.random.default_rng(5)
    x = rng.standard_normal((500, 1))
    found = Innovations(("theta",), 0.05, x)
    y = x[:, 0] - x[:, 0].mean()
    rho = np.array([y[k:] @ y[:-k] / (y @ y) for k in range(1, 11)])
    textbook = 500 * 502 * float(np.sum(rho**2 / (500 - np.arange(1, 11))))
    # The same but for terms of order k/n.
    assert found.ljung_box(10)[0][0] == pytest.approx(textbook, rel=0.03)
    white = [
        Innovations(("theta",), 0.05, rng.standard_normal((400, 1))).ljung_box(10)[1][0] for _ in range(200)
    ]
    assert 0.01 <= np.mean(np.array(white) < 0.05) <= 0.1  # 0.05 +- 3 standard errors of 0.015


def test_the_means_of_residuals_have_honest_errors(fits: list[udd.Fit]) -> None:
    """What is binned is smooth over several frames: errors of white noise would be half of the truth."""
    z = []
    for fit in fits:
        loose = loosest(fit)
        for k in range(4):
            for name, x in coordinates(loose).items():
                if name != "t":  # slow drifts are no noise
                    _, mean, error = binned(x, loose.defect[:, k])
                    z.append(mean / error)
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.25  # 1.04 in a larger experiment
