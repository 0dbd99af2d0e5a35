"""`udd track`: from a film to a measurement."""

from __future__ import annotations

import argparse
import shlex
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd._util.atomic_files import require_writable
from udd.calibration_items import SWITCHES, Item
from udd.errors import UddError

from .export import PAGES, TABLES, OutputFile, check_ending
from .inputs import add_partial, is_film, whole
from .options import new, numbers
from .output import CommandResult, shown_progress
from .refused_film import explain

if TYPE_CHECKING:
    from udd.measurement import Measurement

DOUBTFUL = 3  # exit code of a track that its own film makes doubtful


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "track",
        run,
        "Measure the motion of the disk in a film; the table is CSV.",
        (
            "udd track film.mp4 --out motion.csv",
            "udd track clock.mp4 --bob red --length 0.8 --out clock.csv",
        ),
    )
    parser.add_argument(
        "file",
        type=Path,
        nargs="?",
        metavar="FILM",
        help="a film by a camera at rest, the four colour marks in view; or a folder of films, or of "
        "the pictures of one film",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="CSV",
        help="file to write (for a folder: folder); otherwise standard output",
    )
    parser.add_argument(
        "--camera", type=int, metavar="N", help="record a film from webcam N (0: the first), and track that"
    )
    parser.add_argument("--seconds", type=float, metavar="S", help="with --camera: how long (default 20)")
    parser.add_argument(
        "--film", type=Path, action=OutputFile, metavar="MP4", help="with --camera: the film to write"
    )
    parser.add_argument("--disk-radius", type=float, metavar="M", help="sets the scale (default 0.08)")
    parser.add_argument(
        "--pivot", metavar="U,V", help="contact in the picture [pixels]; found where not given"
    )
    parser.add_argument(
        "--mark-distance",
        type=float,
        metavar="M",
        help="from the marks' centres to the disk's (default 65/80 R)",
    )
    parser.add_argument("--scale", type=float, metavar="PX", help="pixels per metre, given instead of found")
    parser.add_argument(
        "--region", metavar="U0,V0,U1,V1", help="part of the picture in which the disk moves [pixels]"
    )
    parser.add_argument(
        "--calibrate",
        metavar="ITEM=HOW,...",
        help=f"on, off or a number for {', '.join(map(_named, SWITCHES))}; "
        "such as lens=off,readout=0.02 (default: all on)",
    )
    parser.add_argument(
        "--bob",
        metavar="COLOUR",
        help="the film is one of a pendulum, its bob of this colour (or codes 150,105,65; two bobs red,blue)",
    )
    parser.add_argument("--length", type=float, metavar="M", help="with --bob: from the pivot to the bob [m]")
    parser.add_argument(
        "--fps",
        metavar="RATE",
        help="frames per second, if the header is wrong; 30,61:240,301:30 if it changes at these frames",
    )
    parser.add_argument(
        "--config",
        type=Path,
        metavar="TOML",
        help="file with any of these, and with layout (marks or tags of another disk); options win",
    )
    parser.add_argument(
        "--click",
        type=Path,
        metavar="TOML",
        help="open a window to click in what is known (pivot, marks, edge, region), write it to this file, "
        "and track with it",
    )
    parser.add_argument(
        "--distance", type=float, metavar="M", help="with --click: between two points to click, for the scale"
    )
    parser.add_argument(
        "--leave-out",
        metavar="FRAMES",
        help="frames that are not used, such as 3,10-20 (the first is 0)",
    )
    parser.add_argument(
        "--clicks",
        metavar="POINTS",
        help="points clicked in a frame [pixels], as the page of a refused film writes them: "
        "frame=12,pivot=275:310,mark=200:100",
    )
    parser.add_argument("--fast", action="store_true", help="without the second pass")
    parser.add_argument(
        "--smooth", action="store_true", help="average the noise over neighbouring frames (not for fits)"
    )
    parser.add_argument(
        "--slip",
        type=float,
        metavar="M/S",
        help="with --smooth: assume that the disk rolls, dY/dT = Z Omega, with this standard error",
    )
    parser.add_argument(
        "--overlay",
        type=Path,
        action=OutputFile,
        metavar="MP4",
        help="film to write, what was found drawn upon it",
    )
    parser.add_argument(
        "--page",
        type=Path,
        action=OutputFile,
        endings=PAGES,
        metavar="HTML",
        help="page to write: the motion and its errors; a refused film leaves one anyway, NAME-refused.html",
    )
    add_partial(parser)
    parser.add_argument("--W", type=float, help="drive speed [m/s], to be noted in the header")


def _named(item: Item) -> str:
    return f"{item.name} [{item.unit}]" if item.unit else item.name


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd._util.validation import number

    _check_source(args)
    if args.slip is not None and not args.smooth:
        raise UddError("--slip is an option of --smooth")
    if args.slip is not None:
        number("--slip", args.slip, above=0.0)
    if args.camera is None and args.file.is_dir() and not _of_pictures(args.file):
        return _folder(args)
    if args.out is not None:
        require_writable(args.out)
        check_ending(args.out, TABLES)
    if args.overlay is not None:
        from udd.video.writer import checked_path

        checked_path(args.overlay)
    header = {} if args.W is None else {"W": number("W", args.W, least=0.0)}
    options = _options(args)
    report, before = ("", {}) if args.camera is None else _record(args)
    if args.click is not None:
        from .track_click import clicked

        options, report, before = clicked(args, options)
    detail: list[Any] = []
    try:
        m = _tracked(args, options, detail).with_meta(**header)
    except UddError as error:
        _explain(args, options, error)
        if args.click is None:
            raise
        raise UddError(f"{error} ({report.strip()})") from None
    text, data = _summary(m)
    text, data = report + text, {**before, **data}
    if args.overlay is not None:
        from udd.tracking import overlay

        overlay(args.file, m, args.overlay)
        text += f"\nwritten: {args.overlay}"
        data["overlay"] = args.overlay
    if args.page is not None:
        from udd.tracking import page

        page(args.file, detail[0] if detail and not args.smooth else m, args.page, command=_command(args))
        text += f"\nwritten: {args.page}"
        data["page"] = args.page
    if args.out is not None:
        m.to_csv(args.out)
        return CommandResult(f"{text}\nwritten: {args.out}", {**data, "file": args.out}, _code(m))
    if not args.json:
        with tempfile.TemporaryDirectory() as folder:
            table = Path(folder) / "table.csv"
            m.to_csv(table)
            sys.stdout.write(table.read_text(encoding="utf-8"))
        print(f"udd: {text}", file=sys.stderr)
    return CommandResult("", data, _code(m))


def _of_pictures(folder: Path) -> bool:
    """Return True if a folder holds pictures of one film, and no films."""
    from udd.video.decoder_process import images_in

    return bool(images_in(str(folder))) and not any(is_film(file) for file in folder.iterdir())


def _explain(args: argparse.Namespace, options: dict[str, Any], error: UddError) -> Path | None:
    """Write the page of a film that the tracker refuses."""
    page = args.page
    if page is None:  # where the table would be
        out = Path() if args.out is None else args.out
        page = (out if args.out is None or out.is_dir() else out.parent) / f"{args.file.stem}-refused.html"
    given = {"disk_radius": args.disk_radius, **options}
    commands = _command(args), _command(args, without=("pivot", "region", "fps", "leave_out", "clicks"))
    return explain(args.file, error, page, given, commands)


def _code(m: Measurement) -> int:
    """Return the exit code: 3 if the track is doubtful."""
    return DOUBTFUL if m.meta.get("doubts") else 0


def _check_source(args: argparse.Namespace) -> None:
    if args.distance is not None and args.click is None:
        raise UddError("--distance is an option of --click")
    if args.click is not None:
        from .track_click import check

        check(args)
    if args.camera is None:
        if args.file is None:
            raise UddError("say which film to track, or --camera 0 to record one")
        for name in ("seconds", "film"):
            if getattr(args, name) is not None:
                raise UddError(f"--{name} is an option of --camera")
    elif args.file is not None:
        raise UddError(f"{args.file} and --camera are two sources: say one (--film is the film to write)")
    elif args.film is None:
        raise UddError("say with --film which film to write from the camera")


def _record(args: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """Record a film, which is then the file to track."""
    from udd.tracking import record

    seconds = 20.0 if args.seconds is None else args.seconds
    made = record(args.film, camera=args.camera, seconds=seconds, progress=shown_progress())
    args.file = made.path
    summary = {"frames": len(made.t), "lost": made.lost, "gaps_s": made.gaps, "clock": made.clock}
    return f"{made}\nwritten: {made.path}\n", {"recording": {**summary, "film": made.path}}


_SAID = (
    *("disk_radius", "mark_distance", "fps", "pivot", "scale", "region", "calibrate", "bob", "length"),
    *("leave_out", "clicks", "config"),
)


def _command(args: argparse.Namespace, without: tuple[str, ...] = ()) -> str:
    """Return the command that makes the page again; one for other values of some options has full paths."""

    def said(path: Path) -> str:
        return str(path) if without else path.name

    words = ["udd", "track", said(args.file)]
    for name in _SAID:
        value = getattr(args, name)
        if value is not None and name not in without:
            words += [f"--{name.replace('_', '-')}", str(value)]
    words += ["--fast"] if args.fast else []
    if without and args.out is not None:
        words += ["--out", str(args.out)]
    return shlex.join(words if args.page is None else [*words, "--page", said(args.page)])


def _tracked(
    args: argparse.Namespace, options: dict[str, Any], detail: list[Any] | None = None
) -> Measurement:
    """Track the film; what was found on the way comes into `detail`."""

    def measure() -> Measurement:
        from udd.tracking.pipeline import run_tracker
        from udd.tracking.tracking_result import Tracking

        motion = run_tracker(args.file, progress=shown_progress(), disk_radius=args.disk_radius, **options)
        if not isinstance(motion, Tracking):
            return motion
        if detail is not None:
            detail.append(motion)
        return motion.measurement

    m = whole(args, measure)
    if not args.smooth:
        return m
    from udd.measurement.smoother import smooth

    return smooth(m, slip=args.slip)


def _options(args: argparse.Namespace) -> dict[str, Any]:
    pivot = None
    if args.pivot is not None:
        place = numbers([args.pivot], "--pivot")
        if len(place) != 2:
            raise UddError(f"--pivot must be two numbers U,V, not {args.pivot}")
        pivot = (place[0], place[1])
    options: dict[str, Any] = {
        "pivot": pivot,
        "mark_distance": args.mark_distance,
        "fps": _rates(args.fps),
        "scale": args.scale,
    }
    if args.region is not None:
        options["region"] = numbers([args.region], "--region")
    if args.calibrate is not None:
        options["calibrate"] = _calibrate(args.calibrate)
    options |= {name: getattr(args, name) for name in ("bob", "length", "leave_out", "clicks")}
    return {**options, "refine": False if args.fast else None, "config": args.config}


def _rates(said: str | None) -> Any:
    """Read rates such as 240 or 30,61:240,301:30."""
    if said is None:
        return None
    rates = []
    for k, part in enumerate(said.split(",")):
        first, colon, rate = part.rpartition(":")
        if bool(colon) != (k > 0):
            raise UddError(f"--fps must be like 240, or 30,61:240,301:30 (from frame 61 on 240), not {said}")
        rates.append((int(numbers([first], "--fps")[0]) if colon else 0, numbers([rate], "--fps")[0]))
    return rates if len(rates) > 1 else rates[0][1]


def _calibrate(said: str) -> dict[str, Any]:
    """Read items such as lens=off,readout=0.02."""
    items: dict[str, Any] = {}
    for part in said.split(","):
        name, equals, value = (x.strip() for x in part.partition("="))
        if not equals:
            raise UddError(
                f"--calibrate must be like lens=off,readout=0.02 (the decimal sign is a point), not {said}"
            )
        switch = {"on": True, "off": False}.get(value)
        items[name] = numbers([value], f"--calibrate {name}")[0] if switch is None else switch
    return items


def _summary(m: Measurement) -> tuple[str, dict[str, Any]]:
    import numpy as np

    usable = int(m.seen.sum())
    text = f"{usable} of {len(m)} frames usable, {m.duration:.2f} s"
    data: dict[str, Any] = {
        "frames": len(m),
        "usable": usable,
        "duration_s": m.duration,
        "meta": dict(m.meta),
    }
    if m.sigma is not None:
        spread = np.nanmedian(m.sigma, axis=0)
        each = [
            f"{1e3 * s:.2g} {'mm' if name in ('Y', 'Z') else 'mrad'}"
            for name, s in zip(m.names, spread, strict=True)
        ]
        text += f"; median standard errors {', '.join(each)}"
        data["sigma_median"] = dict(zip(m.names, spread, strict=True))
    delays = sum("delays" in flag for flag in m.flag.tolist())
    if delays:
        text += f"; {delays} inserted copies of frames, whose delay is taken out of the times"
    if "clock" in m.meta:
        text += f"; {m.meta['clock']}"
    return text, data


def _folder(args: argparse.Namespace) -> CommandResult:
    """Track all films of a folder; one that cannot be tracked does not stop the others."""
    films = sorted(path for path in args.file.iterdir() if path.is_file() and is_film(path))
    if not films:
        raise UddError(f"{args.file}: there is no film in this folder")
    if args.overlay is not None:
        raise UddError("--overlay is for one film, not for a folder")
    if args.page is not None:
        raise UddError("--page is for one film, not for a folder")
    if args.out is None or (args.out.exists() and not args.out.is_dir()):
        raise UddError("say with --out in which folder the tables of the films are to be written")
    options = _options(args)
    args.out.mkdir(exist_ok=True)
    lines, rows, failed, doubtful = [], [], 0, False
    for film in films:
        args.file = film
        try:
            m = _tracked(args, options)
        except UddError as error:
            failed += 1
            lines.append(f"{film.name}: {error}")
            page = _explain(args, options, error)
            rows.append({"film": film.name, "error": str(error), **({} if page is None else {"page": page})})
            continue
        table = args.out / f"{film.stem}.csv"
        m.to_csv(table)
        doubtful |= bool(m.meta.get("doubts"))
        text, data = _summary(m)
        drive = m.meta.get("drive_seen")
        lines.append(
            f"{film.name}: {text}" + (f"; drive {100 * drive:.3f} cm/s" if drive is not None else "")
        )
        rows.append({"film": film.name, "file": table, **data})
    code = 1 if failed else DOUBTFUL if doubtful else 0
    return CommandResult("\n".join(lines), {"films": rows, "failed": failed}, code)
