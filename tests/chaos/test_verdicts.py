"""Verdicts on motions of known kind, wherever their origin is and however large they are."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from known_attractors import drawn

XV = ["x", "v"]


@pytest.mark.parametrize(
    ("model", "start", "verdict", "dimension"),
    [
        # Linear: every orbit but one goes to infinity.
        (udd.Model(["x", "y"], ["0.1*x - y", "x + 0.1*y"]), [0.5, 0.5], "escapes", np.nan),
        (udd.Model(["x", "y"], ["0.2*x", "-y"]), [1e-3, 1.0], "escapes", np.nan),
        (udd.Model(["x"], ["x^2"]), [1.0], "escapes", np.nan),
        (udd.Model(["x", "y"], ["1", "-y"]), [1.0, 1.0], "escapes", np.nan),
        # Two exponents of -0.05: no cycle.
        (udd.Model(XV, ["v", "-(x - 0.5) - 0.1*v"]), [1.0, 0.0], "equilibrium", 0.0),
        (udd.Model(XV, ["v", "-(x + 1e4) - 0.1*v"]), [1.0, 0.0], "equilibrium", 0.0),
        # One exponent is zero and nothing rests.
        (
            udd.Model(["q", "v"], ["v", "2 - 0.5*v - sin(q)"], angles=["q"]),
            [0.0, 3.0],
            "periodic orbit",
            1.0,
        ),
        (udd.Model(["q"], ["1.5 - sin(q)"], angles=["q"]), [0.0], "periodic orbit", 1.0),
        (udd.Model(["q"], ["0.5 - sin(q)"], angles=["q"]), [0.0], "equilibrium", 0.0),
        (udd.Model(XV, ["v", "(1 - (x - 1e3)^2)*v - (x - 1e3)"]), [1001.0, 0.0], "periodic orbit", 1.0),
        (udd.Model(XV, ["v", "(1 - (x/1e-4)^2)*v - x"]), [1e-4, 0.0], "periodic orbit", 1.0),
        # Rates that depend on time: the exponent of time is none of the two, both below zero.
        (udd.Model(XV, ["v", "-x - 0.2*v + cos(0.8*t)"]), [1.0, 0.0], "periodic orbit", 1.0),
    ],
)
def test_verdicts(model: udd.Model, start: list[float], verdict: str, dimension: float) -> None:
    spectrum = udd.lyapunov_spectrum(model, state0=start)
    assert spectrum.verdict == verdict
    assert spectrum.dimension == dimension or np.isnan([spectrum.dimension, dimension]).all()


# Decays that are slower than any exponential. The distance from 0 falls with a power of the time.
@pytest.mark.parametrize(
    ("rates", "start"),
    [
        (["-x^3"], [1.0]),
        (["-x^3"], [-0.01]),
        (["-x^3"], [1e4]),
        (["-(x - 5)^5"], [3.0]),
        (["-1e-9*x"], [3.0]),
        (["-x^2"], [1.0]),
        (["v", "-v - x^3"], [10.0, 0.0]),
        (["x*v", "-v - x^2"], [1.0, 1.0]),
        (["-x^3", "-v^3", "-z"], [1.0, 2.0, 3.0]),
    ],
)
@pytest.mark.filterwarnings("ignore::udd.errors.ConvergenceWarning")  # exponents that end at 0
def test_a_slow_decay_is_no_escape(rates: list[str], start: list[float]) -> None:
    model = udd.Model([*XV, "z"][: len(rates)], rates)
    assert udd.lyapunov_spectrum(model, state0=start).verdict == "equilibrium"


@pytest.mark.filterwarnings("ignore::udd.errors.ConvergenceWarning")
def test_a_slow_spiral_is_no_escape() -> None:
    model = udd.Model(XV, ["-x^3 + v^3", "-v^3 - x^3"])
    assert udd.lyapunov_spectrum(model, state0=[1.0, 2.0]).verdict != "escapes"


# The distance from rest falls with the root of the logarithm of the time, or with the logarithm.
@pytest.mark.parametrize(
    ("rate", "start"),
    [("-x*exp(-1/x^2)", 1.0), ("-(x - 5)*exp(-1/(x - 5)^2)", 6.0), ("-x*exp(-1/abs(x))", -0.5)],
)
@pytest.mark.filterwarnings("ignore::udd.errors.ConvergenceWarning")
def test_the_slowest_decay_is_no_escape(rate: str, start: float) -> None:
    assert udd.lyapunov_spectrum(udd.Model(["x"], [rate]), state0=[start]).verdict != "escapes"


# The same laws with other signs, and speeds that fall with the time.
@pytest.mark.parametrize(
    ("rates", "start"),
    [
        (["1/(1 + x^2)"], [0.0]),
        (["1e-3"], [1e6]),
        (["x^3"], [1e-3]),
        (["-x^2"], [-1.0]),
        (["x*v", "-v + x^2"], [0.1, 0.1]),
        (["2*x*v + 3*x^3", "-v - x^2"], [0.1, 0.1]),
        (["-x^3", "1"], [1.0, 0.0]),
    ],
)
def test_a_slow_escape_is_no_decay(rates: list[str], start: list[float]) -> None:
    assert udd.lyapunov_spectrum(udd.Model(XV[: len(rates)], rates), state0=start).verdict == "escapes"


def test_a_running_phase_has_its_period() -> None:
    # Adler's equation: T = 2 pi/sqrt(a^2 - 1).
    model = udd.Model(["q"], ["a - sin(q)"], {"a": 1.5}, angles=["q"])
    spectrum = udd.lyapunov_spectrum(model, state0=[0.0])
    assert spectrum.period == pytest.approx(2 * np.pi / np.sqrt(1.25), rel=1e-6)


def test_a_passage_by_an_equilibrium_is_no_rest() -> None:
    # From 1e-12 beside the saddle (0, 0) of two wells without friction, whose orbit is a cycle around both.
    model = udd.Model(XV, ["v", "x - x^3"])
    assert udd.lyapunov_spectrum(model, state0=[1e-2, 0.0]).verdict != "equilibrium"


def test_a_disk_that_leaves_and_a_law_that_ends_are_no_escape() -> None:
    with pytest.raises(udd.errors.IntegrationError, match="left the wheels"):
        udd.lyapunov_spectrum(udd.Disk(0.039))
    with pytest.raises(udd.errors.IntegrationError, match=r"step size shrank to nothing at t = 0\.77"):
        udd.lyapunov_spectrum(udd.Model(["x"], ["sqrt(x) - 2"]), state0=[1.0])


# One of each kind with another origin and other units, and others that were wrong once; the whole is in
# benches/python/known_attractors.py.
@pytest.mark.parametrize("number", [32, 36, 39, 40, 47, 48, 49, 53, 57, 60])
def test_known_attractors(number: int) -> None:
    case = list(drawn(number + 1, 7))[number]
    spectrum = udd.lyapunov_spectrum(
        case.model, state0=case.start, tol=5e-3 * max(1.0, case.model.time_scale)
    )
    assert spectrum.verdict == case.kind
