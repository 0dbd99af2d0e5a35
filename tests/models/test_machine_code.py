"""Machine code gives the bits of the interpreter."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from random_laws import computed, machine_code, outcome, random_model


@pytest.mark.parametrize("states", [1, 2, 3, 5, 12])
def test_random_models_have_the_same_bits(states: int) -> None:
    rng = np.random.default_rng(states)
    model = random_model(rng, states)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, work in computed(model, rng).items():
            if name == "fit" and states > 3:
                continue
            with machine_code("never"):
                expected = outcome(work)
            with machine_code("always"):
                assert outcome(work) == expected, f"{name} of {model.equations}"
