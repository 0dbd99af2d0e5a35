"""What is found where the known model alone goes far astray, or its parameters are not determined."""

from __future__ import annotations

import numpy as np

import udd
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.look_alikes import look_alikes


def noisy(model: udd.Model, start: list[float], share: float) -> udd.Measurement:
    """A run of 10 s with noise that grows with what is read."""
    t = np.linspace(0.0, 10.0, 512)
    run = udd.simulate(model, t, start).state
    read = run * (1.0 + share * np.random.default_rng(0).standard_normal(run.shape))
    return udd.Measurement(t, dict(zip(model.state_names, read.T, strict=True)))


def test_a_form_is_found_whose_score_ranks_below_those_of_others_like_it() -> None:
    """Around a laser model without its inversion's decay eight other products score higher than x*y."""
    known = {"x": "a*(y - x)", "y": "b*(x*z - y)", "z": "c - d*z"}
    values = {"a": 0.1, "b": 0.21, "c": 0.34 * 4.1, "d": 0.34}
    truth = udd.Model(list("xyz"), known | {"z": known["z"] + " - k*x*y"}, values | {"k": 1.054})
    found = udd.discover(noisy(truth, [1.3, 1.1, 0.89], 0.01), udd.Model(list("xyz"), known, values))
    names = [s.candidate.effect.name for s in found.scans[0]]
    assert names.index("x_y_in_z") > 6
    assert [f.effect.name for f in found.effects] == ["x_y_in_z"]
    assert abs(found.fit.parameters["x_y_in_z.c1"] + 1.054) < 4 * found.fit.errors["x_y_in_z.c1"]


def test_what_does_nearly_the_same_along_a_motion_is_listed_whatever_its_score() -> None:
    """Lorenz' equations near rest, where z hardly changes: x*z^2 does what x*z does."""
    known = udd.Model(list("xyz"), {"x": "10*(y - x)", "y": "14*x - y", "z": "x*y - b*z"}, {"b": 8.0 / 3.0})
    wrong = known.with_effects([udd.effects.formula("y'", "c*x*z^2", c=-0.07)])
    t = np.linspace(0.0, 10.0, 512)
    run = udd.simulate(wrong, t, [6.0, 6.3, 13.5]).state  # around rest, where z is 13
    fitted = udd.fit(udd.Measurement(t, dict(zip("xyz", run.T, strict=True))), wrong)
    found = look_alikes(known, fitted, library(known))
    names = [candidate.effect.name for candidate, _amplitude in found]
    at = names.index("x_z_in_y")
    assert 0 <= at < 4
    assert abs(found[at][1] + 0.07 * fitted.states[:, 2].mean()) < 0.02
    assert "y_in_z" not in names


def test_all_data_are_fitted_from_where_the_fit_of_the_first_part_ended() -> None:
    """Fitted to all data the known model loses turns, and from there no better one finds back."""
    known = {"x": "k + sin(y)*cos(x)", "y": "sin(y)*cos(x)"}
    values = {"k": 1.53}
    truth = udd.Model(["x", "y"], known | {"y": "m + " + known["y"]}, {"k": 1.432, "m": 0.972})
    model = udd.Model(["x", "y"], known, values, angles=["x", "y"])
    found = udd.discover(noisy(truth, [2.2, 0.67], 0.02), model)
    # A dry friction of x', which never turns, would be a constant too.
    titles = {"1 in y'", "dry friction of x' in y'"}
    assert {f.title for f in found.effects} | {a.title for a in found.alternatives} == titles
    assert found.fit.scatter < 1.2


def test_parameters_that_the_data_do_not_determine_are_held_near_what_was_stated() -> None:
    """Two constants that stand only in a product, and a drag that is missing."""
    t = np.arange(0.0, 40.0, 0.05)
    known = {"q": "w", "w": "-a*b*sin(q) - g*w"}
    truth = udd.Model(
        ["q", "w"], known | {"w": known["w"] + " - 0.05*abs(w)*w"}, {"a": 2.0, "b": 3.0, "g": 0.02}
    )
    run = udd.simulate(truth, t, [1.2, 0.0]).state[:, 0]
    measured = udd.Measurement(t, {"q": run + 2e-3 * np.random.default_rng(1).standard_normal(len(t))})
    stated = udd.Model(["q", "w"], known, {"a": 2.2, "b": 2.8, "g": 0.05}, angles=["q"])
    found = udd.discover(measured, stated)
    assert [f.effect.name for f in found.effects] == ["abs_w_w_in_w"]
    assert found.undetermined == ("a", "b")
    assert any("do not determine a, b" in said for said in found.remarks)
    values = found.fit.parameters
    assert abs(values["a"] * values["b"] - 6.0) < 0.02  # their product is
    assert found.fit.errors["a"] > 0.3 * values["a"]
