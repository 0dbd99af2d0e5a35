"""Innovations are white where the model is right, coloured where it is not, and those of a Kalman filter."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.linalg

import discovered
import simulated
import udd
from udd.fitting.innovations import Innovations, innovations
from udd.measurement import Measurement
from udd.plot.fits import binned, coordinates
from udd.report.loose_fit import loosest


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
        result = innovations(fit)
        assert np.isfinite(result.values).mean() > 0.9
        rho, sd = result.autocorrelation(25)
        squares.append(result.chi2)
        scaled.append(rho / sd)
    # The estimate of the noise, and the assumed model error (there is none), move it by a few percent.
    np.testing.assert_allclose(np.mean(squares, axis=0), 1.0, atol=0.15)
    # 300 values, nearly independent, with unit variance: their mean square scatters by 0.08.
    assert 0.7 < np.mean(np.square(scaled)) < 1.5


def test_a_missing_effect_leaves_colour() -> None:
    result = discovered.disk()
    before, after = innovations(result.baseline), innovations(result.fit)
    assert (before.ljung_box(25)[1] < 1e-9).all()
    assert (before.chi2 > 2.0).all()
    assert (after.chi2 < 1.4).all()
    assert (np.abs(after.autocorrelation(25)[0]) < 0.2).all()


@pytest.mark.parametrize("memory", [0.0, 0.6])
def test_innovations_are_those_of_dense_algebra(memory: float) -> None:
    """Observations of a linear system are jointly Gaussian: Cholesky subtracts each prediction."""
    rng, dt, n = np.random.default_rng(8), 0.1, 60
    model = udd.Model(["x", "v"], {"x": "v", "v": "-k*x"}, {"k": 2.0})
    t = dt * np.arange(n)
    seen = np.cos(np.sqrt(2.0) * t) + 0.05 * rng.standard_normal(n)
    seen[30] = np.nan
    fit = udd.fit(Measurement(t, seen[:, None], names=("x",)), model, free=["k"])
    fit = dataclasses.replace(fit, noise=dataclasses.replace(fit.noise, memory=np.array([memory, 0.0])))

    step = scipy.linalg.expm(dt * np.array([[0.0, 1.0], [-fit.parameters["k"], 0.0]]))
    kick = np.diag(np.square(fit.problem.diffusion)) * dt
    spread = [np.diag(np.ptp(fit.states, axis=0) ** 2)]
    for _ in range(n - 1):
        spread.append(step @ spread[-1] @ step.T + kick)
    # Where the fit's states obey the model, what is seen differs from them by a motion of this covariance.
    there = np.flatnonzero(np.isfinite(seen))
    sd = np.zeros(n)
    sd[there] = (fit.noise.sd(fit.record, fit.states[:, 0])[:, 0] / np.sqrt(fit.noise.weight))[there]
    covariance = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            moved = np.linalg.matrix_power(step, i - j) @ spread[j]
            # The noise starts again after a frame that was not observed.
            noise = sd[i] * sd[j] * memory ** (i - j) if (i < 30) == (j < 30) else 0.0
            covariance[i, j] = covariance[j, i] = moved[0, 0] + (noise if memory or i == j else 0.0)
    # The fitted states miss the model by their defects, which move all that comes after.
    off = np.zeros((n, 2))
    for i in range(n - 1):
        off[i + 1] = step @ off[i] + step @ fit.states[i] - fit.states[i + 1]
    rest = (seen - fit.states[:, 0] - off[:, 0])[there]
    white = scipy.linalg.solve_triangular(
        np.linalg.cholesky(covariance[np.ix_(there, there)]), rest, lower=True
    )
    result = innovations(fit).values
    assert np.isnan(result[:12, 0]).all() and np.isnan(result[30, 0])
    # The flow is followed to 1e-8 of the states, a millionth of the noise.
    np.testing.assert_allclose(result[there[12:], 0], white[12:], atol=1e-5)


def test_a_gap_starts_the_filter_anew() -> None:
    measured, _ = simulated.film(udd.Disk(0.04), np.random.default_rng(3), 30.0)
    values = measured.values.copy()
    values[300:340] = np.nan
    result = innovations(udd.fit(udd.Measurement(measured.t, values), udd.Disk(0.041)))
    assert np.nanmax(np.abs(result.values)) < 12  # outliers of eight deviations, and nothing from the gap


def test_ljung_box_is_the_textbooks() -> None:
    rng = np.random.default_rng(5)
    x = rng.standard_normal((500, 1))
    result = Innovations(("theta",), 0.05, x)
    y = x[:, 0] - x[:, 0].mean()
    rho = np.array([y[k:] @ y[:-k] / (y @ y) for k in range(1, 11)])
    textbook = 500 * 502 * float(np.sum(rho**2 / (500 - np.arange(1, 11))))
    # The same but for terms of order k/n.
    assert result.ljung_box(10)[0][0] == pytest.approx(textbook, rel=0.03)
    white = [
        Innovations(("theta",), 0.05, rng.standard_normal((400, 1))).ljung_box(10)[1][0] for _ in range(200)
    ]
    assert 0.01 <= np.mean(np.array(white) < 0.05) <= 0.1  # 0.05 +- 3 standard errors of 0.015


def test_the_means_of_residuals_have_honest_errors(fits: list[udd.Fit]) -> None:
    """Binned residuals are smooth over several frames: errors for white noise would be half of the truth."""
    z = []
    for fit in fits:
        loose = loosest(fit)
        for k in range(4):
            for name, x in coordinates(loose).items():
                if name != "t":  # slow drifts are no noise
                    _, mean, error = binned(x, loose.defect[:, k])
                    z.append(mean / error)
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.25  # 1.04 in a larger experiment


def test_what_any_of_several_records_sees_is_looked_at() -> None:
    """Two records of an own model, one of which sees x and the other v, with a force that it lacks."""
    t = np.arange(0, 20, 0.05)
    baseline = udd.Model(["x", "v"], {"x": "v", "v": "-k*x - c*v"}, {"k": 9.0, "c": 0.1})
    pushed = udd.Model(["x", "v"], {"x": "v", "v": "-k*x - c*v + 0.3*sin(5*t)"}, {"k": 9.0, "c": 0.1})
    rng = np.random.default_rng(0)
    x = udd.simulate(baseline, t, [1.0, 0.0]).state[:, 0] + 5e-3 * rng.standard_normal(len(t))
    v = udd.simulate(pushed, t, [1.0, 0.0]).state[:, 1] + 5e-3 * rng.standard_normal(len(t))
    two = [udd.Measurement(t, {"x": x}), udd.Measurement(t, {"v": v})]
    said = [udd.fit(order, baseline, state0=[{}, {}]).doubts for order in (two, two[::-1])]
    assert said[0].missing and said[1].missing
    assert set(said[0].white) == set(said[1].white) == {"x", "v"}
