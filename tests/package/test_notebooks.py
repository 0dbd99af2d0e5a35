"""The notebooks of the folder `examples` run from top to bottom, each in an empty folder."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"
SLOW = {"first_film", "driven_machine"}  # a film or a search each
NEEDS = {"million_drives_on_dask": "distributed", "first_film": "av", "figure_for_a_paper": "xarray"}
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb"))


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def run(name: str) -> dict[str, Any]:
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    scope: dict[str, Any] = {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None, (
                "notebooks are kept without output"
            )
            exec(compile("".join(cell["source"]), f"{name}, cell {number}", "exec"), scope)
    return scope


def test_there_are_six() -> None:
    assert len(NAMES) == 6


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("name", [name for name in NAMES if name not in SLOW])
def test_a_notebook_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip(NEEDS.get(name, "udd"))
    monkeypatch.chdir(tmp_path)
    assert run(name)


# The faster test above asks the same of the others; tests/film and tests/discovery of what these call.
@pytest.mark.nightly
@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("name", sorted(SLOW))
def test_a_slow_notebook_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip(NEEDS.get(name, "udd"))
    monkeypatch.chdir(tmp_path)
    assert run(name)["found"].effects
