"""The argument `rng` (SPEC 7)."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from udd.errors import ModelError

#: The seed of a random generator, or a generator; None takes fresh entropy.
Rng: TypeAlias = int | np.random.Generator | None


def generator(rng: Rng) -> np.random.Generator:
    """Return the generator of `rng`.

    Raises
    ------
    ModelError
        No generator can be made of it.
    """
    try:
        if isinstance(rng, bool):
            raise TypeError
        return np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise ModelError(
            f"rng must be a whole number, 0 or more, a numpy.random.Generator or None, not {rng!r:.80}"
        ) from None
