"""Numbers in a unit other than assumed, and strong effects that are not mistaken for a wrong unit."""

from __future__ import annotations

import functools
import sys
import warnings
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
def record(hidden: str, seed: int = 2, duration: float = 20.0) -> udd.Measurement:
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
    result = udd.fit(record(hidden, seed), udd.Disk(DRIVE))
    assert result.parameters["W"] > 0 and abs(result.parameters["clock"]) < 0.5


def test_a_strong_relaxation_is_found_with_the_drive_as_stated():
    truth = udd.Disk(DRIVE, effects=STRONG["relaxation"])
    measured, _states = simulated.film(truth, np.random.default_rng(2), 20.0)
    result = udd.discover(measured, udd.Disk(DRIVE))
    assert result.verdict == "effect identified"
    assert {"relaxation", "slip"} >= {f.effect.name for f in result.effects} and len(result.effects) == 1
    assert abs(result.fit.parameters["W"] / DRIVE - 1) < 0.01
    ((pull, error),) = [(f.parameters[a], f.errors[a]) for f in result.effects for a in f.effect.amplitudes]
    pull, error = (pull, error) if pull > 1 else (pull / DRIVE, error / DRIVE)  # a slip b W Z
    assert abs(pull - 12.0) < 4.5 * np.hypot(error, 0.004 * 12)


def fitted(measured: udd.Measurement, model: udd.Model) -> tuple[udd.Fit | None, str]:
    """The fit, None if the model as stated cannot be fitted, and the warnings and errors on the way."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            result = udd.fit(measured, model)
        except FitError as error:
            return None, f"{error}; {'; '.join(str(entry.message) for entry in said)}"
    return result, "; ".join(str(item.message) for item in said)


@pytest.mark.parametrize("hidden", STRONG)
@pytest.mark.parametrize(
    "factor", [0.01, 100, *(pytest.param(f, marks=pytest.mark.nightly) for f in (0.1, 10, 1000))]
)
def test_a_drive_in_another_unit_is_reported(hidden, factor):
    result, said = fitted(record(hidden), udd.Disk(factor * DRIVE))
    if result is None or not abs(result.parameters["W"] / DRIVE - 1) < 0.05:
        assert "check the drive and its unit" in said
        assert f"drive of {DRIVE:.3g} m/s, where {factor * DRIVE:g} m/s was stated" in said


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


@pytest.mark.parametrize("factors", [{"t": 1e3}, {"theta": 180 / np.pi}])
def test_numbers_that_cannot_be_a_pendulums_are_asked_about(factors):
    with pytest.raises(FitError, match=r"are they in ms|is it in degrees"):
        udd.fit(scaled(swing(0.7), **factors), udd.Pendulum(0.8, k0=0.02))


def test_an_angle_in_degrees_that_may_be_one_in_rad_is_a_remark():
    """Three degrees: less than half a turn if it were in rad. The fit is that of the numbers as stated."""
    result, said = fitted(scaled(swing(0.05), theta=180 / np.pi), udd.Pendulum(0.8, k0=0.02))
    assert "whose angle is in degrees, not in rad; the fit continues with the given units" in said
    assert result is not None and "degrees" in result.unit_doubt
    assert any("degrees" in line for line in result.doubts.sentences) and "degrees" in result.summary()


@pytest.mark.parametrize(("amplitude", "length"), [(0.7, 0.08), (0.05, 8.0), (0.7, 80.0)])
def test_a_length_in_another_unit_is_a_remark(amplitude, length):
    _found, said = fitted(swing(amplitude), udd.Pendulum(length, k0=0.02))
    assert f"pendulum of 0.8 m, where {length:g} m was stated" in said


def test_wrong_units_are_refused_on_the_last_part_of_a_record(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits of 0.8 mm and 8 mm, which spin 20,000 times a second, took 4.3 of 4.7 s of processor time."""
    t = np.arange(0, 40, 0.04)
    hidden = E.formula("torque", "-3*theta^3", name="hidden")
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01, effects=[hidden]), t, [0.0, 1.2]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t))})
    lengths = []

    def noted(problem, start):  # type: ignore[no-untyped-def]
        lengths.append((problem.models[0].parameters["length"], len(problem.record.t)))
        return solved(problem, start)

    module = sys.modules["udd.fitting.units"]
    solved = module.solve_with_noise
    monkeypatch.setattr(module, "solve_with_noise", noted)
    _found, said = fitted(measured, udd.Pendulum(0.8, k0=0.02))
    assert "the fit continues with the given units" in said
    # Lengths of another decade are fitted to 100 frames alone, and what swings between frames not at all.
    assert {frames for length, frames in lengths if length != 0.8} == {100}
    assert min(length for length, _frames in lengths) == pytest.approx(0.008)


@pytest.mark.parametrize("amplitude", [0.05, 1.57])
@pytest.mark.parametrize("factor", [1.0, 0.4, 2.5])
def test_a_length_that_is_somewhat_off_is_no_wrong_unit(amplitude, factor):
    """Neither is the angle in degrees, nor the length in dm: the fit finds the length, and says so."""
    result, said = fitted(swing(amplitude), udd.Pendulum(0.8 * factor, k0=0.02))
    assert said == "" and result is not None and result.unit_doubt is None
    pace = result.parameters["length"] / result.parameters["inertia"]
    assert pace == pytest.approx(1 / 0.8, rel=2e-3)
    assert bool(result.doubts.ran_off) == (factor != 1.0)


def test_a_pendulum_that_goes_over_the_top_is_in_rad_whatever_its_length():
    """Its angle bends more than a pendulum of 40 m can bend it, but as the sine of an angle in rad does."""
    t = np.arange(0, 30, 0.04)
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.05), t, [9.0, 0.1]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t))})
    assert np.ptp(measured.values) > 2 * np.pi
    for length in (8.0, 40.0):
        assert "degrees" not in fitted(measured, udd.Pendulum(length, k0=0.02))[1]


def test_a_record_finer_than_usual_noise_is_in_rad():
    """Shrunk to degrees it must not drown in the noise that films usually have: that shrinks with it."""
    t = np.arange(0, 8, 0.02)
    drag = [E.quadratic_drag(c=0.1)]
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01, effects=drag), t, [0.0, np.pi / 2]).state[:, 1]
    noise = 1e-4 * np.random.default_rng(2).standard_normal(len(t))
    measured = udd.Measurement(t, {"theta": theta + noise}, sigma=np.full((len(t), 1), 1e-4))
    result, said = fitted(measured, udd.Pendulum(2.0, k0=0.02))
    assert said == "" and result is not None


@pytest.mark.parametrize(("amplitude", "sign"), [(0.05, 1), (0.7, -1)])
def test_an_angle_from_the_upright_is_reported(amplitude, sign):
    # With y down the angle of a bob's position has the other sign, too.
    upside = udd.Measurement(swing(amplitude).t, np.pi + sign * swing(amplitude).values)
    _found, said = fitted(upside, udd.Pendulum(0.8, k0=0.02))
    assert (
        "y points down, or the angle is counted from the upright: y must point up, the angle from the lowest"
        in said
    )


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
    result = discovered.disk()
    assert result.remarks == [] and discovered.nothing().remarks == []
    fit = result.fit
    far = replace(fit, parameters={**fit.parameters, "W": 0.2 * discovered.DRIVE})
    doubted = replace(result, fit=far)
    (remark,) = doubted.remarks
    assert remark.startswith("A parameter is far from its given value: W = 0.0084 ± ")
    # It is printed with the verdict, not instead of it.
    assert as_text(summary_of(doubted)).splitlines()[0] == as_text(summary_of(result)).splitlines()[0]
    assert f"  {remark}\n".replace("±", "+-") in as_text(summary_of(doubted))
    doubted.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert f'<p class="warn">{remark}</p>' in page and "<strong>effect" in page
    fixed = {name: value for name, value in fit.parameters.items() if name not in ("W", "clock")}
    (remark,) = replace(
        result,
        fit=replace(
            fit,
            parameters=fixed,
            problem=replace(fit.problem, free=tuple(f for f in fit.problem.free if f.name in fixed)),
        ),
    ).remarks
    assert remark.startswith("Fixed at their given values, because they diverge if they are free: W, clock.")


@pytest.mark.parametrize("text", ["a*tan(3*theta)", "a*exp(Omega^4)"])
def test_a_law_that_cannot_be_integrated_blames_no_unit(text):
    # Any other unit made the angle or the speed so small that the law could be integrated.
    t = np.arange(0, 40, 0.04)
    theta = udd.simulate(udd.Pendulum(0.5, k0=0.01), t, [0.0, 1.0]).state[:, 1]
    record = udd.Measurement(t, {"theta": theta + 5e-3 * np.random.default_rng(1).standard_normal(len(t))})
    law = udd.effects.formula("torque", text, a=0.1)
    with pytest.raises(udd.FitError, match="could not be integrated") as refused:
        udd.fit(record, udd.Pendulum(0.5, k0=0.01, effects=[law]), free=["formula.a"])
    assert "degrees" not in str(refused.value) and "stated" not in str(refused.value)
