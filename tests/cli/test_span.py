"""The part of a record that a command uses: a phone's record begins while a hand holds the pendulum."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import udd
from udd.cli import main

LENGTH = 0.64


@pytest.fixture
def phone(tmp_path: Path) -> Path:
    """A phone's table: 2 s in a hand that is not quite still, then 8 s of swinging."""
    rng = np.random.default_rng(3)
    swing = udd.simulate(udd.Pendulum(LENGTH, k0=0.01), np.arange(0, 8, 0.02), [0.0, 0.9])
    hand = 0.02 * np.sin(9 * np.arange(0, 2, 0.02))
    rate = np.concatenate([hand, swing.state[:, 0]]) + 0.01 * rng.standard_normal(500)
    rows = "".join(f"{0.02 * k:.2f},{x:.5f}\n" for k, x in enumerate(rate))
    path = tmp_path / "phone.csv"
    path.write_text("Time (s),Gyroscope x (rad/s)\n" + rows)
    return path


def test_a_held_beginning_is_said_and_left_out(phone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", str(phone), "--pendulum", "0.6", "--json"]) == 0
    whole = capsys.readouterr()
    begin = whole.err.partition("leave that out: --from ")[2].split()[0]
    assert 2.0 <= float(begin) < 2.1
    assert main(["fit", str(phone), "--pendulum", "0.6", "--json", "--from", begin]) == 0
    part = capsys.readouterr()
    assert "--from" not in part.err
    wrong, right = (json.loads(said.out)["parameters"]["length"] for said in (whole, part))
    assert right["value"] == pytest.approx(LENGTH, abs=4 * right["se"])
    assert right["se"] < 1e-3 < wrong["se"]


def test_a_part_without_rows_is_refused(phone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for given, said in (
        (["--from", "12"], "the part from 12 to 9.98 s has fewer than two rows"),
        (["--from", "3", "--to", "2.9"], "the part from 3 to 2.9 s has fewer than two rows"),
    ):
        assert main(["fit", str(phone), "--pendulum", "0.6", *given]) == 1
        error = capsys.readouterr().err
        assert said in error and "times go from 0 to 9.98 s" in error


def test_a_warning_is_printed_once(phone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["fit", str(phone), "--pendulum", "60", "--from", "12"])
    assert capsys.readouterr().err.count("Is it in cm?") == 1
