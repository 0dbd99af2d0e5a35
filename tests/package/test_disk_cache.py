"""Results that tests share are computed once per run, by the first process that needs them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import udd
from disk_cache import cached_on_disk

calls: list[tuple[float, float]] = []


def summed(measurement: udd.Measurement, model: udd.Pendulum, *, by: float = 1.0) -> float:
    calls.append((model.length, by))
    return float(measurement.values.sum()) * model.length * by


def record(shift: float = 0.0) -> udd.Measurement:
    t = np.arange(0, 2, 0.1)
    return udd.Measurement(t, {"theta": np.cos(t) + shift}, meta={"length": 0.5})


def test_equal_arguments_are_computed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UDD_TEST_CACHE", str(tmp_path))
    calls.clear()
    once = cached_on_disk(summed)
    first = once(record(), udd.Pendulum(0.5), by=2.0)
    assert once(record(), udd.Pendulum(0.5), by=2.0) == first == pytest.approx(record().values.sum())
    assert len(calls) == 1
    once(record(1e-9), udd.Pendulum(0.5), by=2.0)
    once(record(), udd.Pendulum(0.6), by=2.0)
    once(record(), udd.Pendulum(0.5))
    assert len(calls) == 4
    # Results of another udd are not used.
    monkeypatch.setattr("disk_cache.version", lambda: "another")
    once(record(), udd.Pendulum(0.5), by=2.0)
    assert len(calls) == 5


def test_a_file_counts_by_its_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UDD_TEST_CACHE", str(tmp_path))
    read: list[str] = []

    def length(path: Path) -> int:
        read.append(path.read_text())
        return len(read[-1])

    once = cached_on_disk(length)
    places = [tmp_path / name / "film" for name in ("a", "b")]
    for place, text in zip(places, ("short", "short"), strict=True):
        place.parent.mkdir()
        place.write_text(text)
    assert [once(place) for place in places] == [5, 5] and len(read) == 1
    places[1].write_text("longer")
    assert once(places[1]) == 6


SLOW = """
import sys, time
from pathlib import Path
from disk_cache import cached_on_disk

def slow(log):
    with open(log, "a") as file:
        file.write("computed\\n")
    time.sleep(0.5)
    return 4

assert cached_on_disk(slow)(sys.argv[1]) == 4
"""


def test_the_second_of_two_processes_waits_for_the_first(tmp_path: Path) -> None:
    script = tmp_path / "slow.py"
    script.write_text(SLOW)
    support, package = Path(__file__).parents[1] / "support", Path(udd.__file__).parents[1]
    environment = os.environ | {
        "UDD_TEST_CACHE": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(support), str(package)]),
    }
    log = tmp_path / "log"
    command = [sys.executable, str(script), str(log)]
    both = [subprocess.Popen(command, env=environment) for _ in range(2)]
    assert [item.wait(60) for item in both] == [0, 0]
    assert log.read_text() == "computed\n"
