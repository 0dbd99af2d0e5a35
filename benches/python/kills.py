"""SIGKILL at random moments of commands that write files: what is there must be complete, or absent.

`python kills.py` kills each command 20 times, `python kills.py 5 track paper` the commands `track` and
`paper` 5 times each. Half of the kills fall into the last part of a run, where files are written. A sweep
that was killed is run again, and must end in the same values. Prints how often which files were there, and
fails if one was there in part.
"""

from __future__ import annotations

import contextlib
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import udd

SPEC = """
quantity = "lyapunov"
model = {kind = "dle", w = 1.0}
chunk = 4
[over]
w = {from = 0.05, to = 10.0, n = 400}
[options]
tol = 0.02
"""
SAVE = """
import sys, udd
fit = udd.load(sys.argv[1])
for k in range(20):
    udd.save(fit, sys.argv[2])
"""
UDD = [sys.executable, "-W", "ignore", "-m", "udd"]
#: Arguments, and the files that a command makes in its folder.
COMMANDS: dict[str, tuple[list[str], list[str]]] = {
    "sweep": ([*UDD, "sweep", "{made}/spec.toml", "--store", "{out}/store"], []),
    "track": ([*UDD, "track", "{made}/film.mp4", "--out", "{out}/table.csv"], ["table.csv"]),
    "discover": (
        [*UDD, "discover", "{made}/swing.csv", "--pendulum", "1.0", "--report", "{out}/report.html"],
        ["report.html"],
    ),
    "save": ([sys.executable, "-W", "ignore", "-c", SAVE, "{made}/fit.npz", "{out}/fit.npz"], ["fit.npz"]),
    "paper": (
        [*UDD, "paper", "--only", "eigenvalues", "--only", "scales", "--out", "{out}/paper"],
        ["paper/eigenvalues.svg", "paper/eigenvalues.png", "paper/index.html"],
    ),
}


def make(folder: Path) -> None:
    """Write the files that the commands read."""
    (folder / "spec.toml").write_text(SPEC)
    t = np.arange(0, 20, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    theta = theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    swing = udd.Measurement(t, {"theta": theta})
    swing.to_csv(folder / "swing.csv")
    udd.save(udd.fit(swing, udd.Pendulum(1.0, k0=0.1), free=["k0"]), folder / "fit.npz")
    run = udd.simulate(udd.Disk(0.039), np.arange(0, 2, 0.005), [9.0, 1e-3, 0.04, 0.0], dense=True)
    udd.render(run, folder / "film.mp4", rng=1)


def arguments(name: str, made: Path, out: Path) -> list[str]:
    """The command with its folders."""
    return [word.replace("{made}", str(made)).replace("{out}", str(out)) for word in COMMANDS[name][0]]


def whole(path: Path) -> bool:
    """Whether a file can be read to its end."""
    if path.suffix == ".csv":
        return len(udd.read_measurement(path)) == 50
    if path.suffix == ".npz":
        return bool(udd.load(path).summary())
    content = path.read_bytes().rstrip()
    return content.endswith((b"</html>", b"</svg>", b"\x60\x82"))  # the last is the end of a PNG


def values(store: Path) -> list[bytes]:
    """The arrays of a sweep's store."""
    import xarray as xr

    stored = xr.open_zarr(store, consolidated=False, chunks=None)
    return [stored[name].to_numpy().tobytes() for name in sorted(stored.variables)]


def main() -> int:
    """Kill, and look."""
    turns = int(sys.argv[1]) if sys.argv[1:] else 20
    chance, broken = random.Random(45), 0
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder)
        make(made)
        for name in sys.argv[2:] or COMMANDS:
            first = made / name
            first.mkdir()
            start = time.perf_counter()
            subprocess.run(arguments(name, made, first), check=True, capture_output=True)
            lasts = time.perf_counter() - start
            seen: Counter[str] = Counter()
            turn = 0
            while seen["killed"] < turns and turn < 5 * turns:
                turn += 1
                out = made / f"{name}{turn}"
                out.mkdir()
                call = arguments(name, made, out)
                process = subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                start = time.perf_counter()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(
                        lasts * (chance.uniform(0.85, 1.0) if turn % 2 else chance.uniform(0.0, 0.85))
                    )
                    lasts = time.perf_counter() - start  # the machine has other work
                process.kill()
                seen["killed" if process.wait() == -signal.SIGKILL else "ended before"] += 1
                for file in COMMANDS[name][1]:
                    if (out / file).exists():
                        good = whole(out / file)
                        seen[f"{file} {'complete' if good else 'IN PART'}"] += 1
                        broken += not good
                if name == "sweep":
                    subprocess.run(call, check=True, capture_output=True)
                    good = values(out / "store") == values(first / "store")
                    seen["resumed to the same values" if good else "resumed to OTHER VALUES"] += 1
                    broken += not good
            said = ", ".join(f"{count} {what}" for what, count in sorted(seen.items()))
            print(f"{name:9} {lasts:5.1f} s a run: {said}", flush=True)
    print(f"{broken} files in part")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
