"""Seconds to the first output of each command of the docs, on a pipe, and its longest silence.

Usage: python benches/python/first_output.py [BEGINNING ...]

Print a row for each command of `docs/command-line.md`, or for those with one of these beginnings: seconds to
the first output, longest pause between two outputs, seconds in all. A command that a reader waits for must
write within a second. Its progress must move at least every five seconds.
"""

from __future__ import annotations

import os
import re
import selectors
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs" / "command-line.md"
LONGEST = 300.0  # s


def commands() -> list[str]:
    """Return the commands of the page without their comments, except those that take minutes."""
    lines = [line.strip() for line in DOCS.read_text().splitlines() if line.startswith("    ")]
    every = [re.sub(r"\s+#.*", "", line) for line in lines if line.startswith("udd ")]
    return [line for line in every if not line.startswith(("udd demo", "udd paper", "udd completion"))]


def timed(command: str) -> tuple[float, float, float]:
    """Run a command; return seconds to its first output, of its longest pause, and in all."""
    begin = last = time.monotonic()
    first, pause = float("nan"), 0.0
    words = [sys.executable, "-m", "udd", *shlex.split(command)[1:]]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        waiting = selectors.DefaultSelector()
        for stream in (process.stdout, process.stderr):
            waiting.register(stream, selectors.EVENT_READ)
        while waiting.get_map():
            for key, _ in waiting.select(timeout=1.0):
                if not os.read(key.fd, 1 << 16):
                    waiting.unregister(key.fileobj)
                    continue
                now = time.monotonic()
                pause, last = max(pause, now - last), now
                if first != first:
                    first = now - begin
            if time.monotonic() - begin > LONGEST:
                process.kill()
    return first, pause, time.monotonic() - begin


def main(beginnings: tuple[str, ...]) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        subprocess.run([sys.executable, "-m", "udd", "example", "all"], check=True, capture_output=True)
        print("| command | first output [s] | longest pause [s] | in all [s] |\n|---|---|---|---|")
        for command in commands():
            if command.startswith(beginnings):
                first, pause, whole = timed(command)
                print(f"| `{command}` | {first:.1f} | {pause:.1f} | {whole:.0f} |", flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or ("",))
