"""How well the tracker does at the limit of the camera: films with one defect each, the truth beside.

    python benches/python/tracker [--only clean,standard] [--trackers udd,HSV] [--json out.json]

Films are made by the film maker with the seed (14 s, 550 x 700 pixels, 1750 per metre, W = 0.039 m/s, noise 2
of 255, MPEG-4 as OpenCV writes it, exposure 10 ms, the support before the disk; each row says what differs),
and kept in the folder. udd gets only the disk's radius; the other trackers get colours, scale
and pivot. Errors are those of the table, "shape" those after a shift and a common factor. A row is wrong if
it is off by 2 mm or 0.1 rad without a flag, or has a position without a disk.

trackpy and CSRT, which OpenCV 5 has no longer, come from a folder of their own:

    pip install --target build/peers --no-deps trackpy looseversion "opencv-contrib-python-headless<5"
    PYTHONPATH=build/peers python benches/python/tracker --only standard --trackers udd,HSV,trackpy,CSRT
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
import warnings
from dataclasses import asdict
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from films import Case, film, named, shared
from scoring import Score, score

HEAD = (
    f"{'film':34} {'tracker':9} {'Y,Z mm':>8} {'mrad':>7} {'shape':>7} {'lost %':>7} {'wrong':>5} "
    f"{'pivot mm':>8} {'W %':>7} {'cover':>6} {'fps':>6}"
)


def main() -> int:
    """Print the table; 1 where a row of udd's misses its limits."""
    parser = argparse.ArgumentParser(
        prog="tracker", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="words of which a film's name must hold one")
    parser.add_argument(
        "--trackers", default="udd", help="of udd, fast (the first pass alone), HSV, trackpy, CSRT"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=Path("build/tracker"), help="where films are kept")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    rows, missed = [], 0
    print(HEAD, flush=True)
    wanted = args.trackers.split(",")
    trackers = {"udd": ours, "fast": fast}
    if not set(wanted) <= set(trackers):
        import others

        trackers |= others.TRACKERS
    for name in set(wanted) - set(trackers):
        print(f"{name} is not installed here; the table goes without it")
    trackers = {name: tracker for name, tracker in trackers.items() if name in wanted}
    for case in named([w for w in args.only.split(",") if w]):
        result = (
            shared(case) if case.name.startswith("shared") else (case, film(case, args.folder, args.seed))
        )
        if result is None:
            print(f"{case.name:34} is not here", flush=True)
            continue
        case, made = result
        for name, tracker in trackers.items():
            try:
                s = tracker(case, made)
            except Exception as error:  # a tracker that gives up has a row too
                print(f"{case.name:34} {name:9} {type(error).__name__}: {error}", flush=True)
                missed += name == "udd"
                continue
            ok = s.passes(case)
            missed += name == "udd" and not ok
            print(line(case, name, s, ok), flush=True)
            rows.append({"film": case.name, "tracker": name, "passes": ok, **asdict(s)})
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1))
    return int(missed > 0)


def line(case: Case, name: str, s: Score, ok: bool) -> str:
    """One row of the table."""
    mark = "" if ok or name != "udd" else f"  ! at most {case.limits[0]:g}, {case.limits[1]:g}"
    return (
        f"{case.name:34} {name:9} {s.length:8.3f} {s.angle:7.2f} {s.shape:7.3f} {100 * s.lost:7.2f} "
        f"{s.wrong:5d} {s.pivot:8.3f} {100 * s.drive:7.2f} {s.cover:6.2f} {s.rate:6.1f}{mark}"
    )


def ours(case: Case, made, **options) -> Score:  # type: ignore[no-untyped-def]
    """`udd.track` with the radius alone."""
    import udd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        begun = time.perf_counter()
        before = os.times()
        m = udd.track(made.path, disk_radius=made.radius, **options)
        rate = len(m) / (time.perf_counter() - begun)
        after = os.times()
        if os.environ.get("UDD_CPU"):  # frames per second of processor time, on a busy machine
            rate = len(m) / (sum(after[:4]) - sum(before[:4]))
    place = complex(float(m.meta["pivot_u"]), float(m.meta["pivot_v"]))
    scale = float(m.meta["px_per_m"])
    off = abs(place - complex(*made.pivot)) / scale * 1e3
    drive = float(m.meta["drive_seen"]) / case.W - 1 if case.W else math.nan
    return score(case, made, m.t, m.values.copy(), m.covariance(), rate, off, drive)


def fast(case: Case, made) -> Score:  # type: ignore[no-untyped-def]
    """The same without the second pass."""
    return ours(case, made, refine=False)


if __name__ == "__main__":
    np.seterr(all="ignore")
    sys.exit(main())
