"""Quantities of udd that the benchmark uses: assumptions of a fit, number of candidates, threshold."""

from __future__ import annotations

import numpy as np
from information import DEVICE, Assumed
from scipy.stats import chi2

import udd
from udd.discovery.discover import TRAIN
from udd.discovery.scoring.candidates import library, ripples
from udd.discovery.thresholds import ALPHA
from udd.fitting.problem import levels

__all__ = ["TRAIN", "assumed", "threshold"]


def assumed(model: udd.Disk) -> Assumed:
    """Return the smallest model error of a search."""
    fit, sensor = model.profile.fit, model.profile.sensor
    device = {name: fit.priors[name] * model.parameters[name] for name in DEVICE}
    level = levels(model.kind)[: fit.searched][-1]
    return Assumed(level, {**device, "clock": sensor.clock}, dict(sensor.camera))


def threshold(model: udd.Disk, t: np.ndarray, amplitudes: int) -> float:
    """The fall of chi2 from which an effect is accepted."""
    looks = len(library(model)) + len(ripples(model, t))
    return float(chi2.isf(ALPHA / looks, amplitudes))
