"""Films with the curves and colours of HDR screens are read as what a usual screen would show."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import av

import udd
from small_films import shot
from tracked_errors import errors, rms
from udd.video.decoder_process import light_of_hlg, light_of_pq
from udd.video.reader import Film

Array = NDArray[np.float64]
TO_BT709 = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
NUMBERS = {"smpte2084": 16, "arib-std-b67": 18}


def pq(light: Array) -> Array:
    power = (light * 203 / 10000) ** (1305 / 8192)
    return ((107 / 128 + 2413 / 128 * power) / (1 + 2392 / 128 * power)) ** (2523 / 32)


def hlg(light: Array) -> Array:
    scene = np.minimum(light * 0.26496256, 1)
    curve = 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073
    return np.where(scene <= 1 / 12, np.sqrt(3 * scene), curve)


def halved(plane: Array) -> Array:
    height, width = (n // 2 for n in plane.shape)
    return plane[: 2 * height, : 2 * width].reshape(height, 2, width, 2).mean(axis=(1, 3))


def written_in_hdr(source: str, path: Path, curve: str) -> Path:
    """Code a film again, with 10 bits of BT.2020."""
    code, number = {"smpte2084": pq, "arib-std-b67": hlg}[curve], NUMBERS[curve]
    with av.open(source) as film, av.open(path, "w") as out:
        given = film.streams.video[0]
        stream = out.add_stream("libx265", rate=25)
        stream.width, stream.height, stream.pix_fmt = given.width, given.height, "yuv420p10le"
        told = f"log-level=error:pools=1:colorprim=bt2020:transfer={curve}:colormatrix=bt2020nc"
        stream.options = {"x265-params": told, "crf": "16", "preset": "ultrafast"}
        context = stream.codec_context
        context.color_trc, context.color_primaries, context.colorspace, context.color_range = number, 9, 9, 1
        for frame in film.decode(given):
            rgb = frame.to_ndarray(format="rgb24") / 255
            light = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
            r, g, b = np.moveaxis(code(np.maximum(light @ np.linalg.inv(TO_BT709).T, 0)), 2, 0)
            y = 0.2627 * r + 0.678 * g + 0.0593 * b
            planes = (
                64 + 876 * y,
                512 + 896 * halved((b - y) / 1.8814),
                512 + 896 * halved((r - y) / 1.4746),
            )
            made = av.VideoFrame(given.width, given.height, "yuv420p10le")
            for plane, values in zip(made.planes, planes, strict=True):
                rows = np.zeros((plane.height, plane.line_size // 2), np.uint16)
                rows[:, : plane.width] = np.round(values)
                plane.update(rows.tobytes())
            made.pts, made.time_base = frame.pts, frame.time_base
            out.mux(stream.encode(made))
        out.mux(stream.encode())
    return path


@pytest.mark.parametrize(("light", "code"), [(light_of_pq, pq), (light_of_hlg, hlg)])
def test_the_curves_are_the_standards(light: object, code: object) -> None:
    for amount in (0.001, 0.02, 0.18, 0.5, 1.0, 2.0):
        assert light(float(code(np.array(amount)))) == pytest.approx(amount, rel=1e-6)  # type: ignore[operator]
    assert light_of_pq(0.58) == pytest.approx(1.0, abs=0.01)  # BT.2408: 203 cd/m^2 at 58 %
    assert light_of_hlg(0.75) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("curve", ["smpte2084", "arib-std-b67"])
def test_a_disk_in_an_hdr_film_is_measured(curve: str, tmp_path: Path) -> None:
    film = shot(tmp_path / "plain.mp4", 1.5)
    bright = written_in_hdr(film.path, tmp_path / "hdr.mp4", curve)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # no mark is missing
        m = udd.track(bright, pivot=film.pivot)
    assert m.seen.all()
    e = errors(m, replace(film, path=bright))
    assert rms(e)[:2].max() < 0.2 and rms(e)[2] < 3
    plain, mapped = next(Film(film.path).pictures()), next(Film(bright).pictures())
    for name in ("y", "u", "v"):
        off = getattr(plain, name).astype(int) - getattr(mapped, name)
        assert abs(np.median(off)) <= 1 and np.quantile(np.abs(off), 0.95) < 8
