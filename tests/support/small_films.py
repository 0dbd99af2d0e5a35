"""Small films of a simulated disk, with any defect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import udd
from udd.film import Film

SMALL = (276, 350)  # pixels: half of the paper's, 878 per metre


def shot(
    path: Path, seconds: float = 3.6, start: tuple[float, ...] = (1, 0.02, -0.02, 0.3), **more: Any
) -> Film:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, seconds, 0.005), list(start), dense=True)
    return udd.render(run, path, **{"size": SMALL, **more})
