"""Every result has a repr of one short line, and a link if it is in a file."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import discovered
import udd
from every_result import results
from udd.film.rendering import Film
from udd.report import write


def test_every_result_is_one_line(tmp_path: Path) -> None:
    actual = discovered.disk()
    report = write(discovered.pendulum(), tmp_path / "report.html")
    made = {
        **{name: result for name, result in results().items() if not hasattr(result, "data_vars")},
        "render": film(tmp_path),
        "report": report,
        "reproduction": udd.paper.reproduce(tmp_path / "paper", only=["scales"]),
        "errors": actual.error_before,
        "noise": actual.noise,
        "budget": actual.fit.budget(),
        "fit": actual.fit,
        "discovery": actual,
        "spec": udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": [1.0, 2.0]}),
        "effect": udd.effects.relaxation(b=6.0),
        "curve": udd.effects.curve("vertical", "Z", -0.05, 0.05, [0.001] * 12),
        "disk": udd.Disk(0.04),
        "picture": report.images[0],
        "section": report.sections[0],
    }
    long = {name: len(repr(result)) for name, result in made.items() if len(repr(result)) > 400}
    assert long == {}
    assert not any("\n" in repr(result) for result in made.values())


@pytest.mark.parametrize("name", ["disk", "pendulum"])
def test_every_part_of_a_discovery_is_one_line(name: str) -> None:
    long: dict[str, int] = {}
    seen: set[int] = set()

    def look(part: object, path: str) -> None:
        if id(part) in seen:
            return
        seen.add(id(part))
        if dataclasses.is_dataclass(part) and not isinstance(part, type):
            if len(repr(part)) > 400 or "\n" in repr(part):
                long[path] = len(repr(part))
            for field in dataclasses.fields(part):
                look(getattr(part, field.name), f"{path}.{field.name}")
        elif isinstance(part, list | tuple):
            for k, inner in enumerate(part[:20]):
                look(inner, f"{path}[{k}]")
        elif isinstance(part, dict):
            for key, inner in part.items():
                look(inner, f"{path}[{key!r}]")

    look(getattr(discovered, name)(), name)
    assert long == {}


def film(folder: Path) -> Film:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, 0.3, 0.005), [0, 0.001, 0.04, 0])
    return udd.render(run, folder / "film.mp4", size=(64, 80))


def test_what_is_in_a_file_is_a_link(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    report = discovered.pendulum().report("the report.html")
    assert repr(report).startswith("<Report the report.html: effect identified; ")
    assert report._repr_html_().startswith('<a href="the%20report.html" target="_blank">the report.html</a>')
    assert 'href="film.mp4"' in film(Path())._repr_html_()
    elsewhere = film(tmp_path.parent)
    assert 'href="file://' in elsewhere._repr_html_()
