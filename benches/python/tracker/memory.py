"""Peak memory of tracking a film of 500 frames and of one of 5000: beyond the tables, it must not grow.

python benches/python/tracker/memory.py [--frames 500,5000]

The longer film shows the shorter one's frames over and over, forth and back, at the size of the other films.
Each is tracked in a process of its own; the decoder's is counted too.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import warnings
from fractions import Fraction
from pathlib import Path

import numpy as np

FRAMES = (500, 5000)
ROW = 5_000  # bytes per frame that tables of Python objects may take (3 100 measured); a picture is a million
SLACK = 20e6  # bytes: what the allocator keeps


def peak() -> int:
    """Return the most memory that this process and its largest child have had, in bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * sum(
        resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )


def make(path: Path, frames: int) -> None:
    """Film 250 frames of a run, forth and back, until there are enough."""
    import udd
    from udd.tracking import Film
    from udd.video.rgb_frames import rgb
    from udd.video.writer import write_film

    run = udd.simulate(udd.Disk(0.039), np.arange(0, 10.1, 0.005), [0.0, 0.02, -0.03, 0.3], dense=True)
    once = udd.render(run, path.with_name("once.mp4"))
    shots = [rgb(picture, False) for picture in Film(once.path).pictures()][:250]
    order = [k if k < len(shots) else 2 * len(shots) - 1 - k for k in range(2 * len(shots))]
    write_film(path, (shots[order[k % len(order)]] for k in range(frames)), once.size, Fraction(25), 20.0)


def one(path: Path) -> None:
    """Print the peak; for a process of its own."""
    import udd

    warnings.simplefilter("ignore")
    udd.track(path)
    print(peak())


def main() -> None:
    """Print both peaks and fail where the longer film takes more."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", default=",".join(map(str, FRAMES)))
    parser.add_argument("--one", type=Path)
    args = parser.parse_args()
    if args.one:
        return one(args.one)
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        for frames in map(int, args.frames.split(",")):
            path = Path(folder) / f"{frames}.mp4"
            subprocess.run(
                [sys.executable, "-c", f"import memory; memory.make(memory.Path({str(path)!r}), {frames})"],
                check=True,
                cwd=Path(__file__).parent,
            )
            command = [sys.executable, __file__, "--one", str(path)]
            results[frames] = int(
                subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
            )
            print(f"{frames} frames: peak {results[frames] / 1e6:.0f} MB", flush=True)
    (short, least), (long, most) = min(results.items()), max(results.items())
    allowed = least + ROW * (long - short) + SLACK
    growth = (most - least) / max(long - short, 1)
    print(f"grows by {growth:.0f} bytes a frame (at most {ROW}, and {SLACK / 1e6:.0f} MB once)")
    sys.exit(most > allowed)


if __name__ == "__main__":
    main()
