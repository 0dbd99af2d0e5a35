"""Flat field: where in the picture the bare disk is brighter, and where darker."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.video.reader import Picture

from .colour_blobs import Sight
from .occluder import bare

Array = NDArray[np.float64]
EVERY = 3  # Pixels: neighbours give the same information.
FEWEST = 200  # Pixels of a picture.
MOST = 60  # Pictures.
FAR = 0.3  # Relative difference from a picture's median light that is no bare disk.
SIGMAS = 3.0  # Standard deviations of a pixel that shows something else.
LEAST = 0.01  # Relative change of light over the disk's way: a smaller one moves marks by less than noise.


def evenness(
    seen: Sequence[tuple[Picture, Sight]],
    view: NDArray[np.bool_],
    body: NDArray[np.complex128],
    light: Array,
) -> NDArray[np.float32] | None:
    """Return the factor of each pixel's light, (height, width), that makes the disk evenly bright.

    Under light that grows to one side both edges of a mark seem to lie on that side. The disk is white and
    comes everywhere: the logarithm of its light is a parabola of the place and a constant for each picture,
    as lamps may flicker. None where the light is even.
    """
    height, width = view.shape
    sparse = np.zeros_like(view)
    sparse[::EVERY, ::EVERY] = True
    sparse &= view
    terms, values = [], []
    for picture, sight in seen[:MOST]:
        box, here = bare(sight, height, width, body)
        v, u = np.nonzero(here & sparse[box])
        amount = light[picture.y[box][v, u]]
        usual = np.median(amount) if len(amount) else 0.0
        good = np.abs(amount - usual) < FAR * usual
        if good.sum() < FEWEST:
            continue
        design = _terms(u[good] + box[1].start, v[good] + box[0].start, view.shape)
        value = np.log(amount[good])
        terms.append(design - design.mean(axis=0))
        values.append(value - value.mean())
    if not terms:
        return None
    every, value = np.concatenate(terms), np.concatenate(values)
    fair = np.ones(len(value), dtype=bool)
    for _ in range(3):
        solution = np.linalg.lstsq(every[fair], value[fair], rcond=None)[0]
        rest = np.abs(value - every @ solution)
        fair = rest <= SIGMAS * 1.48 * np.median(rest[fair])
    # a parabola says nothing about where the disk does not come
    centre, reach = np.array([s.centre for _, s in seen]), seen[0][1].reach
    columns, rows = (
        np.clip(np.arange(size), x.min() - reach, x.max() + reach)
        for size, x in ((width, centre.real), (height, centre.imag))
    )
    shade = np.stack([_terms(columns, np.full(width, row), view.shape) @ solution for row in rows])
    here = shade[np.ix_(rows == np.arange(height), columns == np.arange(width))]
    if np.ptp(here) < LEAST:
        return None
    return np.asarray(np.exp(here.mean() - shade), dtype=np.float32)


def _terms(u: NDArray[Any], v: NDArray[Any], shape: tuple[int, ...]) -> Array:
    x, y = u / shape[1] - 0.5, v / shape[0] - 0.5
    return np.column_stack([x, y, x * x, x * y, y * y])
