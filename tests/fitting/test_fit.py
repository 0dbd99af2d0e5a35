"""The fit against simulated truth, an independent least-squares fit, and bad input."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import simulated
import udd
from udd.errors import FitError
from udd.fitting import (
    SolveError,
    as_stated,
    eased,
    fit_record,
    minimise,
    model_error_schedule,
    record_of,
    widened,
)
from udd.fitting.estimator_input import FilmParameters
from udd.fitting.noise_estimation import _afresh
from udd.fitting.parameters import Free


@pytest.fixture(scope="module")
def fits() -> list[tuple[udd.Disk, simulated.Camera, udd.Fit]]:
    """Six records of 40 s with a relaxation, each with its own drive, camera and start, and their fits."""
    result = []
    for rng in np.random.default_rng(7).spawn(6):
        model = udd.Disk(rng.uniform(0.03, 0.06), effects=[udd.effects.relaxation(b=rng.uniform(1, 8))])
        camera = simulated.Camera(
            offset=(rng.normal(0, 1e-3), rng.normal(0, 1e-3)),
            tilt=rng.normal(0, 0.015),
            scale=rng.normal(0, 0.003),
            lag=rng.normal(0, 3e-3),
            clock=rng.normal(0, 1e-3),
        )
        measured, _states = simulated.film(model, rng, 40.0, camera)
        start = udd.Disk(model.W * 1.04, k0=0.009, k1=0.12, k2=0.065, effects=[udd.effects.relaxation(b=0.0)])
        result.append((model, camera, udd.fit(measured, start)))
    return result


def test_parameters_are_found_within_their_errors(fits):
    names = ["k0", "k1", "k2", "W", "relaxation.b"]
    z = np.array(
        [[(f.parameters[n] - m.parameters[n]) / f.errors[n] for n in names] for m, _camera, f in fits]
    )
    assert np.abs(z).max() < 4.5
    # Thirty z-scores, five to a record and correlated there: their rms scatters by about 20 %.
    assert 0.5 < np.sqrt(np.mean(z**2)) < 1.6


@pytest.mark.parametrize("hidden", [[], [udd.effects.quadratic_drag(c=1e-5)]], ids=["right", "wrong"])
def test_leaps_over_levels_end_where_single_steps_do(hidden, monkeypatch):
    measured, _states = simulated.film(udd.Disk(0.05, effects=hidden), np.random.default_rng(5), 60.0)
    start = udd.Disk(0.052, k0=0.009, k1=0.12, k2=0.065)
    leapt = udd.fit(measured, start)
    monkeypatch.setattr(model_error_schedule, "_skip_levels", lambda best, point, *_: (best, point))
    stepped = udd.fit(measured, start)
    # A right model gets the smallest model error; a wrong one only the most probable one.
    last = len(leapt.problem.schedule) - 1
    assert leapt.level == last if not hidden else 0 < leapt.level < last
    assert stepped.level == leapt.level
    assert leapt.evidence == pytest.approx(stepped.evidence, abs=model_error_schedule.LESS)
    for name, value in stepped.parameters.items():
        # Both end within a tenth of a standard error of their minimum, of noise estimated on the way there.
        assert abs(leapt.parameters[name] - value) < 0.2 * stepped.errors[name], name


def test_the_camera_is_found(fits):
    for _model, camera, f in fits:
        truth = {"y0": camera.offset[0], "z0": camera.offset[1], "tilt": camera.tilt, "lag": camera.lag}
        for name, value in truth.items():
            assert abs(f.parameters[name] - value) < 4.5 * f.errors[name], name
        # The pivot is found to a small part of a frame's noise of 0.5 mm.
        assert f.errors["y0"] < 1e-4


def test_the_noise_is_found(fits):
    for _model, camera, f in fits:
        assert f.converged
        assert 0.9 < f.scatter < 1.3  # 1 % of outliers at 8 sigma add to it
        speed = np.array([0.0, 4.0, 10.0])
        result = np.hypot(f.noise.factor[0] * 5e-4, f.noise.blur[0] * speed)
        truth = camera.noise + camera.per_speed * speed
        # A thousand frames give 3 %; the law is a sum in the truth and a root of squares in the model.
        np.testing.assert_allclose(result, truth, rtol=0.25)


def test_a_lens_bends_about_the_picture_s_middle():
    middle, bent = np.array([0.03, -0.02]), 0.02  # at 0.1 m from the middle
    measured, _states = simulated.film(udd.Disk(0.05), np.random.default_rng(3), 60.0, simulated.Camera())
    away = measured.values[:, :2] - middle
    values = measured.values.copy()
    values[:, :2] += bent / 0.1**2 * (away**2).sum(axis=1)[:, None] * away
    baseline = replace(measured, values=values, meta={"middle": middle.tolist()})
    fit = udd.fit(baseline, udd.Disk(0.05), priors={"lens": (0.0, 0.02)})
    for name, value in (("lens", bent), ("y0", 1e-3), ("z0", -7e-4)):
        assert abs(fit.parameters[name] - value) < 4 * fit.errors[name], name
    assert fit.errors["lens"] < bent / 4
    with pytest.raises(FitError, match="two numbers"):
        udd.fit(replace(measured, meta={"middle": 0.1}), udd.Disk(0.05))


def test_means_over_an_exposure_lie_off_the_middle():
    """The film's frames are means of eight looks while the shutter is open."""
    camera = simulated.Camera(exposure=0.03, noise=1e-4, angle_noise=1e-3)
    z = []
    for rng in np.random.default_rng(11).spawn(6):
        measured, _states = simulated.film(udd.Disk(0.05), rng, 40.0, camera)
        fit = udd.fit(measured, udd.Disk(0.05))
        truth = {"shutter": camera.exposure**2 / 24, "row": camera.row}
        assert fit.errors["shutter"] < truth["shutter"] / 4
        z += [(fit.parameters[name] - value) / fit.errors[name] for name, value in truth.items()]
    assert np.abs(z).max() < 4.5
    assert np.sqrt(np.mean(np.square(z))) < 1.6  # twelve of them: 1 +- 0.2


def test_a_model_is_first_held_with_what_was_known_of_it(fits):
    """One in fifty noisy records makes friction flat (k1 near k0) while states follow the frames."""
    model, _camera, fit = fits[0]
    (values, camera, clock), *_ = _afresh(fit).sets
    baseline = {f.name: f.mean for f in fit.problem.free if f.name in ("k0", "k1", "k2", "W")}
    result = dict(zip(model.parameters, values, strict=True))
    assert {name: result[name] for name in baseline} == baseline
    assert result["relaxation.b"] == fit.parameters["relaxation.b"] != 0.0  # of which nothing was known
    assert (camera, clock) == fit.point.sets[0][1:]


def test_gaps_and_outliers_do_not_hurt():
    rng = np.random.default_rng(3)
    model = udd.Disk(0.04)
    measured, _states = simulated.film(model, rng, 40.0)
    values = measured.values.copy()
    values[100:130] = np.nan  # 1.2 s: a new run starts after it
    values[400:408] = np.nan  # 0.3 s: bridged
    values[rng.random(len(values)) < 0.03] += [0.05, -0.04, 1.0]
    f = udd.fit(udd.Measurement(measured.t, values), udd.Disk(0.041))
    assert (~f.record.linked).sum() == 1
    for name in ("k0", "W", "k1"):
        assert abs(f.parameters[name] - model.parameters[name]) < 4.5 * f.errors[name], name


def test_a_pendulum_agrees_with_plain_least_squares():
    """Not chaotic: one trajectory through all data is the same estimate, made here by SciPy alone."""
    t = np.arange(0, 30, 0.05)

    def run(p: np.ndarray) -> np.ndarray:
        def rates(_t: float, x: np.ndarray) -> list[float]:
            return [-9.81 * np.sin(x[1]) - p[0] * x[0], x[0]]

        options = {"rtol": 1e-9, "atol": 1e-11}
        return solve_ivp(rates, (t[0], t[-1]), [p[1], p[2]], t_eval=t, **options).y[1]

    theta = run(np.array([0.03, 0.2, 0.7])) + 2e-3 * np.random.default_rng(5).standard_normal(len(t))
    plain = least_squares(lambda p: run(p) - theta, [0.05, 0.0, 0.5])
    error = np.sqrt(np.linalg.inv(plain.jac.T @ plain.jac)[0, 0]) * 2e-3
    f = udd.fit(udd.Measurement(t, {"theta": theta}), udd.Pendulum(1.0, k0=0.1), free=["k0"], camera=False)
    # The two differ by the model error that the fit allows, a small part of the error.
    assert abs(f.parameters["k0"] - plain.x[0]) < 0.3 * error
    assert f.errors["k0"] == pytest.approx(error, rel=0.15)


def test_frames_keep_their_rows():
    t = np.delete(np.arange(40) * 0.04, [10, 11])
    measured = udd.Measurement(t, np.column_stack([0.01 * np.sin(t), 0.01 * np.cos(t), t]))
    record = record_of(measured)
    assert len(record.t) == 40  # the two missing frames are put in
    assert (record.row == -1).sum() == 2
    np.testing.assert_array_equal(record.seen[record.row >= 0], measured.values)
    assert not record.observed[record.row == -1].any()


def test_a_wrapped_angle_is_followed():
    t = np.arange(0, 20, 0.05)
    theta = udd.simulate(udd.Pendulum(0.5, k0=0.002), t, [12.0, 0.0]).state[:, 1]
    noisy = theta + 2e-3 * np.random.default_rng(1).standard_normal(len(t))
    assert np.ptp(theta) > 20  # it goes round
    wrapped = (noisy + np.pi) % (2 * np.pi) - np.pi
    f = udd.fit(udd.Measurement(t, {"theta": wrapped}), udd.Pendulum(0.5, k0=0.01))
    assert abs(f.parameters["k0"] - 0.002) < 4.5 * f.errors["k0"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model": udd.Pendulum(1.0)}, "does not explain"),
        ({"model": udd.DLE(1.0)}, "does not explain"),
        ({"free": ["k9"]}, "no parameter 'k9'"),
        ({"camera": ["focus"]}, "no parameter 'focus'"),
        ({"priors": {"R": (0.08, 0.001)}}, "R, which is not free"),
        ({"priors": {"k0": (0.01, 0.0)}}, "positive standard deviation"),
        ({"priors": {"k0": 3}}, "a mean and a standard deviation"),
        ({"free": "k0"}, r'free must be a list of names, not a name: free=\["k0"\]'),
        ({"camera": "tilt"}, r'camera must be a list of names, not a name: camera=\["tilt"\]'),
        ({"each": "W"}, r'each must be a list of names, not a name: each=\["W"\]'),
        ({"free": 3}, "free must be a list of names, not 3"),
        ({"camera": 3}, "camera must be a list of names, not 3"),
        ({"free": [3]}, r"free must be a list of names, not \[3\]"),
        ({"priors": 3}, "priors must be a mean and a standard deviation by name, not 3"),
        ({"free": ["k0", "k0"]}, "k0 is named twice"),
        ({"measurement": 3}, "a measurement is needed"),
        ({"model": None}, "a model is needed"),
        ({"model": []}, "one measurement but 0 models"),
        ({"model": [udd.Disk(0.04), udd.Disk(0.04)]}, "one measurement but 2 models"),
    ],
)
def test_bad_input_is_named(change, message):
    t = np.arange(100) * 0.04
    measured = udd.Measurement(t, np.column_stack([0.01 * np.sin(t), 0.01 * np.cos(t), t]))
    arguments = {"measurement": measured, "model": udd.Disk(0.04), **change}
    with pytest.raises(FitError, match=message):
        udd.fit(**arguments)


@pytest.mark.parametrize("sd", [0.0, 1e-9, 1e-7, 1e-5])
def test_computed_motion_is_fitted(sd):
    """Its noise is that of its digits: none may weigh without bound."""
    rng = np.random.default_rng(0)
    swing = udd.simulate(udd.Pendulum(0.5, k0=0.01), np.arange(0, 12, 0.05), [0.0, 0.4])
    theta = swing.state[:, 1] + sd * rng.standard_normal(len(swing.t))
    result = udd.fit(udd.Measurement(swing.t, {"theta": theta}), udd.Pendulum(0.5))
    assert result.converged and result.parameters["k0"] == pytest.approx(0.01, abs=1e-6 + 0.1 * sd)
    run = udd.simulate(udd.Disk(0.042), np.arange(0, 20, 0.04), [2, 0.02, -0.02, 0])
    seen = run.state[:, 1:4] + sd * rng.standard_normal((len(run.t), 3))
    result = udd.fit(udd.Measurement(run.t, seen), udd.Disk(0.042))
    assert result.converged and result.parameters["k0"] == pytest.approx(0.012, abs=1e-8 + 0.1 * sd)


def test_lists_may_be_given_as_generators():
    t = np.arange(0, 20, 0.04)
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, 0.7]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 1e-3 * np.random.default_rng(0).standard_normal(len(t))})
    result = udd.fit(measured, udd.Pendulum(0.79), (n for n in ["k0"]), camera=(n for n in ["theta0"]))
    assert list(result.parameters) == ["k0", "theta0"]


def test_what_is_kept_of_a_fit_that_ran_away_keeps_what_each_record_has_and_what_is_known_of_it():
    two = [simulated.film(udd.Disk(0.04), np.random.default_rng(seed), 8.0)[0] for seed in (1, 2)]
    baseline = {"y0": (0.0, 1e-5), "k0[0]": (0.012, 1e-3)}
    models = [udd.Disk(0.04), udd.Disk(0.04)]
    base = fit_record(two, record_of(two, models), models, each=["W", "k0"], priors=baseline, search=True)
    kept = {f.name: f for f in as_stated(base).problem.free}
    assert {"k0[0]", "k0[1]", "y0[0]", "y0[1]"} <= set(kept) and "W[0]" not in kept
    assert kept["k0[0]"].sd == 1e-3 and kept["y0[0]"].sd == 1e-5


def test_too_little_is_refused():
    t = np.arange(30) * 0.04
    values = np.full((30, 3), np.nan)
    values[:5] = 0.01
    with pytest.raises(FitError, match="5 usable frames"):
        udd.fit(udd.Measurement(t, values), udd.Disk(0.04))


def test_what_a_solve_left_counts_only_where_it_was_left():
    """The linearisation that goes with a point is for the same record, model and free parameters."""
    truth = udd.Disk(0.04)
    measured, _states = simulated.film(truth, np.random.default_rng(5), 8.0)
    record = record_of(measured, truth)
    fitted = fit_record(measured, record, truth)
    left, bare = fitted.point, fitted.point.without_cache()
    assert left.linear is not None
    assert pickle.loads(pickle.dumps(left)).linear is None
    assert udd.fit(measured, truth).point.linear is None
    shifted = replace(record, seen=record.seen + 1e-4)
    wider = widened(fitted, [udd.effects.slip()])[0]
    for problem in (
        fitted.problem,
        replace(fitted.problem, record=shifted),
        replace(fitted.problem, free=fitted.problem.free[1:]),
        replace(wider, free=(*wider.free, Free("slip.c", "model", 6, 0.0, np.inf))),
    ):
        sets = tuple(
            FilmParameters([*v, 0.0][: len(problem.models[0].parameters)], c, k) for v, c, k in left.sets
        )
        ends = [minimise(problem, replace(p, sets=sets), 1) for p in (left, bare)]
        assert ends[0].chi2 == ends[1].chi2
        assert ends[0].parameters == ends[1].parameters


def test_a_looser_fit_whose_shape_leaves_its_range_is_no_candidate(monkeypatch):
    """Stribeck's fade ran below its range on the way, and the search ended with an error."""
    t = np.arange(0, 10, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    noise = 2e-3 * np.random.default_rng(3).standard_normal(len(t))
    tight = udd.fit(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.05))

    def leaves(*_args, **_options):
        raise SolveError("the fit reached parameters that are invalid for the model")

    monkeypatch.setattr(model_error_schedule, "minimise", leaves)
    assert eased(tight).parameters == tight.parameters


def test_a_wrong_model_reaches_its_most_probable_model_error():
    """The first step from the smallest model error gains 0.01 nats, the last one 800."""
    t = np.linspace(0, 6, 60)
    truth = udd.simulate(udd.Model(["x"], ["0.32 - 0.6*x"]), t, [0.14]).x
    noise = 0.03 * truth * np.random.default_rng(0).standard_normal(len(t))
    decay = udd.Model(["x"], ["-k*x"], {"k": 0.5})
    measured = udd.Measurement(t, {"x": truth + noise})
    tight = fit_record(measured, record_of(measured, decay), decay, search=True)
    assert tight.problem.has_smallest_model_error
    assert eased(tight).level == 0 and eased(tight).evidence > tight.evidence + 1000
