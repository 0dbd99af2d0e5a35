"""The page about a tracked film: what was found, how well, and what the camera was."""

from __future__ import annotations

import base64
import math
import os
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.atomic_files import write_whole
from udd.calibration_items import unit_of
from udd.errors import UddError
from udd.plot.style import AFTER, AXES, BEFORE, CHANNELS, FAINT, MEASURED, label, scale, tidy

from . import wording
from .images import Image, blank, png
from .page import identity, template, versions

if TYPE_CHECKING:
    from udd.measurement import Measurement
    from udd.tracking import Tracking

FRAMES = 6  # of the film
WIDTH = 300  # pixels of each
FEWEST = 4  # marks in a part of the picture
BINS = 24  # along the picture's longer side
_SHORT = {"Y": "Y", "Z": "Z", "beta": "β", "theta": "θ"}


def write_tracked(
    video: str | os.PathLike[str],
    found: Measurement | Tracking,
    path: str | os.PathLike[str],
    *,
    command: str | None = None,
) -> None:
    """As `udd.tracking.page`."""
    from udd.tracking.metric.rolling_check import health
    from udd.tracking.pipeline import Tracking

    target = Path(path)
    if target.is_dir():
        raise UddError(f"{target} is a folder, not a page to write to")
    detail = found if isinstance(found, Tracking) else None
    m: Measurement = found.measurement if isinstance(found, Tracking) else found
    if "calibration" not in m.meta or not m.quality:
        raise UddError("the measurement was not tracked in a film, so there is no page about it")
    checked = health(m) if m.kind == "disk" else None
    udd_version, all_versions = versions()
    page = template("tracked.html").render(
        m=m,
        headline=headline(m),
        numbers=numbers(m, checked),
        calibration=calibration(m),
        flags=flags(m),
        health=checked,
        mm=lambda x: wording.length(x, "m"),
        pictures={
            "frames": frames(video, m),
            "motion": motion(m),
            "quality": quality(m),
            "map": picture_map(m, detail),
            "health": None if checked is None else rolling(checked),
        },
        per_mark=detail is not None,
        version=udd_version,
        versions=all_versions,
        command=command,
        source=identity(video),
    )
    write_whole(target, page.encode())


def headline(m: Measurement) -> str:
    """The whole result in one sentence."""
    usable = int(m.seen.sum())
    share = "Every frame" if usable == len(m) else f"{usable} of {len(m)} frames"
    what = "the disk" if m.kind == "disk" else "the pendulum"
    gone = int(sum(str(f).startswith("gone") for f in m.flag))
    rest = f"; it leaves the wheels, and nothing is said of the last {gone} frames" if gone else ""
    return f"{share} of this film {'says' if usable == len(m) else 'say'} where {what} is{rest}"


def numbers(m: Measurement, checked: Any) -> list[tuple[str, str, str]]:
    """What stands at the top: (what, value, remark)."""
    out = []
    if m.sigma is not None:
        for k, name in enumerate(m.names):
            unit = "rad" if name in ("beta", "theta") else "m"
            spread = wording.length(float(np.nanmedian(m.sigma[:, k])), unit)
            out.append((f"standard error of {wording.pretty(name)}, typical", spread, ""))
    if m.kind == "disk":
        value, sigma, _ = m.meta["calibration"]["W"]
        said = "–" if value is None else f"{100 * value:.4g} cm/s"
        out.append(("drive W, as it is seen", said, "" if not sigma else f"± {100 * sigma:.1g} cm/s"))
    if checked is not None:
        noise = f"noise alone: {wording.length(checked.noise, 'm')}"
        out.append(("left of the rolling constraint", wording.length(checked.rms, "m"), noise))
    return out


def calibration(m: Measurement) -> list[SimpleNamespace]:
    """The self-calibration: item, value, standard error, how."""
    rows = []
    for name, (value, sigma, how) in m.meta["calibration"].items():
        factor, unit = (1.0, "px") if name == "length" else unit_of(name)
        if value is None:
            shown, error = "–", "–"
        elif isinstance(value, list):
            shown = ", ".join(_digits(factor * x, sigma and factor * sigma) for x in value)
            error = _error(sigma, factor)
        else:
            shown, error = _digits(factor * value, sigma and factor * sigma), _error(sigma, factor)
        rows.append(
            SimpleNamespace(
                name=name, value=shown.replace("-", "−"), error=error, unit=unit if value is not None else "",
                how=how,
            )
        )  # fmt: skip
    return rows


def _digits(value: float, sigma: float | None) -> str:
    """As many places as the standard error has in two digits."""
    if not sigma or not math.isfinite(sigma):
        return f"{value:.6g}"
    places = min(max(0, 1 - math.floor(math.log10(sigma))), 7)
    return f"{round(value, places) + 0.0:.{places}f}"


def _error(sigma: float | None, factor: float) -> str:
    if sigma is None:
        return "–"
    return f"{factor * sigma:.2g}" if sigma else "0"


def flags(m: Measurement) -> list[tuple[str, int, str]]:
    """What was said of how many frames, and of which first."""
    said = Counter(str(f) for f in m.flag if f)
    first = {f: int(np.flatnonzero(m.flag == f)[0]) for f in said}
    return [(f, n, f"{m.t[first[f]]:.2f} s") for f, n in said.most_common(12)]


def chosen(m: Measurement) -> list[tuple[int, str]]:
    """Frames that are worth a look, each with why."""
    q, seen = m.quality, np.flatnonzero(m.seen)
    picked: dict[int, str] = {}
    lost = [k for k in range(len(m)) if not m.seen[k]]
    wanted: list[tuple[int, str]] = [(int(seen[len(seen) // 2]), "one in the middle")]
    for name, why, sign in (
        ("residual_px", "the largest residual", -1),
        ("blur_px", "the longest streaks", -1),
        ("complete", "the least in view", 1),
    ):
        column = np.asarray(q[name], dtype=float)[seen]
        if np.isfinite(column).any():
            order = seen[np.argsort(np.where(np.isfinite(column), sign * column, np.inf), kind="stable")]
            wanted.append((int(next(k for k in order if int(k) not in [w for w, _ in wanted])), why))
    wanted += [
        (k, str(m.flag[k]).partition(":")[0] or "not seen") for k in lost[:1] + lost[len(lost) // 2 :][:1]
    ]
    for k, why in wanted:
        picked.setdefault(k, why)
    return sorted(picked.items())[:FRAMES]


def frames(video: str | os.PathLike[str], m: Measurement) -> list[tuple[Image, str]]:
    """These frames with what was found drawn upon them."""
    import cv2

    from udd.tracking import pictures_at, pixels
    from udd.tracking.overlay import draw

    where, pick = pixels(m), chosen(m)
    out = []
    for image, (k, why) in zip(pictures_at(video, [k for k, _ in pick]), pick, strict=True):
        drawn = np.ascontiguousarray(image)
        draw(drawn, where, k, "")
        factor = WIDTH * 2 / drawn.shape[1]
        if factor < 1:
            drawn = np.asarray(cv2.resize(drawn, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA))
        _, coded = cv2.imencode(".jpg", drawn[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])
        uri = f"data:image/jpeg;base64,{base64.b64encode(coded.tobytes()).decode()}"
        out.append((Image(uri, f"Frame {k}, {why}", WIDTH), f"{m.t[k]:.2f} s: {why}"))
    return out


def motion(m: Measurement) -> Image:
    """The coordinates over time."""
    figure, grid = blank(9.0, 1.5 * len(m.names) + 0.7, rows=len(m.names))
    for k, ((ax,), name) in enumerate(zip(grid, m.names, strict=True)):
        ax.plot(m.t, scale(name) * np.where(m.seen, m.values[:, k], np.nan), ".-", color=MEASURED,
                markersize=2, linewidth=0.5)  # fmt: skip
        said, unit, _ = AXES[name]
        ax.set_ylabel(f"{_SHORT.get(name, said)} [{unit}]")
        _strips(ax, m)
        tidy(ax)
    grid[-1][0].set_xlabel(label("t"))
    return png(figure, "What was measured over time; red strips are frames without a position")


def _strips(ax: Any, m: Measurement) -> None:
    """Where nothing is known."""
    half = 0.5 * float(np.median(np.diff(m.t)))
    lost = np.flatnonzero(~m.seen)
    for part in np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1) if len(lost) else []:
        ax.axvspan(m.t[part[0]] - half, m.t[part[-1]] + half, color=BEFORE, alpha=0.25, linewidth=0)


def quality(m: Measurement) -> Image:
    """Residual, completeness and blur over time."""
    rows = (
        ("residual_px", "residual [px]"),
        ("complete", "in view"),
        ("marks", "marks"),
        ("blur_px", "blur [px]"),
    )
    figure, grid = blank(9.0, 1.25 * len(rows) + 0.7, rows=len(rows))
    for (ax,), (name, said) in zip(grid, rows, strict=True):
        values = np.asarray(m.quality[name], dtype=float)
        ax.plot(m.t, values, ".", color=AFTER, markersize=2)
        ax.set_ylabel(said)
        top = float(np.nanmax(values)) if np.isfinite(values).any() else 1.0
        ax.set_ylim(0, 1.1 * top if top > 0 else 1)
        _strips(ax, m)
        tidy(ax)
    grid[-1][0].set_xlabel(label("t"))
    return png(figure, "Residual of the marks, share of their edges in view, marks and blur over time")


def picture_map(m: Measurement, detail: Tracking | None) -> Image:
    """How far marks are off, over the picture; without the detail the frame's mean where the disk was."""
    from udd.tracking import pixels

    where = pixels(m)
    if detail is None:
        at, off = where.centre, np.asarray(m.quality["residual_px"], dtype=float)
        arrows = None
    else:
        left = detail.tracks.residuals
        ok = np.isfinite(left).all(axis=2) & m.seen[:, None]
        at, arrows = where.marks[ok], left[ok]
        off = np.hypot(*arrows.T)
    ok1 = np.isfinite(off) & np.isfinite(at).all(axis=1)
    at, off = at[ok1], off[ok1]
    low, high = at.min(axis=0) - 5, at.max(axis=0) + 5
    step = float((high - low).max()) / BINS
    bins = [np.arange(low[k], high[k] + step, step) for k in range(2)]
    count, _, _ = np.histogram2d(at[:, 0], at[:, 1], bins=bins)
    total, _, _ = np.histogram2d(at[:, 0], at[:, 1], bins=bins, weights=off**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = np.where(count >= (1 if detail is None else FEWEST), np.sqrt(total / count), np.nan)
    tall = 5.6 * float((high - low)[1] / (high - low)[0])
    figure, ((ax,),) = blank(7.0, min(max(tall, 3.0), 8.0) + 0.9)
    most = float(np.nanquantile(rms, 0.98)) if np.isfinite(rms).any() else 1.0
    shown = ax.pcolormesh(bins[0], bins[1], rms.T, cmap="viridis", vmin=0, vmax=most, rasterized=True)
    if arrows is not None:
        mean = [
            np.histogram2d(at[:, 0], at[:, 1], bins=bins, weights=arrows[ok1][:, k])[0] / np.maximum(count, 1)
            for k in range(2)
        ]
        u, v = np.meshgrid(*(0.5 * (b[1:] + b[:-1]) for b in bins), indexing="ij")
        enough = count >= FEWEST
        size = float(np.quantile(np.hypot(mean[0], mean[1])[enough], 0.95)) if enough.any() else 1.0
        arrow = ax.quiver(
            u[enough], v[enough], mean[0][enough], mean[1][enough], color="white", angles="xy",
            scale_units="xy", scale=max(size, 1e-6) / (0.9 * step), width=0.004,
        )  # fmt: skip
        ax.quiverkey(arrow, 0.82, 1.03, size, f"mean {size:.2g} px", labelpos="E", color="black")
    ax.plot(*where.pivot, "+", color=BEFORE, markersize=12, markeredgewidth=2)
    ax.set_aspect("equal")
    ax.invert_yaxis()
    ax.set_xlabel("u in the picture [px]")
    ax.set_ylabel("v (down) [px]")
    figure.colorbar(shown, ax=ax, label="r.m.s. residual [px]", shrink=0.7)
    ax.set_facecolor(FAINT)
    return png(figure, "Residual over the picture; the cross is the contact")


def rolling(checked: Any) -> Image:
    """What is left of the rolling constraint over time."""
    figure, grid = blank(9.0, 3.4, rows=2)
    for k, ((ax,), name) in enumerate(zip(grid, ("Y", "Z"), strict=True)):
        said, unit, factor = CHANNELS[name]
        ax.plot(checked.t, factor * checked.rest[:, k], ".", color=MEASURED, markersize=2)
        if math.isfinite(checked.noise):
            ax.axhspan(-2 * factor * checked.noise, 2 * factor * checked.noise, color=AFTER, alpha=0.15)
        ax.set_ylabel(f"{said} [{unit}]")
        tidy(ax)
    grid[-1][0].set_xlabel(label("t"))
    return png(figure, "What is left of the rolling constraint, with a band of two of its noise")
