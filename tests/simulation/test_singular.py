"""Names that are taken, and matrices without an inverse: cases of a search, not accidents."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import discovered
import udd
from udd.discovery.experiment_design import hints
from udd.discovery.nonparametric import confounding as absorbing
from udd.discovery.nonparametric.curve_scan import scan_curves
from udd.discovery.nonparametric.penalized_curves import smooth
from udd.discovery.results import Alternative
from udd.discovery.scoring.candidates import renamed
from udd.discovery.scoring.forcing import Score
from udd.discovery.scoring.score_scan import score_of
from udd.discovery.scoring.term_library import waves
from udd.discovery.trial_fits import TrialFit
from udd.discovery.validation.confirmation import _expected


def oscillator() -> udd.Discovery:
    """An oscillator driven by two waves, and braked by dry friction that one of the alternatives is like."""
    t = np.arange(0, 30, 0.1)
    equations = {"x": "v", "v": "-k*x - c*v"}
    known = udd.Model(["x", "v"], equations, {"k": 9.0, "c": 0.1})
    truth = known.with_term("v", "sin(2.1*t)", drive=0.5).with_term("v", "abs(v)*v", drag=-0.05)
    x = udd.simulate(truth, t, [1.0, 0.0]).state[:, 0]
    seen = x + 0.01 * x.std() * np.random.default_rng(1).standard_normal(len(t))
    return udd.discover(udd.Measurement(t, {"x": seen}), known)


def test_an_alternative_whose_name_the_model_has_is_told_apart():
    result = oscillator()
    names = [f.effect.name for f in result.effects]
    assert "wave_in_v" in names and len(names) > 1
    other = next(name for name in names if name != "wave_in_v")
    # Another wave could replace the drag, but the model has a wave already.
    (wave,) = [c.effect for c in waves(result.baseline.model, [0.7]) if c.effect.name == "wave_in_v"]
    title, equation = "a wave", wave.equation
    doubt = Alternative(other, wave.replace(a=0.1, b=0.1), title, equation, nats=1.0, likeness=0.5)
    doubted = replace(result, alternatives=[doubt])
    assert len(hints(doubted)) >= 1
    assert renamed(wave, result.model).name == "wave_in_v_2"
    # The library's own have one name, and are in a model but once.
    disk = discovered.disk()
    assert renamed(disk.effects[0].effect, disk.model) is None


def test_curves_that_cannot_be_told_from_the_parameters_are_a_case(monkeypatch):
    discovery = discovered.nothing()
    curve = scan_curves(discovery.baseline).curves[0]

    def singular(*_):
        raise np.linalg.LinAlgError("the leading minor is not positive definite")

    monkeypatch.setattr(absorbing, "eigh", singular)
    theirs = absorbing.confounded_directions(curve, discovery.baseline)
    np.testing.assert_array_equal(theirs.left(curve.covariance), curve.covariance)


def test_a_covariance_without_an_inverse_tells_what_it_can():
    fit = SimpleNamespace(
        parameters={"a": 1.0, "b": 1.0},
        covariance=np.ones((2, 2)),
        inflation=lambda _before: 1.0,
        shown=1.0,
    )
    tighter = SimpleNamespace(**{**vars(fit), "covariance": np.full((2, 2), 0.5)})
    assert _expected(fit, (fit, tighter), ["a", "b"]) == pytest.approx(1.0)
    effects = [udd.effects.slip(), udd.effects.relaxation()]
    both = [SimpleNamespace(effect=e, amplitude_names=[n]) for e, n in zip(effects, "ab", strict=True)]
    twin = SimpleNamespace(**{**vars(fit), "scatter": 1.0, "covariance": np.zeros((2, 2))})
    assert not TrialFit(both, twin, ["a", "b"], 0.0).needed


def test_scores_that_run_away_say_nothing():
    candidate = SimpleNamespace(effect=udd.effects.slip())
    information = np.full((1, 1), np.nan)
    scored = score_of(candidate, np.ones(1), information, np.ones((1, 1)), 1.0)
    assert scored.absorbed and scored.chi2 == 0.0


def test_a_curve_over_places_that_the_record_hardly_visits_is_finite():
    n = 24
    second = np.diff(np.eye(n), 2, axis=0)
    information = np.zeros((n, n))
    information[:6, :6] = np.diag([1e9, 1e8, 1e6, 1e5, 1e3, 10.0])
    with np.errstate(all="raise", under="ignore"):
        curve = smooth(Score(information[0] * 1e-6, information, information), second.T @ second, 1000)
    assert np.isfinite(curve.coefficients).all() and np.isfinite(curve.covariance).all()
