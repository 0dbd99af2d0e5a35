"""`udd film`: what a camera would see of a simulated run."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

from udd._util.number_text import decimal_hint
from udd.errors import UddError

from .export import OutputFile
from .options import disk, new
from .output import CommandResult, shown_progress
from .simulate import add_run, run_model

_STEP = 0.005  # s between samples of the run, short enough for the camera


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "film",
        run,
        "Film a simulated run of the disk, as a camera in front of it would record it.",
        (
            "udd film run.mp4 --W 0.042 --t 2 --effect relaxation:b=6",
            "udd film small.mp4 --W 0.042 --t 1 --size 220x280",
        ),
    )
    parser.add_argument("out", type=Path, action=OutputFile, metavar="OUT.mp4", help="film to write")
    add_run(parser)
    parser.add_argument("--fps", type=float, default=25.0, help="frames per second (default 25)")
    parser.add_argument(
        "--exposure", type=float, default=0.01, help="seconds that the shutter is open (default 0.01)"
    )
    parser.add_argument("--size", default="550x700", help="width x height in pixels (default 550x700)")
    parser.add_argument("--tilt", type=float, default=0.0, help="the camera's tilt [rad] (default 0)")
    parser.add_argument("--noise", type=float, default=2.0, help="sensor noise in codes of 255 (default 2)")
    parser.add_argument(
        "--quality", type=float, default=20.0, help="constant rate factor, 0 best to 51 (default 20)"
    )
    parser.add_argument("--codec", default="h264", help="h264 (default), hevc or mp4v (as OpenCV writes it)")
    parser.add_argument(
        "--defect",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help='what goes wrong, such as clutter=20, readout=0.8, off_axis="(0.26, 0)"; may be repeated',
    )
    parser.add_argument("--seed", type=int, default=0, help="of the noise (default 0)")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.film import render
    from udd.video.writer import checked_path, require_video

    if args.W is None:
        raise UddError("give the drive speed with --W in m/s (--W 0 if the wheels stand still)")
    size = re.fullmatch(r"(\d+)[xX](\d+)", args.size)
    if size is None:
        raise UddError(f"--size must be width x height, such as 550x700, not {args.size}")
    defects = _defects(args.defect)
    model = disk(args, args.W, 0.08 if args.R is None else args.R)
    require_video()
    checked_path(args.out)
    trajectory = run_model(model, args, _STEP, dense=True)
    made = render(
        trajectory,
        args.out,
        fps=args.fps,
        exposure=args.exposure,
        size=(int(size[1]), int(size[2])),
        tilt=args.tilt,
        noise=args.noise,
        quality=args.quality,
        codec=args.codec,
        defects=defects,
        rng=args.seed,
        progress=shown_progress(),
    )
    left = ", until the disk leaves the wheels" if trajectory.outcome == "ejected" else ""
    text = f"{made.path}: {len(made.t)} {'frame' if len(made.t) == 1 else 'frames'}, {made.t[-1]:.2f} s{left}"
    data = {"file": made.path, "frames": len(made.t), "outcome": trajectory.outcome, "model": repr(model)}
    return CommandResult(text, data)


def _defects(given: list[str]) -> Any:
    import ast
    from dataclasses import fields

    from udd.film import Defects

    names = [f.name for f in fields(Defects)]
    defects: dict[str, Any] = {}
    for text in given:
        name, sign, value = text.partition("=")
        if not sign or name not in names:
            raise UddError(f"--defect must be NAME=VALUE with a name of {', '.join(names)}, not {text}")
        hint = decimal_hint(value)
        if hint and isinstance(getattr(Defects, name), int | float):
            raise UddError(f"--defect {name}: {hint}")
        try:
            defects[name] = ast.literal_eval(value)
        except (ValueError, SyntaxError, RecursionError, MemoryError):
            raise UddError(f"--defect {name}: {value!r} is no number and no tuple of numbers") from None
    try:
        return Defects(**defects)
    except TypeError:
        raise UddError(f"--defect: a value is of the wrong kind among {', '.join(given)}") from None
