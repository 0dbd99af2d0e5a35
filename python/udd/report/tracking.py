"""The page about a tracked film: what was found, how well, and what the camera was."""

from __future__ import annotations

import math
import os
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from udd.calibration_items import unit_of
from udd.errors import UddError
from udd.models import profile_of
from udd.plot.style import AFTER, AXES, BEFORE, CHANNELS, FAINT, MEASURED, label, tidy

from . import wording
from .document import (
    Column,
    Figure,
    Gallery,
    Head,
    Image,
    Number,
    Paragraph,
    Report,
    Section,
    Table,
    Text,
    parts,
    table,
)
from .images import blank, photograph, png
from .page import identity, refuse_folder, write_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from udd.measurement import Measurement
    from udd.tracking import Tracking
    from udd.tracking.metric.rolling_check import Health

FRAMES = 6  # of the film
WIDTH = 300  # pixels of each
FEWEST = 4  # marks in a part of the picture
BINS = 24  # along the picture's longer side
GUIDE = (
    ("Standard error", "The true value lies within one standard error in 68 of 100 such cases."),
    ("Flag", "Why a frame holds no position, or a remark on the position that it holds."),
    ("Residual", "The distance in pixels by which the film and the fitted position differ."),
    ("Contact", "The place in the picture where the wheels hold the disk; positions count from it."),
    ("Rolling", "At the contact the disk moves like the wheels' rims, without slip."),
)
_SHORT = {"Y": "Y", "Z": "Z", "beta": "β", "theta": "θ"}


def write_tracked(
    video: str | os.PathLike[str],
    result: Measurement | Tracking,
    path: str | os.PathLike[str],
    *,
    command: str | None = None,
) -> None:
    """Write the page of :func:`udd.tracking.page`."""
    from udd.tracking.metric.rolling_check import health
    from udd.tracking.tracking_result import Tracking

    refuse_folder(path)
    detail = result if isinstance(result, Tracking) else None
    m: Measurement = result.measurement if isinstance(result, Tracking) else result
    if "calibration" not in m.meta or not m.quality:
        raise UddError("the measurement was not tracked in a film, so there is no page about it")
    marks = profile_of(m.kind).sensor.sees_marks
    checked = health(m) if marks else None
    sections = [_measured(video, m), _calibrated(m), _each_frame(m, detail)]
    if marks:
        sections.append(_rolls(checked))
    report = Report(_head(m, checked), tuple(sections), identity(video), command)
    write_page(report, path, guide=GUIDE if marks else GUIDE[:3])


def _head(m: Measurement, checked: Health | None) -> Head:
    missing = m.meta.get("frames_missing")
    cut = f"{missing} frames that the file promises are missing: it may be cut off."
    said = [cut] if missing else []
    said += [f"{doubt[:1].upper()}{doubt[1:]}." for doubt in m.meta.get("doubts", ())]
    if "camera_moved_px" in m.meta:
        moved, error = float(m.meta["camera_moved_px"]), float(m.meta["camera_sigma_px"])
        said.append(
            f"The camera moved, by {moved:.2g} pixels r.m.s.; what stands still about the disk shows it to "
            f"{error:.1g} pixels, and it is undone."
        )
    if m.meta.get("mirrored"):
        said.append("The film is mirrored, as the order of the marks shows; it was mirrored again.")
    if m.meta.get("turned"):
        said.append("The film was turned upright, as gravity and the drive show.")
    notes = tuple(Paragraph(text, "warn") for text in said)
    return Head("Tracking", headline(m), numbers=numbers(m, checked), notes=notes)


def _measured(video: str | os.PathLike[str], m: Measurement) -> Section:
    drawn = (
        "the fitted rim, the marks where the fit has them, and the contact (cross)"
        if profile_of(m.kind).sensor.sees_marks
        else "the bob, and the pivot (cross)"
    )
    shown = (
        Gallery(frames(video, m)),
        Paragraph(f"Drawn on frames of the film: {drawn}. Frames without a position have no drawing."),
        Figure(motion(m), "The motion. Strips in red: frames that hold no position."),
    )
    return Section("Positions", shown)


def _calibrated(m: Measurement) -> Section:
    said = (
        "Estimates from the film, with standard errors. Scale and contact are common to all positions; "
        "values given by the user are marked “given”."
    )
    columns = {
        "name": Column("item", names=True),
        "value": Column("value", number=True),
        "error": Column("standard error", number=True),
        "unit": Column("unit"),
        "how": Column("how"),
    }
    title = "The camera and the device"
    return Section(title, (Paragraph(said), table(title, columns, calibration(m))))


def _each_frame(m: Measurement, detail: Tracking | None) -> Section:
    off = (
        "Residual: r.m.s. distance of the marks from their places on the rigid body. In view: visible share "
        "of the marks' edges. "
        if profile_of(m.kind).sensor.sees_marks
        else "Residual: distance of the bob from its circle. In view: its area against the usual one. "
    )
    where = (
        ", by the place of the middle."
        if detail is None
        else ", mark by mark; arrows are means. Arrows that agree over a region point to a lens, a tilt or "
        "an edge that the model of the camera lacks."
    )
    said = flags(m)
    columns = (Column("flag", names=True), Column("frames", number=True), Column("first at", number=True))
    rows = tuple((flag, str(count), first) for flag, count, first in said)
    caption = "Flags; gap and degraded are remarks on frames that hold a position"
    shown = parts(
        Figure(quality(m), f"{off}Blur: how far it moves while the shutter is open."),
        Table("Flags", columns, rows, caption) if said else Paragraph("No frame has a flag."),
        Figure(picture_map(m, detail), f"Residual over the picture{where}"),
    )
    return Section("How each frame did", shown)


def _rolls(checked: Health | None) -> Section:
    if checked is None:
        said = (
            "This motion (short, a steady rotation, or with a moving camera) does not determine the contact "
            "and the drive, so rolling cannot be tested."
        )
        return Section("Does it roll?", (Paragraph(said),))
    left, noise = (wording.length(x, "m") for x in (checked.rms, checked.noise))
    said = (
        "At the contact the disk turns about one point while the wheels drive it past that point: "
        f"dY/dT = Z Ω, dZ/dT = −Y Ω + W. Over stretches of 1.5 s the violation is {left} r.m.s.; the noise "
        f"of the frames alone would give {noise}. A much larger value points to slip, a wrong clock, a wrong "
        "camera model, or a slightly different law, for which udd discover searches."
    )
    caption = "Violation of the rolling constraint, with a band of two standard errors of the frames' noise."
    return Section("Does it roll?", (Paragraph(said), Figure(rolling(checked), caption)))


def headline(m: Measurement) -> str:
    """Sum up the result in one sentence."""
    usable = int(m.seen.sum())
    share = "Every frame" if usable == len(m) else f"{usable} of {len(m)} frames"
    what = f"the {profile_of(m.kind).shown.noun}"
    gone = int(sum(str(f).startswith("gone") for f in m.flag))
    rest = f"; it leaves the wheels, and the last {gone} frames have no position" if gone else ""
    return f"{share} of this film {'gives' if usable == len(m) else 'give'} the position of {what}{rest}"


def numbers(m: Measurement, checked: Health | None) -> tuple[Number, ...]:
    """List the numbers at the top."""
    out = []
    if m.sigma is not None:
        for k, name in enumerate(m.names):
            unit = "rad" if name in ("beta", "theta") else "m"
            spread = wording.length(float(np.nanmedian(m.sigma[:, k])), unit)
            out.append(Number(Markup("standard error of {}, typical").format(wording.pretty(name)), spread))
    if drive := profile_of(m.kind).dynamics.drive:
        value, sigma, _ = m.meta["calibration"][drive]
        said = "–" if value is None else f"{100 * value:.4g} cm/s"
        error = "" if not sigma else f"± {100 * sigma:.1g} cm/s"
        out.append(Number(f"drive {drive}, as it is seen", said, error))
    if checked is not None:
        noise = f"noise alone: {wording.length(checked.noise, 'm')}"
        out.append(Number("departure from rolling", wording.length(checked.rms, "m"), noise))
    return tuple(out)


def calibration(m: Measurement) -> list[dict[str, Text]]:
    """List the self-calibration: item, value, standard error, method."""
    rows: list[dict[str, Text]] = []
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
            {
                "name": name,
                "value": shown.replace("-", "−"),
                "error": error,
                "unit": unit if value is not None else "",
                "how": how,
            }
        )
    return rows


def _digits(value: float, sigma: float | None) -> str:
    """Round to as many decimals as two digits of the standard error have."""
    if not sigma or not math.isfinite(sigma):
        return f"{value:.6g}"
    places = min(max(0, 1 - math.floor(math.log10(sigma))), 7)
    return f"{round(value, places) + 0.0:.{places}f}"


def _error(sigma: float | None, factor: float) -> str:
    if sigma is None:
        return "–"
    return f"{factor * sigma:.2g}" if sigma else "0"


def flags(m: Measurement) -> list[tuple[str, int, str]]:
    """List the flags with their number of frames and the time of the first."""
    said = Counter(str(f) for f in m.flag if f)
    first = {f: int(np.flatnonzero(m.flag == f)[0]) for f in said}
    return [(f, n, f"{m.t[first[f]]:.2f} s") for f, n in said.most_common(12)]


def chosen(m: Measurement) -> list[tuple[int, str]]:
    """Choose frames that are worth a look, each with the reason."""
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


def frames(video: str | os.PathLike[str], m: Measurement) -> tuple[Figure, ...]:
    """Draw the measured positions on the chosen frames."""
    from udd.tracking import pictures_at, pixels
    from udd.tracking.overlay import draw

    where, pick = pixels(m), chosen(m)
    out = []
    for image, (k, why) in zip(pictures_at(video, [k for k, _ in pick], m), pick, strict=True):
        drawn = np.ascontiguousarray(image)
        draw(drawn, where, k, "")
        out.append(Figure(photograph(drawn, f"Frame {k}, {why}", WIDTH), f"{m.t[k]:.2f} s: {why}"))
    return tuple(out)


def motion(m: Measurement) -> Image:
    """Draw the coordinates over time."""
    figure, grid = blank(9.0, 1.5 * len(m.names) + 0.7, rows=len(m.names))
    for k, ((ax,), name) in enumerate(zip(grid, m.names, strict=True)):
        said, unit, factor = AXES.get(name, (name, "mrad", 1e3))  # th1, th2 of two bobs
        ax.plot(m.t, factor * np.where(m.seen, m.values[:, k], np.nan), ".-", color=MEASURED,
                markersize=2, linewidth=0.5)  # fmt: skip
        ax.set_ylabel(f"{_SHORT.get(name, said)} [{unit}]")
        _strips(ax, m)
        tidy(ax)
    grid[-1][0].set_xlabel(label("t"))
    return png(figure, "The measured motion over time; red strips are frames without a position")


def _strips(ax: Axes, m: Measurement) -> None:
    """Mark the times without a position."""
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
    """Draw the errors of the marks over the picture; without their detail the frame's mean at the disk."""
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


def rolling(checked: Health) -> Image:
    """Draw the violation of the rolling constraint over time."""
    figure, grid = blank(9.0, 3.4, rows=2)
    for k, ((ax,), name) in enumerate(zip(grid, ("Y", "Z"), strict=True)):
        said, unit, factor = CHANNELS[name]
        ax.plot(checked.t, factor * checked.rest[:, k], ".", color=MEASURED, markersize=2)
        if math.isfinite(checked.noise):
            ax.axhspan(-2 * factor * checked.noise, 2 * factor * checked.noise, color=AFTER, alpha=0.15)
        ax.set_ylabel(f"{said} [{unit}]")
        tidy(ax)
    grid[-1][0].set_xlabel(label("t"))
    return png(
        figure, "Violation of the rolling constraint, with a band of two standard deviations of its noise"
    )
