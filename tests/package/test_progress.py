"""Work shows how far it is: in a bar, in nothing, or in the words that a function of the caller's gets."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from udd._util.progress import progress_bar, status

TIMES = np.arange(0, 14, 0.1)
NOISE = 1e-3 * np.random.default_rng(0).standard_normal(len(TIMES))
SWING = udd.Measurement(TIMES, {"theta": 0.5 * np.exp(-TIMES / 50) * np.cos(3.13 * TIMES) + NOISE})

WORK: dict[str, Callable[[Path, Any], object]] = {
    "lyapunov": lambda folder, p: udd.lyapunov([5.0, 6.0], t=200.0, tol=1.0, progress=p),
    "ensemble": lambda folder, p: udd.ensemble(udd.DLE(5.0), 1.0, [[1, 1, 0], [2, 1, 0]], progress=p),
    "poincare": lambda folder, p: udd.poincare(udd.DLE(5.0), n=5, progress=p),
    "bifurcation": lambda folder, p: udd.bifurcation(udd.DLE(9.0), "w", [8.0, 9.0], n=12, progress=p),
    "basins": lambda folder, p: udd.basins(udd.DLE(9.0), {"omega": [1.0, 2.0]}, n=12, progress=p),
    "sweep": lambda folder, p: udd.sweep(
        udd.SweepSpec("final_state", udd.DLE(1.0), {"w": [1.0, 2.0]}, options={"t": 1.0}), progress=p
    ),
    "discover": lambda folder, p: udd.discover(SWING, udd.Pendulum(1.0, k0=0.1), progress=p),
    "reproduce": lambda folder, p: udd.paper.reproduce(folder, only=["scales"], progress=p),
    "render": lambda folder, p: udd.render(
        udd.simulate(udd.Disk(0.039), np.arange(0, 0.3, 0.005), [0, 0.001, 0.04, 0]),
        folder / "film.mp4",
        size=(64, 80),
        progress=p,
    ),
}


@pytest.mark.parametrize("name", WORK)
def test_a_function_gets_words_and_true_shows_a_bar(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said: list[str] = []
    WORK[name](tmp_path, said.append)
    assert said and all(isinstance(text, str) and text for text in said)
    WORK[name](tmp_path, False)
    WORK[name](tmp_path, None)  # nobody watches: standard error is no terminal
    assert capsys.readouterr().err == ""
    WORK[name](tmp_path, True)
    assert capsys.readouterr().err != ""


def test_other_values_are_refused() -> None:
    with pytest.raises(ValueError, match="progress must be True, False or a function"):
        udd.lyapunov([5.0], t=200.0, tol=1.0, progress="yes")  # type: ignore[arg-type]


def test_a_bar_that_nobody_asked_for_waits(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("udd._util.progress.is_watched", lambda: True)
    monkeypatch.setattr("udd._util.progress.PATIENCE", 0.3)
    for pause, shown in ((0.0, False), (0.4, True)):
        with progress_bar(10, "run", None) as bar:
            time.sleep(pause)
            bar.update(5)
        assert bool(capsys.readouterr().err.strip()) == shown
        with status(None) as tell:
            time.sleep(pause)
            tell("at work")
        assert ("at work" in capsys.readouterr().err) == shown


def test_a_notebook_is_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    from udd._util import progress

    class Shell:
        kernel = object()

    class IPython:
        get_ipython = staticmethod(Shell)

    assert not progress.is_watched()
    monkeypatch.setitem(sys.modules, "IPython", IPython)  # type: ignore[arg-type]
    assert progress.is_watched()
