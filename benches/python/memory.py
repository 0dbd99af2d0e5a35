"""Peak memory of a sweep over a million drives, beyond the import, as a multiple of its result's size.

python benches/python/memory.py
"""

from __future__ import annotations

import resource
import subprocess
import sys
import warnings

import numpy as np

DRIVES = 1_000_000
TIME = 4.0
LIMIT = 2.0


def peak() -> int:
    """Return the most memory this process has had, in bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def sweep() -> None:
    """Print the growth of the peak and the result's size; for a process of its own."""
    import udd

    drives = np.linspace(0.05, 10, DRIVES)
    # So short a run has no error bar that could meet the goal.
    warnings.simplefilter("ignore", udd.ConvergenceWarning)
    lyapunov = udd.lyapunov
    lyapunov(drives[:100], t=TIME, progress=False)  # the code's own pages come in on first use
    before = peak()
    exponents = lyapunov(drives, t=TIME, progress=False)
    print(peak() - before, exponents.nbytes)


def main() -> None:
    """Print the ratio and fail where it is too large."""
    run = [sys.executable, __file__, "sweep"]
    growth, size = map(int, subprocess.run(run, check=True, stdout=subprocess.PIPE, text=True).stdout.split())
    print(
        f"{DRIVES:,} drives: {growth / 1e6:.0f} MB beyond import and drives, result {size / 1e6:.0f} MB,"
        f" {growth / size:.2f} times its size (at most {LIMIT})"
    )
    sys.exit(growth > LIMIT * size)


if __name__ == "__main__":
    sweep() if sys.argv[1:] == ["sweep"] else main()
