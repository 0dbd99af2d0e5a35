"""A job, in a process of its own: `python -m udd.app.worker` in a private folder.

The question comes as one line of JSON on its input. Answers are lines of JSON: ``{"say": text}``,
``{"frame": {...}, "jpeg": base64}``, and at the end ``{"done": {...}}`` or ``{"error": sentence}``. Its
memory and CPU time are limited. A film that crashes FFmpeg ends only this process.
"""

from __future__ import annotations

import base64
import json
import math
import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd._util.json_output import as_json
from udd.errors import UddError

from . import child_process, limits
from .error_text import sentence
from .jobs import REFUSED

if TYPE_CHECKING:
    from udd.measurement import Measurement

OUT = Path("out")
_PICTURES_EVERY = 0.2  # s between the frames that are shown
_CUT = 0.01  # share of the promised frames that may be missing
_PICTURE = 480  # pixels, the longer side of what is shown

_NO_DRIVE = "the drive speed W is not in the file's header: say it in cm/s (0 where the wheels stand)"

Tell = Callable[[dict[str, Any]], None]


def main() -> None:
    """Do the job that is asked for."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print is no message

    def tell(message: dict[str, Any]) -> None:
        answers.write(json.dumps(message) + "\n")
        answers.flush()

    asked = json.loads(sys.stdin.readline())
    child_process.end_with_server()
    child_process.limit(limits.CPU_SECONDS)
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always", UserWarning)
            OUT.mkdir()
            done = JOBS[asked["kind"]](asked, tell)
        messages = [w.message for w in warned if issubclass(w.category, UserWarning)]
        done["warnings"] = [_sentence(message, asked.get("file", "")) for message in messages]
        tell({"done": done})
    except UddError as error:
        tell(
            {"error": _sentence(error, asked.get("file", "")), "parts": _kept() if asked.get("film") else []}
        )
    except MemoryError:
        tell({"error": "This takes more memory than a job may have."})
    except Exception as error:
        kind = type(error).__name__
        fault = f"A fault of the program ended the job ({kind}). Please report it, with the file."
        tell({"error": fault, "parts": _kept() if asked.get("film") else []})
        raise


def _kept() -> list[dict[str, str]]:
    """List what a failed job leaves: the motion, if the film was tracked, or frames of a refused film."""
    kept = {"measurement.csv": "The measured motion", REFUSED: "Frames of the film"}
    return [{"name": name, "title": title} for name, title in kept.items() if (OUT / name).is_file()]


def _sentence(error: object, file: str) -> str:
    """Return the message without the file's name on the server."""
    text = str(error)
    if file:
        text = text.removeprefix(f"{file}: ").replace(file, "the file")
    return sentence(text)


def _loop(asked: dict[str, Any], tell: Tell) -> dict[str, Any]:
    """Find the verdict for a film or a table."""
    from udd.discovery import discover
    from udd.measurement.time_span import between
    from udd.models import Disk, Model, Pendulum

    from .driven_models import DOUBLE, double_pendulum, driven_model
    from .table_columns import measurement_of

    file = Path(asked["file"])
    film, is_pendulum = asked["film"], "bob" in asked.get("options", {})
    of_device = () if is_pendulum else ("W", "R", "origin")
    constants = {k: asked[k] for k in of_device if asked.get(k) is not None}
    tell({"say": "reading the film" if film else "reading the table"})
    if film:
        _check(file)
        if not is_pendulum and "W" not in constants:
            raise UddError(_NO_DRIVE)
        measurement = _tracked(file, asked["options"], tell, asked.get("hints")).with_meta(**constants)
    else:
        measurement = measurement_of(file, asked.get("columns") or [], constants)
        measurement = between(measurement, asked.get("begin"), asked.get("end"))
    measurement.to_csv(OUT / "measurement.csv")
    swings = measurement.names in (("theta",), ("Omega",))
    length: Any = asked.get("length") or measurement.meta.get("length")
    R: Any = measurement.meta.get("R", 0.08)
    if swings and not length:
        raise UddError("this is a pendulum's record: say its length in cm")
    if measurement.inputs:
        model: Model = driven_model(measurement, float(length) if swings else None, float(R))
    elif measurement.names == DOUBLE:
        model = double_pendulum(measurement)
    elif swings:
        pendulum = Pendulum(float(length))
        model = pendulum if measurement.kind == "pendulum" else pendulum.with_gyroscope()
    else:
        W = measurement.meta.get("W")
        if W is None:
            raise UddError(_NO_DRIVE)
        model = Disk(float(W), R=float(R))
    discovery = discover(measurement, model, progress=lambda text: tell({"say": text}))
    tell({"say": "drawing the report"})
    shown = file if film and measurement.kind != "own" else None
    report = discovery.report(OUT / "report.html", film=shown, source=file)
    (OUT / "discovery.json").write_text(as_json(discovery.to_dict()), encoding="utf-8")
    from . import report_parts, result

    return {**result.of(discovery), "parts": report_parts.save_parts(report, OUT)}


def _check(file: Path) -> None:
    """Refuse a film that is too large or cut off."""
    from udd.tracking import Film, TrackError

    film = Film(file)
    if math.prod(film.size) > limits.PIXELS:
        raise TrackError(f"the film's frames of {film.size[0]} x {film.size[1]} pixels are too large")
    if film.promised > limits.FRAMES:
        raise TrackError(f"the film has {film.promised} frames; at most {limits.FRAMES} are tracked here")
    missing = film.promised - film.packets
    if missing > _CUT * film.promised:
        raise TrackError(f"the film is cut off: {missing} of its {film.promised} frames are missing")


def _tracked(
    file: Path, options: dict[str, Any], tell: Tell, hints: dict[str, Any] | None = None
) -> Measurement:
    """Track a film, and show it meanwhile; a refused film leaves frames to click on, which give hints."""
    import cv2

    from udd.tracking import TrackedFrame, TrackError
    from udd.tracking.pipeline import run_tracker
    from udd.tracking.tracking_result import Tracking

    tell({"say": "looking over the film"})
    last = 0.0

    def watch(seen: TrackedFrame) -> None:
        nonlocal last
        now = time.monotonic()
        if seen.frames > limits.FRAMES:
            raise TrackError(f"the film has {seen.frames} frames; at most {limits.FRAMES} are tracked here")
        if now - last < _PICTURES_EVERY and seen.picture.index + 1 < seen.frames:
            return
        if last == 0.0:
            tell({"say": "tracking the film"})
        last = now
        height, width = seen.picture.y.shape
        factor = min(1.0, _PICTURE / max(height, width))
        small = cv2.resize(seen.image[:, :, ::-1], None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
        frame: dict[str, Any] = {"number": seen.picture.index + 1, "of": seen.frames, "t": seen.picture.t}
        if seen.held:
            frame["marks"] = (factor * seen.marks).tolist()
            frame["centre"] = [factor * c for c in seen.centre]
        tell({"frame": frame, "jpeg": base64.b64encode(jpeg.tobytes()).decode()})

    refining = False

    def stage(text: str) -> None:
        nonlocal refining
        if text.startswith("refine") and not refining:
            refining = True
            tell({"say": "refining the positions"})

    try:
        done = run_tracker(file, watch=watch, config={**options, **(hints or {})}, progress=stage)
        return done.measurement if isinstance(done, Tracking) else done
    except UddError:
        _leave_frames(file, {**options, **(hints or {})}, options)
        raise


def _leave_frames(file: Path, options: dict[str, Any], without_clicks: dict[str, Any]) -> None:
    """Write frames to click on, and the clicks so far."""
    from udd.report.refused_film import click_data, look

    # clicks that cannot be used are no reason to show nothing
    refused = look(file, options) or look(file, without_clicks)
    if refused is not None:
        (OUT / REFUSED).write_text(as_json(click_data(refused)), encoding="utf-8")


def _render(asked: dict[str, Any], tell: Tell) -> dict[str, Any]:
    """Film a run of the page."""
    from udd.film import render
    from udd.simulation.trajectory import integrated

    from .growing_run import RATE, times_of
    from .interruption import Interruptible
    from .spec import start_of

    start, seconds = start_of(asked["start"]), float(asked["seconds"])
    tell({"say": "filming the run"})
    times = times_of(start.model, round(seconds * RATE) + 1)
    run = Interruptible().run(lambda: integrated(start.model, times, start.state), limits.RUNS.seconds)
    render(run, OUT / "run.mp4")
    return {"parts": [{"name": "run.mp4", "title": "Film of the run"}]}


JOBS: dict[str, Callable[[dict[str, Any], Tell], dict[str, Any]]] = {"loop": _loop, "render": _render}

if __name__ == "__main__":
    main()
