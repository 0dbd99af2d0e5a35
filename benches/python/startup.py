"""Seconds that `import udd` takes beyond a bare Python: medians of fresh processes.

python benches/python/startup.py
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

RUNS = 20
LIMIT = 0.15


def seconds(code: str) -> float:
    """Time a fresh Python that runs this code."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)
    return time.perf_counter() - start


def main() -> None:
    """Print the seconds and fail where they are too many."""
    # The first import writes the bytecode; the two are timed in turn, so that both see the same load.
    seconds("import udd")
    pairs = [(seconds("pass"), seconds("import udd")) for _ in range(RUNS)]
    bare, whole = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"import udd: {whole - bare:.3f} s beyond the {bare:.3f} s of Python itself (at most {LIMIT} s)")
    sys.exit(whole - bare > LIMIT)


if __name__ == "__main__":
    main()
