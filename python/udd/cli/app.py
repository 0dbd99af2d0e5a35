"""`udd app`: the page."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from udd.errors import UddError

from .options import new
from .output import CommandResult

_PORT = 8765


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Serve the page on this machine: the disk live, its dynamics, a film in and a verdict out."
    parser = new(
        commands,
        "app",
        run,
        summary,
        (
            "udd app",
            "udd app --classroom",
        ),
    )
    parser.add_argument(
        "link",
        nargs="?",
        metavar="LINK",
        help="a link copied from the page, or its part after #: the page opens with that run",
    )
    parser.add_argument(
        "--host",
        help="address to serve (default 127.0.0.1: this machine; with --classroom 0.0.0.0: the network)",
    )
    parser.add_argument(
        "--classroom",
        action="store_true",
        help="for a class: only runs, sections and diagrams; no files; at most 8 pages for each device",
    )
    parser.add_argument("--port", type=int, default=_PORT, help=f"port (default {_PORT}; 0: any free one)")
    parser.add_argument("--no-browser", action="store_true", help="print the link, open nothing")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.app.serving import serve

    if not 0 <= args.port <= 65535:
        raise UddError(f"--port must be from 0 to 65535, not {args.port}")
    fragment = (args.link or "").partition("#")[2] or (args.link or "")
    if args.link and "=" not in fragment:
        raise UddError(f"{args.link} is no link of the page: it has no # with a run behind it")

    host = args.host or ("0.0.0.0" if args.classroom else "127.0.0.1")

    def ready(link: str) -> None:
        print(link + (f"#{fragment}" if fragment else ""), flush=True)
        if not host.startswith("127.") and host != "localhost":
            _show_code(link + (f"#{fragment}" if fragment else ""))
        print("Ctrl-C ends it.", file=sys.stderr, flush=True)

    serve(
        host,
        args.port,
        fragment=fragment,
        browser=not args.no_browser,
        ready=ready,
        classroom=args.classroom,
    )
    return CommandResult("", {})


def _show_code(link: str) -> None:
    """Print a code that phones read, if the package for it is there and a terminal shows it."""
    if not sys.stderr.isatty():
        return
    try:
        import segno
    except ImportError:
        return
    segno.make(link).terminal(out=sys.stderr, compact=True)
