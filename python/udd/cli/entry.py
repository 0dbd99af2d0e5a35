"""Entry of the command line: from the arguments to the exit code."""

from __future__ import annotations

import atexit
import gc
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from udd._util.json_output import as_json
from udd.errors import UddError

from .option_names import in_options
from .output import CommandResult, speaking
from .parser import make_parser

# Optional packages: the extra that installs each, and its users.
_EXTRAS = {
    "av": ("track", "films need"),
    "cv2": ("track", "films need"),
    "distributed": ("scale", "sweeps need"),
    "shtab": ("shell", "completion needs"),
    "starlette": ("app", "the page needs"),
    "uvicorn": ("app", "the page needs"),
    "websockets": ("app", "the page needs"),
    "xarray": ("scale", "sweeps need"),
    "zarr": ("scale", "sweeps need"),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments; by default those of the process.

    Returns
    -------
    int
        0 fine, 1 bad input, 3 a film was tracked but the result is doubtful, 130 on Ctrl-C, 141 where nobody
        reads the output. Wrong usage leaves by ``SystemExit(2)``, as argparse does.
    """
    if argv is None:
        atexit.register(gc.freeze)  # a process that ends need not be searched for garbage: half a second
    parser = make_parser()
    try:
        args = parser.parse_args(argv)
        with warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            warnings.showwarning = _warner()
            with speaking("" if args.command == "app" else f"{args.command} is at work"):
                answer: CommandResult = args.run(args)
        _print(answer, args.json)
        sys.stdout.flush()
    except UddError as error:
        return _fail(str(error))
    except KeyboardInterrupt:
        print("udd: stopped", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The interpreter flushes once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except ImportError as error:
        name = (error.name or "").partition(".")[0]
        if name not in _EXTRAS:
            raise
        extra, needed = _EXTRAS[name]
        return _fail(f'{name} is not installed, which {needed}: pip install "udd[{extra}]"')
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _fail(f"{where}{error.strerror or error}")
    except MemoryError:
        return _fail("there is not enough memory for this; ask for less at once")
    return answer.code


def _print(answer: CommandResult, json: bool) -> None:
    if json:
        print(as_json(answer.data))
    elif answer.text:
        print(answer.text)


def _fail(message: str) -> int:
    print(f"udd: error: {' '.join(in_options(message).split())}", file=sys.stderr)
    return 1


def _warner() -> Callable[..., None]:
    """Return a function that prints warnings, each text once: options are checked before and after a film."""
    printed: set[str] = set()

    def warn(message: Warning | str, *_details: Any, **_options: Any) -> None:
        text = " ".join(in_options(str(message)).split())
        if text not in printed:
            print(f"udd: warning: {text}", file=sys.stderr)
        printed.add(text)

    return warn
