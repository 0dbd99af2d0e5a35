"""Sections and switches with known times: none is missed, none is seen twice, however long the steps are."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import udd

ALL = ("dopri5", "dop853", "taylor", "rodas", "auto")


def crossed(model: udd.Model, section: str, n: int, start: list[float], **options: Any) -> Any:
    result = udd.poincare(model, section, n, state0=start, transient=0, **options)
    assert result.outcome == "finished"
    return result.t


def ends(model: udd.Model, length: float, start: list[float]) -> dict[str, float]:
    """The first state at the end, by every method and in an ensemble."""
    times = np.arange(0.0, length + 0.025, 0.05)
    results = {how: float(udd.simulate(model, times, start, method=how).state[-1, 0]) for how in ALL}
    many = udd.ensemble(model, length, [start, start]).end[:, 0]
    assert many[0] == many[1]
    return {**results, "ensemble": float(many[0])}


def test_a_section_of_a_turning_rotor_is_crossed_once_in_each_turn() -> None:
    model = udd.Model(["theta", "v"], ["v", "-0.001*v"], angles=["theta"])
    turns = 2 * np.pi * np.arange(1, 6)
    right = -np.log(1 - 1e-3 * (turns - 1) / 3) / 1e-3
    assert crossed(model, "sin(theta)", 5, [1.0, 3.0], direction="up") == pytest.approx(right, abs=1e-6)
    fast = udd.Model(["theta"], ["50"], angles=["theta"])
    right = (np.pi * np.arange(1, 401) - 1) / 50
    result = crossed(fast, "sin(theta)", 400, [1.0], direction="both")
    assert result == pytest.approx(right, abs=1e-9)


@pytest.mark.parametrize("law", ["1", "0", "-y/1000"])
def test_a_strobe_is_seen_whatever_the_solution_does(law: str) -> None:
    model = udd.Model(["y"], [law])
    first = np.arccos(-0.9)
    right = np.sort([2 * np.pi * k + s * first for k in range(4) for s in (1, -1)])[1:7]
    assert crossed(model, "cos(t) + 0.9", 6, [0.5], direction="both") == pytest.approx(right, abs=1e-9)
    late = udd.poincare(model, "cos(t) + 0.9", 3, state0=[0.5], transient=3, direction="both").t
    assert late == pytest.approx(right[3:], abs=1e-9)


def test_every_zero_of_a_cubic_within_one_step_is_seen() -> None:
    model = udd.Model(["y"], ["3*(t-8)^2 + 12*(t-8) - 4"])
    result = crossed(model, "y", 3, [-120.0], direction="both")
    assert result == pytest.approx([2, 6, 10], abs=1e-8)


@pytest.mark.parametrize(
    "zeros",
    [
        [0.52886551, 0.57460867, 11.28904342, 11.7203895],
        [1.46005759, 1.4622204, 2.71011841, 7.81485932, 9.76817696],
        [0.82110098, 2.10879445, 2.32442197, 7.49774936, 9.32671081],
    ],
)
def test_zeros_that_lie_close_within_a_long_step_are_seen(zeros: list[float]) -> None:
    curve = np.polynomial.Polynomial.fromroots(zeros)
    law = " + ".join(f"({c!r})*t^{k}" for k, c in enumerate(curve.deriv().coef.tolist()))
    model, start = udd.Model(["y"], [law]), [float(curve(0.0))]
    more = {"rtol": 1e-12, "atol": 1e-14, "t_max": zeros[-1] + 1e-3}
    result = crossed(model, "y", len(zeros), start, direction="both", **more)
    assert result == pytest.approx(zeros, abs=1e-6)


@pytest.mark.parametrize("near", [0.998, 0.99999, 1 - 1e-8])
def test_a_section_near_a_crest_is_crossed_twice_at_each(near: float) -> None:
    model = udd.Model(["x", "v"], ["v", "-x"])
    before = np.arccos(np.sqrt(near))
    right = np.sort([np.pi * k + s * before for k in range(5) for s in (1, -1)])[1:9]
    result = crossed(model, f"x^2 = {near!r}", 8, [1.0, 0.0], direction="both", rtol=1e-13, atol=1e-15)
    assert result == pytest.approx(right, abs=1e-12 / before)


def test_a_surface_that_is_only_touched_is_not_crossed() -> None:
    model = udd.Model(["y"], ["1"])
    with pytest.warns(udd.errors.IncompleteWarning):
        result = udd.poincare(model, "(t - 3)^2", 1, state0=[0.0], transient=0, direction="both", t_max=50.0)
    assert result.found == 0


def test_pulses_into_a_slow_circuit_are_felt_by_every_method() -> None:
    for level, right in (("cos(pi*0.1)", 0.0932268), ("0", 0.4663205)):
        model = udd.Model(["x"], [f"(where(sin(2*pi*t) > {level}, 1, 0) - x)/5"])
        for how, x in ends(model, 20.0, [0.0]).items():
            assert x == pytest.approx(right, abs=1e-6), how


def test_a_square_wave_on_an_oscillator_switches_at_each_zero() -> None:
    model = udd.Model(["x", "v"], ["v", "-x - 0.2*v + sign(sin(30*t))"])
    for how, x in ends(model, 30.0, [0.0, 0.0]).items():
        assert x == pytest.approx(-0.003992743, abs=1e-6), how
    for how in ALL:
        jumps = udd.simulate(model, 30.0, [0.0, 0.0], method=how).events.of("jump").t
        assert jumps == pytest.approx(np.pi / 30 * np.arange(1, 287), abs=1e-9), how


def test_a_triangle_has_all_its_corners() -> None:
    for how, x in ends(udd.Model(["x"], ["sign(sin(10*t))"]), 20.0, [0.0]).items():
        assert x == pytest.approx(2 * np.pi * 32 / 10 - 20, abs=1e-8), how


def test_a_body_that_sticks_is_let_go_by_a_slow_force() -> None:
    # It slips where 1.5 sin(w t) is 1, and stops where the impulse of the force is that of the friction.
    w = 0.05
    model = udd.Model(["x", "v"], ["v", f"1.5*sin({w}*t) - sign(v)"])
    slip = np.arcsin(1 / 1.5) / w
    for how in ALL:
        run = udd.simulate(model, 100.0, [0.0, 0.0], method=how)
        assert run.events.kind[0] == "slip" and run.events.t[0] == pytest.approx(slip, abs=1e-6), how
        stops = run.events.of("stick").t
        speed = -1.5 / w * (np.cos(w * stops) - np.cos(w * slip)) - (stops - slip)
        assert len(stops) == 1 and abs(speed).max() < 1e-5, how


def test_a_limited_step_finds_a_narrow_pulse() -> None:
    """A smooth pulse between the places of a step is seen by nothing but a shorter step."""
    model = udd.Model(["x"], ["exp(-((t - 50)/0.01)^2)"])
    right = 0.01 * np.sqrt(np.pi)
    for how in ALL:
        run = udd.simulate(model, [0.0, 100.0], [0.0], method=how, max_step=0.01)
        assert run.state[-1, 0] == pytest.approx(right, rel=1e-6), how
        assert np.diff(udd.simulate(model, 10.0, [0.0], method=how, max_step=0.5).t).max() <= 0.5, how
    many = udd.ensemble(model, 100.0, [[0.0], [1.0]], max_step=0.01)
    assert many.end[:, 0] == pytest.approx([right, 1 + right], rel=1e-6)
    with pytest.raises(udd.errors.ModelError, match="max_step"):
        udd.simulate(model, 1.0, [0.0], max_step=0.0)


def test_every_function_that_runs_takes_a_longest_step() -> None:
    model = udd.DLE(1.0)
    few = {"n": 5, "transient": 5}
    plain, short = (udd.poincare(model, **few, **more).t for more in ({}, {"max_step": 0.02}))
    assert 0 < abs(plain - short).max() < 1e-6
    short = udd.lyapunov(model, t=50.0, transient=5.0, tol=10.0, max_step=0.05)
    assert short == pytest.approx(udd.lyapunov(model, t=50.0, transient=5.0, tol=10.0), abs=0.05)
    assert udd.covariant_vectors(model, 5, transient=5.0, max_step=0.05).vectors.shape == (5 + 1, 3, 3)
    end = udd.sweep(
        udd.SweepSpec("final_state", model, {"w": [1.0, 1.1]}, options={"t": 5.0, "max_step": 0.02})
    )
    right = udd.ensemble(model, 5.0, parameters={"w": [1.0, 1.1]}, state0=None).end
    assert np.asarray(end.final_omega) == pytest.approx(right[:, 0], abs=1e-6)
    for refused in (-1.0, 0.0, "x"):
        with pytest.raises(udd.errors.ModelError, match="max_step"):
            udd.poincare(model, n=1, max_step=refused)


@pytest.mark.parametrize("size", [1e-6, 1e-10, 1e-12, 1e-20])
def test_sections_of_tiny_orbits_are_as_accurate_as_of_others(size: float) -> None:
    model = udd.Model(["x", "v"], ["v", "-x"])
    for start in ([size, 0.0], [0.0, -size]):
        first = np.pi * (0.5 if start[0] else 1.0)
        result = crossed(model, "x", 8, start, direction="both")
        assert result == pytest.approx(first + np.pi * np.arange(8), abs=1e-7)


def test_the_section_of_an_angle_that_runs_on_says_what_to_ask() -> None:
    model = udd.Model(["theta"], ["1"], angles=["theta"])
    for section, hint in (("theta", r"sin\(theta\)"), ("theta = 1", r"sin\(theta - 1\)")):
        with pytest.warns(udd.errors.IncompleteWarning, match=hint):
            udd.poincare(model, section, 5, state0=[2.0], transient=0)
    with pytest.warns(udd.errors.IncompleteWarning) as told:
        udd.poincare(model, "sin(theta)", 5, state0=[2.0], transient=0, t_max=3.0)
    assert "modulo" not in str(told[0].message)


def campaign() -> ModuleType:
    path = Path(__file__).resolve().parents[2] / "benches" / "python" / "crossings.py"
    spec = importlib.util.spec_from_file_location("crossings", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["crossings"] = module
    spec.loader.exec_module(module)
    return module


def test_random_sections_and_switches_agree_with_their_closed_forms() -> None:
    crossings = campaign()
    wrong = {name: crossings.faults(case) for name, case in crossings.cases(46, 40)}
    assert {name: own for name, own in wrong.items() if own} == {}


def test_the_shared_cases(shared: Path) -> None:
    cases = json.loads((shared / "cases" / "turn3" / "events.json").read_text())
    for name, case in cases.items():
        model = udd.Model(case["states"], case["equations"], angles=case.get("angles", ()))
        if "section" in case:
            result = crossed(model, case["section"], case["n"], case["start"], direction=case["direction"])
            assert result == pytest.approx(case["times"], abs=2e-6), name
        else:
            for how, x in ends(model, case["t_end"], case["start"]).items():
                assert x == pytest.approx(case["x_end"], abs=1e-6), (name, how)
