"""Make the figures of paper.md: ``python paper/figures.py``."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("agg")

import numpy as np

import udd


def main(folder: Path, n: int = 60) -> list[Path]:
    """Draw the device, and the exponents over the drive."""
    w = np.linspace(0.5, 8.0, n)
    values, errors = udd.lyapunov(w, tol=0.02, with_error=True)
    pictures = {
        "geometry.png": udd.plot.geometry(),
        "exponents.png": udd.plot.exponents(w, values, errors=errors),
    }
    for name, ax in pictures.items():
        ax.figure.savefig(folder / name, dpi=200)
    return [folder / name for name in pictures]


if __name__ == "__main__":
    print(*main(Path(__file__).parent), sep="\n")
