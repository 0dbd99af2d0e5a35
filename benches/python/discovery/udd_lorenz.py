"""Lorenz63 by ODR-BINDy's protocol with udd: all 30 terms fitted, then left out by evidence."""

from __future__ import annotations

import numpy as np
from lorenz63 import TERMS

import udd

STATES = "xyz"
SPREAD = 100.0  # the standard deviation of the coefficients' prior in ODR-BINDy's script


def library() -> udd.Model:
    """The ten monomials in each equation, all coefficients zero."""
    names = [[f"{s}{k}" for k in range(len(TERMS))] for s in STATES]
    terms = [term.replace(" ", "*") for term in TERMS]
    rates = [" + ".join(f"{c}*{term}" for c, term in zip(own, terms, strict=True)) for own in names]
    return udd.Model(list(STATES), rates, {name: 0.0 for own in names for name in own})


def prune(t: np.ndarray, noisy: np.ndarray) -> np.ndarray:
    """Coefficients (10, 3); unlike ODR-BINDy it does not get the noise."""
    measured = udd.Measurement(t, dict(zip(STATES, noisy.T, strict=True)))
    try:
        pruned = udd.prune(measured, library(), spread=SPREAD)
    except udd.UddError:
        return np.zeros((len(TERMS), len(STATES)))
    return np.array(list(pruned.model.parameters.values())).reshape(len(STATES), -1).T
