"""States of attractors that runs have ended on."""

from __future__ import annotations

from typing import Any

import numpy as np

from udd.errors import ModelError
from udd.models import Model

from .flow_map import Floats

__all__ = ["state_of_attractor"]


def state_of_attractor(model: Model, attractor: Any) -> tuple[Model, Floats, float]:
    """Return the model, a state and the period of a periodic attractor of basins or a diagram."""
    names = model.state_names
    prefix = "orbit_" if f"orbit_{names[0]}" in attractor else ""
    if any(f"{prefix}{name}" not in attractor for name in names) or "period_time" not in attractor:
        raise ModelError(
            f"an attractor of udd.basins or udd.bifurcation of a model of {', '.join(names)} is needed"
        )
    points = [np.asarray(attractor[f"{prefix}{name}"], dtype=np.float64) for name in names]
    if attractor["period_time"].ndim or any(component.ndim != 1 for component in points):
        raise ModelError("one attractor is needed: select it, as in basins.sel(number=1)")
    time, state = float(attractor["period_time"]), np.array([component[0] for component in points])
    if not np.isfinite(time) or time <= 0.0 or not np.isfinite(state).all():
        raise ModelError("this attractor is not periodic")
    parameter = str(attractor.attrs.get("parameter", ""))
    if not prefix and parameter in model.parameters and parameter in attractor.coords:
        model = model.with_parameters({parameter: float(attractor[parameter])})
    return model, state, time
