"""Clocks of films: containers that round times, and copies of frames that a converter put in."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

import udd
from udd.tracking.passes.inserted_copies import inserted_copies

RADIUS = 120  # pixels from the pivot to the bob


def angles(rate: float, count: int) -> np.ndarray:
    return udd.simulate(udd.Pendulum(0.8, k0=0.01), np.arange(count) / rate, [0.0, 0.45]).state[:, 1]


def film(path: Path, theta: np.ndarray, rate: int) -> None:
    """A red bob in front of a grey wall."""
    across, down = np.meshgrid(np.arange(160), np.arange(160))
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=Fraction(rate))
        stream.width, stream.height, stream.pix_fmt, stream.options = 160, 160, "yuv420p", {"crf": "20"}
        for angle in theta:
            off = np.hypot(across - 80 - RADIUS * np.sin(angle), down - 16 - RADIUS * np.cos(angle))
            share = np.clip(9.5 - off, 0, 1)[..., None]
            picture = np.array([150, 150, 155]) * (1 - share) + np.array([200, 30, 40]) * share
            for packet in stream.encode(av.VideoFrame.from_ndarray(picture.astype(np.uint8), format="rgb24")):
                file.mux(packet)
        for packet in stream.encode(None):
            file.mux(packet)


@pytest.mark.parametrize(("kind", "rounded"), [("mkv", True), ("mp4", False)])
def test_a_container_that_rounds_times_to_ms_costs_nothing(tmp_path: Path, kind: str, rounded: bool):
    film(tmp_path / f"swing.{kind}", angles(60, 180), 60)
    track = udd.track(tmp_path / f"swing.{kind}", bob="red", length=0.8)
    assert np.abs(track.t - np.arange(180) / 60).max() < 1e-9
    assert ("clock" in track.meta) == rounded
    fitted = udd.fit(track, udd.Pendulum(0.8))
    assert not fitted.doubts.missing and fitted.errors["k0"] < 2e-3
    assert abs(fitted.parameters["k0"] - 0.01) < 3 * fitted.errors["k0"]


def test_inserted_copies_delay_a_film_and_replacing_ones_do_not(tmp_path: Path):
    """Two of them where the bob is fast, two where it turns back."""
    theta, copied = angles(30, 150), [40, 54, 81, 107]
    inserted = list(range(150))
    for k in reversed(copied):
        inserted.insert(k, k - 1)
    replaced = [k - 1 if k in copied else k for k in range(150)]
    for shown in (inserted, replaced):
        film(tmp_path / "swing.mp4", theta[shown], 30)
        measurement = udd.track(tmp_path / "swing.mp4", bob="red", length=0.8)
        assert sum(flag.startswith("dup") for flag in measurement.flag) == 4
        assert np.abs(measurement.t - np.array(shown) / 30)[measurement.seen].max() < 1e-9
        delays = sum("delays" in flag for flag in measurement.flag)
        assert delays == (4 if shown is inserted else 0)
        assert not udd.fit(measurement, udd.Pendulum(0.8)).doubts.missing


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("rate", [25, 60, 120])
def test_a_film_without_copies_has_none(seed: int, rate: float):
    random = np.random.default_rng(seed)
    amplitude, noise = random.choice([0.05, 0.6, 1.5, 3.0]), random.choice([0.02, 0.1, 0.3])
    t = np.arange(300) / rate
    theta = udd.simulate(udd.Pendulum(0.4, k0=0.01), t, [0.0, amplitude]).state[:, 1]
    places = 200 * np.exp(1j * theta) + noise * (
        random.standard_normal(300) + 1j * random.standard_normal(300)
    )
    again, flag = inserted_copies(t, places, [""] * 300, noise)
    assert flag == [""] * 300 and np.array_equal(again, t)
