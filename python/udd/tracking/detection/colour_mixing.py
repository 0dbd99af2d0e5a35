"""Brightness of pixels that a coloured mark and the bare disk share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from udd.video.srgb import code_of, light_of

Array = NDArray[np.float64]
# BT.601: red, green and blue codes from brightness, U and V
TO_RGB = np.array([[1, 0, 1.402], [1, -0.344136, -0.714136], [1, 1.772, 0]])
SHARES = np.linspace(0, 1, 101)


def mixed(light: Array, white: float, mark: float, colour: Array, full_range: bool) -> Array:
    """Amount of light, for each brightness code, of a mix of disk and mark in proportion to their shares.

    Colours mix as light, red, green and blue each by itself, and a brightness code is a sum of what the sRGB
    curve makes of the three. So half red and half white is brighter than the mean of the light of both codes,
    by some 5 % of their difference. A streak with a hidden end would seem too long.
    The codes of disk and mark keep their light. If the mark is as bright as the disk, brightness does not
    distinguish their mixes, and all codes keep their light.

    Parameters
    ----------
    light : (256,), of each code of what is grey.
    white, mark : amounts of light of the disk, which is grey, and of the mark.
    colour : (2,), U and V of the mark; NaN where it was not seen.
    full_range : whether codes go from 0 to 255.
    """
    # amounts of light of red, green and blue; what lies outside is a colour that no picture shows
    ends = [_codes(white, np.zeros(2)), _codes(mark, colour / (255 if full_range else 224))]
    one, other = (light_of(np.clip(c, 0, 1)) for c in ends)
    weight = np.linalg.inv(TO_RGB)[0]
    seen = 255 * light_of(code_of(one + SHARES[:, None] * (other - one)) @ weight)
    straight = seen[0] + SHARES * (seen[-1] - seen[0])
    order = 1 if seen[-1] > seen[0] else -1
    if not (np.diff(seen[::order]) > 0).all():
        return light
    return np.asarray(light + np.interp(light, seen[::order], (straight - seen)[::order], 0.0, 0.0))


def _codes(light: float, colour: Array) -> Array:
    """Red, green and blue codes, 0 to 1, of that brightness and colour."""
    return np.asarray(TO_RGB @ np.array([float(code_of(np.array(light / 255))), *colour]))
