"""Common parts of the models that are compiled into the core."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from .base import Model
from .profile import Floats


class CompiledModel(Model):
    """A model whose law is compiled into the core."""

    def __new__(cls, *_arguments: Any, **_options: Any) -> Self:
        """Create an uninitialised instance, which a copy or a pickle fills itself."""
        return object.__new__(cls)


def beyond_the_edge(model: Model) -> Model:
    """Return the equations alone: a disk without an edge, or any other model as it is."""
    return model.replace(edge="ignore") if "edge" in model._options else model


def plain_friction(model: Model, inertia: float, omega: Floats) -> Floats:
    """Compute ``k Omega^2`` of the plain law, from its rates without torque by gravity or drive."""
    plain = model.with_effects(())
    state = np.zeros((len(omega), len(plain.state_names)))
    state[:, 0] = omega
    result: Floats = -inertia * omega * plain.rates(0.0, state)[:, 0]
    return result
