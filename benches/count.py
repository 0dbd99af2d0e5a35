"""Count the instructions of the core's hot paths and compare them with the committed counts.

    python benches/count.py [--update]

Fails if a path takes over 3 % more than `counts.json` has for this compiler; `--update` writes the file.
The paths are those of `paths.rs`, with AVX2, run one by one under valgrind's callgrind.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

COUNTS = Path(__file__).with_name("counts.json")
ROOT = Path(__file__).parents[1]
LIMIT = 3.0
REFRESH = "please refresh the counts (make bench-count ARGS=--update)"


def output(*command: str) -> str:
    """Return what a command prints; its errors go to the terminal."""
    run = subprocess.run(command, cwd=ROOT, check=False, stdout=subprocess.PIPE, text=True)
    if run.returncode:
        raise SystemExit(f"bench-count: this failed: {' '.join(command)}")
    return run.stdout


def toolchain() -> str:
    """Name the compiler and what it compiles for."""
    host = re.search(r"^host: (.*)$", output("rustc", "-vV"), re.MULTILINE)
    assert host
    return f"{output('rustc', '-V').strip()} {host[1]}"


def build() -> str:
    """Compile the benches and return the path of the program."""
    command = ("cargo", "bench", "--locked", "--package", "udd-benches", "--no-run")
    messages = map(json.loads, output(*command, "--message-format", "json", "--quiet").splitlines())
    results = [m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "paths"]
    return str(results[-1])


def count(program: str, path: str) -> int:
    """Count the instructions of one path, without those of the program's start."""
    tool = ("valgrind", "--tool=callgrind", "--toggle-collect=*counted*", "--callgrind-out-file=/dev/null")
    run = subprocess.run((*tool, program, "--count", path), check=False, capture_output=True, text=True)
    collected = re.search(r"Collected : (\d+)", run.stderr)
    if run.returncode or not collected or collected[1] == "0":
        raise SystemExit(f"bench-count: {path!r} was not counted:\n{run.stderr}")
    return int(collected[1])


def main() -> None:
    """Print a line per path, then the verdict."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--update", action="store_true", help="write today's counts to counts.json")
    update = parser.parse_args().update
    if not shutil.which("valgrind"):
        raise SystemExit("bench-count: please install valgrind")
    program = build()
    paths = output(program, "--count").splitlines()
    if not paths:
        print("bench-count: skipped, this machine has no AVX2")
        return
    key = toolchain()
    everything = json.loads(COUNTS.read_text()) if COUNTS.exists() else {}
    committed: dict[str, int] = everything.get(key, {})
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        counts = dict(zip(paths, pool.map(lambda path: count(program, path), paths), strict=True))

    verdicts: list[str] = []
    worse = False
    for path, now in counts.items():
        before = committed.get(path)
        change = 100 * (now / before - 1) if before else 0.0
        print(f"{path:24}{now:15,}" + (f"{before:15,}{change:+8.2f} %" if before else "              -"))
        if change > LIMIT:
            worse = True
            verdicts.append(f"{path!r} takes {change:.1f} % more instructions; at most {LIMIT:.0f} % may be")
        elif change < -LIMIT:
            verdicts.append(f"{path!r} takes {-change:.1f} % fewer instructions; {REFRESH}")
        elif committed and not before:
            verdicts.append(f"{path!r} has no count yet; {REFRESH}")
    if update:
        everything[key] = counts
        COUNTS.write_text(json.dumps(everything, indent=2) + "\n")
        print(f"bench-count: the counts of {key} are written to {COUNTS.relative_to(ROOT)}")
        return
    if not committed:
        verdicts.append(f"no counts to compare with for {key}")
    for verdict in verdicts or [f"all within {LIMIT:.0f} % of the committed counts"]:
        print(f"bench-count: {verdict}")
    sys.exit(worse)


if __name__ == "__main__":
    main()
