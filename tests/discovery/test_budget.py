"""A search that is given so many seconds, and records of too many or of few frames."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from discovered import in_air
from udd._util.parallel import parallel_map
from udd.discovery import time_budget
from udd.errors import FitError
from udd.fitting import minimise
from udd.fitting.thinning import thinned
from udd.report import as_text, summary_of


def test_a_search_without_time_says_so_and_claims_nothing(tmp_path):
    said: list[str] = []
    result = udd.discover(*in_air(), budget=1e-6, progress=said.append)
    assert result.effects == [] and result.scans == []
    assert result.stopped == "scoring candidates" and result.to_dict()["stopped"] == result.stopped
    assert result.verdict != "nothing missing"
    assert "The search ended after 1e-06 s, as asked" in as_text(summary_of(result)).splitlines()[0]
    assert said == ["fitting the known model", "fitting the model as found"]
    result.report(tmp_path / "page.html")
    assert "as asked" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_search_whose_model_explains_its_data_is_not_finished_without_time():
    measured, model = in_air()
    right = model.with_effects([udd.effects.quadratic_drag(c=0.02)])
    result = udd.discover(measured, right, budget=1e-6)
    assert result.verdict == "search not finished"
    assert as_text(summary_of(result)).startswith(
        "search not finished: The search has not ended: no missing effect was found so far"
    )


def test_what_passed_before_the_time_was_up_stands(monkeypatch):
    # The clock stops once a further effect is sought.
    plain = time_budget.Clock.tell

    def tell(self: time_budget.Clock, text: str) -> None:
        self.end = 0.0 if "further" in text else np.inf
        plain(self, text)

    monkeypatch.setattr(time_budget.Clock, "tell", tell)
    measured, baseline = in_air()
    result = udd.discover(measured.slice(0, 20), baseline, budget=100.0)
    assert [f.title for f in result.effects] == ["quadratic drag"]
    assert result.stopped == "scoring candidates for a further effect"
    assert "further effects were not tried" in as_text(summary_of(result)).splitlines()[0]


def test_no_fit_of_a_stage_starts_once_the_time_is_up():
    # A curve takes dozens of fits; before, all of them ran: 117 s after a budget of 40 s.
    measured, model = in_air()
    fitted = udd.fit(measured.slice(0, 5), model)
    clock = time_budget.Clock(60.0, str)

    def again(_piece: int) -> udd.fitting.Fit:
        return minimise(fitted.problem, fitted.point)

    with clock.limited():
        assert [fit.chi2 for fit in parallel_map(again, range(2))] == [again(0).chi2] * 2
        clock.end = 0.0
        with pytest.raises(time_budget.TimeUpError):
            parallel_map(again, range(2))
    assert again(0).converged  # the last fits run in any case


@pytest.mark.parametrize("budget", [0.0, -1.0, "soon", float("nan")])
def test_a_budget_is_a_positive_number(budget):
    with pytest.raises(FitError, match="the budget must be a positive number of seconds"):
        udd.discover(*in_air(), budget=budget)


def swing(rate: float, noise: float) -> tuple[udd.Measurement, np.ndarray]:
    """A pendulum's angle over 30 s, so many times a second, and the same without noise."""
    t = np.arange(0, 30, 1 / rate)
    theta = udd.simulate(udd.Pendulum(0.5, k0=0.01), t, [0.0, 1.0]).state[:, 1]
    seen = theta + noise * np.random.default_rng(2).standard_normal(len(t))
    seen[12000:12500] = np.nan
    seen[::97] += 0.5
    return udd.Measurement(t, {"theta": seen}, sigma=np.full((len(t), 1), noise)), theta


def test_block_averages_keep_what_a_record_says():
    measured, theta = swing(1000.0, 5e-3)
    result = thinned(measured)
    few = result.measurement
    assert (result.frames, result.every) == (29500, 8)
    assert len(few) < 4000
    assert few.t[0] == measured.t[0] and not few.seen[0]  # from where the model's time counts
    few = few.rows(np.flatnonzero(few.seen))
    off = few["theta"] - np.interp(few.t, measured.t, theta)
    # White noise, whose mean over a block is corrected for the motion's bend: 18 % more variance.
    assert np.sqrt((off**2).mean()) == pytest.approx(5e-3 / np.sqrt(8) * np.sqrt(1.18), rel=0.1)
    assert np.median(few["sigma_theta"]) == pytest.approx(5e-3 / np.sqrt(8), rel=0.1)
    assert abs(off).max() < 6 * 5e-3 / np.sqrt(8)  # neither the odd frames nor the gap left a trace
    assert off.mean() == pytest.approx(0.0, abs=1e-4)


def test_what_needs_its_frames_keeps_them():
    t = np.arange(20000) / 1000
    fast = np.sin(2 * np.pi * 100 * t) + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    assert thinned(udd.Measurement(t, {"x": fast})).every == 1
    slow, _theta = swing(250.0, 5e-3)  # few enough as it is
    assert thinned(slow).measurement is slow


def test_a_motion_that_dies_down_below_its_noise_is_averaged():
    t = np.arange(0, 156, 0.01)
    theta = 2.0 * np.exp(-t / 4) * np.cos(7 * t)
    noise = 0.01 * np.random.default_rng(0).standard_normal(len(t))
    result = thinned(udd.Measurement(t, {"theta": theta + noise}))
    assert result.every >= 3
    few = result.measurement.rows(np.flatnonzero(result.measurement.seen))
    off = few["theta"] - np.interp(few.t, t, theta)
    assert np.sqrt((off**2).mean()) == pytest.approx(0.01 * np.sqrt(1.18 / result.every), rel=0.1)
    # As the pull of a brake that bends the motion within a few frames is at its start.
    fast = udd.Measurement(t, {"theta": 2.0 * np.exp(-t / 4) * np.cos(150 * t) + noise})
    assert thinned(fast).every == 1
    # A motion below its noise has no time scale.
    assert thinned(udd.Measurement(t, {"theta": noise})).every >= 3


def test_frames_with_a_lost_column_are_left_out_of_the_averages():
    t = np.arange(0, 156, 0.01)
    rng = np.random.default_rng(0)
    seen = np.stack([np.cos(3 * t), np.sin(3 * t)], axis=-1) + 3e-3 * rng.standard_normal((len(t), 2))
    gone = rng.choice(len(t), 200, replace=False)
    seen[gone, 1] = np.nan
    result = thinned(udd.Measurement(t, seen, names=("a", "b")))
    assert (result.every, result.frames) == (4, len(t))
    assert np.isfinite(result.measurement.values[1:]).all()


def test_a_discovery_says_what_was_averaged():
    t = np.arange(0, 20, 0.001)
    truth = udd.Pendulum(0.6, k0=0.004, effects=[udd.effects.quadratic_drag(c=0.02)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    noise = 5e-3 * np.random.default_rng(3).standard_normal(len(t))
    record = udd.Measurement(t, {"theta": theta + noise})
    result = udd.discover(record, udd.Pendulum(0.6, k0=0.01), budget=1e-6)  # said whatever is found
    assert "The record's 20000 frames were averaged in blocks of 5, to 3998" in result.remarks[-1]


def test_a_fall_of_a_second_shows_the_air():
    t = np.arange(60) / 60
    truth = udd.Model(["x", "v"], ["v", "g - c*abs(v)*v"], {"g": 9.81, "c": 0.3})
    x = udd.simulate(truth, t, [0.0, 0.0]).state[:, 0]
    baseline = udd.Model(["x", "v"], ["v", "g"], {"g": 9.81})
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    for n, verdict in ((60, "effect identified"), (30, "effect present, form not identified")):
        result = udd.discover(udd.Measurement(t[:n], {"x": (x + noise)[:n]}), baseline)
        assert result.verdict == verdict
    still = udd.simulate(baseline, t, [0.0, 0.0]).state[:, 0]
    assert udd.discover(udd.Measurement(t, {"x": still + noise}), baseline).verdict == "nothing missing"
