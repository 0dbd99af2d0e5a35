"""Small films of pendulums, drawn from first principles."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from film_for_tests import FPS, HEIGHT, WIDTH, codes, light

OVER, PIVOT = 2, (158.0, 61.0)
Colour = tuple[int, int, int]
Bob = tuple[NDArray[np.float64], NDArray[np.float64], Colour]  # u, v [pixels], colour


def swing(bobs: list[Bob], wall: Colour, radius: float = 13.0) -> list[NDArray[np.uint8]]:
    """Bobs on dark rods that hang from the pivot, one below the other, in front of a wall."""
    random, shots = np.random.default_rng(1), []
    for k in range(len(bobs[0][0])):
        image = np.broadcast_to(light(wall), (HEIGHT * OVER, WIDTH * OVER, 3)).copy()
        joint = PIVOT
        for u, v, _ in bobs:
            ends = [[round((OVER * x + 0.5) * 16) for x in point] for point in (joint, (u[k], v[k]))]
            cv2.line(image, *ends, light((60, 60, 62)).tolist(), 2 * OVER, cv2.LINE_8, 4)
            joint = (u[k], v[k])
        for u, v, colour in bobs:
            at = [round((OVER * x + 0.5) * 16) for x in (u[k], v[k])]
            cv2.circle(
                image, at, round((radius * OVER - 0.5) * 16), light(colour).tolist(), -1, cv2.LINE_8, 4
            )
        small = codes(cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)).astype(float)
        noisy = small + random.normal(0, 1.5, small.shape)
        shots.append(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    return shots


def arc(angle: NDArray[np.float64], length: float, about: tuple[NDArray[np.float64] | float, ...] = PIVOT):
    return about[0] + length * np.sin(angle), about[1] + length * np.cos(angle)


def clock(frames: int = 45) -> NDArray[np.float64]:
    return 0.6 * np.cos(2 * np.pi * 0.9 * np.arange(frames) / FPS)
