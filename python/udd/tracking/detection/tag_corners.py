"""The corners of a printed tag to a fiftieth of a pixel: lines through the edges of its black square."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Complexes = NDArray[np.complex128]
POINTS = 24  # along an edge
TRIM = 0.12  # of the edge left out at either end: there the other edge blurs into it
STEP = 0.25  # pixels between samples across an edge
MOST = 6.0  # pixels on either side that are looked at
OF_CELL = 0.8  # of the border's width at most: beyond are the tag's own cells
CLEAR = 12.0  # light between black and white, of 255
ROUNDS = 3


def sharpened(light: NDArray[np.float32], corners: Complexes, cells: int) -> Complexes | None:
    """Corners (4,) in pixels from rough ones, in turn; None where an edge is not clear.

    Each edge is where the light, across it, is half-way from the paper's to the ink's. A shutter adds up
    light, so that is its place at mid-exposure as long as the streak is shorter than the tag's border.
    `cells`: along a side, borders counted.
    """
    for _ in range(ROUNDS):
        lines = []
        for k in range(4):
            line = _edge(light, corners[k], corners[(k + 1) % 4], cells)
            if line is None:
                return None
            lines.append(line)
        corners = np.array([_meet(lines[k - 1], lines[k]) for k in range(4)])
        if not np.isfinite(corners).all():
            return None
    return corners


def _edge(
    light: NDArray[np.float32], start: complex, end: complex, cells: int
) -> tuple[complex, complex] | None:
    """Fit the line through an edge: a point and its direction; the tag is on its right (v down)."""
    import cv2

    along = (end - start) / abs(end - start)
    outward = -1j * along
    reach = min(MOST, OF_CELL * abs(end - start) / cells)
    off = np.arange(-reach, reach + STEP / 2, STEP)  # outward
    foot = start + (end - start) * np.linspace(TRIM, 1 - TRIM, POINTS)
    at = foot[:, None] + outward * off[None, :]
    profile = cv2.remap(
        light,
        at.real.astype(np.float32),
        at.imag.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    ).astype(np.float64)
    n = max(2, len(off) // 5)
    ink, paper = np.median(profile[:, :n]), np.median(profile[:, -n:])
    if paper - ink < CLEAR:
        return None
    above = profile > 0.5 * (ink + paper)
    first = np.argmax(above, axis=1)
    good = np.flatnonzero(above.any(axis=1) & (first > 0) & above[:, -n:].all(axis=1))
    if len(good) < POINTS // 2:
        return None
    k = first[good]
    low, high = profile[good, k - 1], profile[good, k]
    cross = off[k - 1] + STEP * (0.5 * (ink + paper) - low) / (high - low)
    x = np.linspace(TRIM, 1 - TRIM, POINTS)[good] - 0.5
    weight = np.ones(len(x))
    slope = np.zeros(2)
    for _ in range(4):
        design = np.column_stack([np.ones(len(x)), x]) * weight[:, None]
        slope = np.linalg.lstsq(design, cross * weight, rcond=None)[0]
        rest = np.abs(cross - slope[0] - slope[1] * x)
        weight = 1 / (1 + (rest / (3 * np.median(rest) + 0.02)) ** 2)
    a = start + outward * (slope[0] - 0.5 * slope[1])
    b = end + outward * (slope[0] + 0.5 * slope[1])
    return complex(a), complex(b - a)


def _meet(first: tuple[complex, complex], second: tuple[complex, complex]) -> complex:
    """Return the crossing of two lines."""
    (a, d), (b, e) = first, second
    cross = d.real * e.imag - d.imag * e.real
    if abs(cross) < 1e-9:
        return complex(np.nan, np.nan)
    w = b - a
    return a + d * (w.real * e.imag - w.imag * e.real) / cross
