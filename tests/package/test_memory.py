"""Results that do not fit into memory are refused beforehand, by MemoryError with one sentence."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
import pytest

import udd
from own_process import memory_error_of
from udd import _core
from udd.errors import ModelError

# Each runs in a process with little room: where it is not refused it is killed, and nothing else is.
CASES = {
    "intervals": "udd.covariant_vectors(udd.DLE(1.0), 20, dt=1e-10, transient=5.0)",
    "tiny intervals": "udd.covariant_vectors(udd.DLE(1.0), 20, dt=1e-320)",
    "many intervals": "udd.covariant_vectors(udd.DLE(1.0), 2**60)",
    "searched states": "udd.equilibria(udd.DLE(1.0), initial_states=2**53 + 1)",
    "values of a parameter": "udd.connections(udd.DLE(4.0, B=0.2), 'w', (4.0, 4.5), n=2**50)",
    "section points": "udd.poincare(udd.DLE(1.0), n=10**12)",
    "points of a diagram": "udd.bifurcation(udd.DLE(1.0), 'w', [1.0, 2.0], n=10**12)",
    "cells of a basin": "udd.basins(udd.DLE(6.2), {a: np.arange(1e4) for a in ('omega', 'y', 'z')})",
    "followed basins": "udd.basins(udd.DLE(6.2), {'z': [0.0, 1.0]}, n=10**12)",
    "runs of a sweep": (
        "udd.sweep(udd.SweepSpec('outcome', udd.DLE(1.0),"
        " {a: np.linspace(1, 2, 10**5) for a in ('w', 'omega')}, [1, 1, 1], {'t': 1.0}))"
    ),
    "times": "udd.simulate(udd.DLE(1.0), np.arange(5e7), [1, 1, 1])",
    "runs": "udd.ensemble(udd.DLE(1.0), np.arange(10_000), np.ones((100_000, 3)))",
    "states up to a longest period": "udd.periodic_orbit(udd.DLE(9.0), max_period=2**31)",
    "times of an endless search": "udd.connections(udd.DLE(4.0, B=0.2), 'w', (4.0, 4.5), n=2, t_max=1e308)",
    "times of a cycle": "udd.periodic_orbit(udd.DLE(9.0)).trajectory(10**12)",
}


@pytest.mark.skipif(sys.platform != "linux", reason="a limit of memory for a process of its own")
@pytest.mark.parametrize("name", CASES)
def test_results_that_do_not_fit_into_memory_are_refused(name: str) -> None:
    message = memory_error_of(CASES[name])
    assert "GB" in message and len(message) <= 300, message


@pytest.mark.parametrize("shape", [(10**12,), (10**12, 3)])
def test_arrays_that_stand_for_larger_ones_are_refused_before_they_are_copied(shape: tuple[int, ...]) -> None:
    repeated, dle = np.broadcast_to(1.0, shape), udd.DLE(10.0)
    calls: list[Callable[[], object]] = [
        lambda: dle.rates(0.0, repeated) if len(shape) > 1 else dle.rates(repeated, [1, 1, 1]),
        lambda: udd.ensemble(dle, 1.0, repeated),
        lambda: udd.bifurcation(dle, "w", repeated),
        lambda: udd.equilibria(dle, near=repeated),
    ]
    for call in calls:
        with pytest.raises(MemoryError, match=r"^the numbers of .* take .* GB, .* no room"):
            call()


@pytest.mark.parametrize("max_step", [1e-320, 1e-13])
def test_steps_too_short_for_a_run_to_end_are_refused(max_step: float) -> None:
    dle, start = udd.DLE(10.0), [1.0, 1.0, 0.1]
    calls: list[Callable[[], object]] = [
        lambda: udd.simulate(dle, 1.0, start, max_step=max_step),
        lambda: udd.simulate(dle, [-1.0, 0.0], start, max_step=max_step),
        lambda: udd.ensemble(dle, 1.0, start, max_step=max_step),
        lambda: udd.lyapunov(1.0, max_step=max_step),
        lambda: udd.lyapunov_spectrum(1.0, max_step=max_step),
        lambda: udd.covariant_vectors(dle, 5, max_step=max_step),
        lambda: udd.poincare(dle, n=5, max_step=max_step),
        lambda: udd.basins(dle, {"z": [0.0, 1.0]}, n=12, max_step=max_step),
        lambda: udd.SweepSpec("outcome", dle, {"w": [1.0]}, start, {"t": 5.0, "max_step": max_step}),
    ]
    for call in calls:
        with pytest.raises(ModelError, match=r"max_step is .*: a run of .* more than 1e\+12 such steps"):
            call()
    assert udd.simulate(dle, 1e-9, start, max_step=1e-13).outcome == "finished"


def test_what_fits_is_not_refused() -> None:
    _core.require_memory("numbers", 1e6)
    with pytest.raises(MemoryError, match=r"^9 grids take 7200\.000 GB, .* no room: .* free\."):
        _core.require_memory("9 grids", 7.2e12)
    for bytes_ in (float("inf"), 1e300):
        with pytest.raises(MemoryError):
            _core.require_memory("grids", bytes_)


@pytest.mark.parametrize("count", [2**62 + 1, 10**30, 10**400])
def test_counts_beyond_the_numbers_of_the_core_are_refused(count: int) -> None:
    dle = udd.DLE(1.0)
    calls: list[Callable[[], object]] = [
        lambda: udd.poincare(dle, n=count),
        lambda: udd.poincare(dle, n=5, transient=count),
        lambda: udd.covariant_vectors(dle, count),
        lambda: udd.bifurcation(dle, "w", [1.0, 2.0], transient=count),
        lambda: udd.equilibria(dle, initial_states=count),
    ]
    for call in calls:
        with pytest.raises(ModelError, match=r"must be a whole number of at most 2\^62"):
            call()
