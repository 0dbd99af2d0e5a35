"""Every picture, drawn bare: its axes fill half of the figure or more, and no text covers another."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import discovered
import udd
from every_result import branch, disk_run, results
from layout import HALF, overlaps, share_of_axes
from udd.fitting.innovations import innovations


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def test_every_kind_of_result_is_drawn_well() -> None:
    complaints = {}
    for name, result in results().items():
        ax = udd.plot.draw(result)
        complaints[name] = complaint(ax.figure)
        if hasattr(result, "plot") and not hasattr(result, "data_vars"):
            assert result.plot().get_xlabel() == ax.get_xlabel()
        elif not hasattr(result, "data_vars"):
            complaints[name].append("no method plot")
        plt.close("all")
    assert {name: said for name, said in complaints.items() if said} == {}


def complaint(figure: Any) -> list[Any]:
    share = share_of_axes(figure)
    return ([f"axes fill {share:.2f}"] if share < HALF else []) + overlaps(figure)


def pixels() -> Any:
    return SimpleNamespace(
        centre=np.array([[20.0, 30.0]]),
        marks=np.array([[[20.0, 20.0], [30.0, 30.0], [20.0, 40.0], [10.0, 30.0]]]),
        colours=[(230, 120, 30), (60, 160, 60), (50, 90, 200), (220, 50, 50)],
        radius=14.0,
        pivot=np.array([25.0, 33.0]),
    )


def curve() -> Any:
    return discovered.disk().curves[0][0]


#: The other functions; with `draw` above all of `udd.plot` is drawn.
BARE: dict[str, Callable[[], Any]] = {
    "geometry": lambda: udd.plot.geometry(),
    "geometry, side": lambda: udd.plot.geometry(view="side"),
    "geometry, a state": lambda: udd.plot.geometry(state=[0.0, 0.02, -0.03, np.pi / 2]),
    "geometry, low": lambda: udd.plot.geometry(state=[0.0, -0.05, -0.03, 4.0]),
    "geometry, at the contact": lambda: udd.plot.geometry(state=[0.0, 0.0, 0.0, 0.0]),
    "orbit": lambda: udd.plot.orbit(disk_run()),
    "orbit of a fit": lambda: udd.plot.orbit(discovered.disk().fit),
    "orbit of a pendulum": lambda: udd.plot.orbit(discovered.pendulum().fit),
    "phase_space": lambda: udd.plot.phase_space(disk_run()),
    "phase_space of the DLE": lambda: udd.plot.phase_space(udd.simulate(udd.DLE(1.0), 5.0, [1, 1, 0.01])),
    "time_series of a pendulum": lambda: udd.plot.time_series(discovered.pendulum().fit),
    "return_map": lambda: udd.plot.return_map(udd.poincare(udd.DLE(1.0), "maxima of z", 60)),
    "exponents": lambda: udd.plot.exponents([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], errors=[0.01] * 3),
    "exponents of spectra": lambda: udd.plot.exponents(
        [udd.lyapunov_spectrum(udd.DLE(w), t=500.0, tol=0.1) for w in (8.5, 9.0)]
    ),
    "branches, period": lambda: udd.plot.branches(branch(), view="period"),
    "friction": lambda: udd.plot.friction(udd.Disk(0.039)),
    "friction of a fit": lambda: udd.plot.friction(discovered.disk().fit),
    "residuals": lambda: udd.plot.residuals(discovered.disk().baseline),
    "residual_map": lambda: udd.plot.residual_map(discovered.disk().baseline),
    "misfit": lambda: udd.plot.misfit(discovered.disk().fit),
    "whiteness": lambda: udd.plot.whiteness(innovations(discovered.disk().fit)),
    "evidence": lambda: udd.plot.evidence(discovered.disk()),
    "errors": lambda: udd.plot.errors(discovered.disk()),
    "errors of a pendulum": lambda: udd.plot.errors(discovered.pendulum()),
    "curve": lambda: udd.plot.curve(curve()),
    "overlay": lambda: udd.plot.overlay(np.full((70, 55, 3), 200, dtype=np.uint8), pixels(), 0),
}


@pytest.mark.parametrize("name", BARE)
def test_a_bare_picture_is_drawn_well(name: str) -> None:
    assert complaint(BARE[name]().figure) == []
