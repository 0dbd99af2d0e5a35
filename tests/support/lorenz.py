"""Lorenz 1963 as a model of the user's own."""

from __future__ import annotations

import udd


def lorenz(**parameters: float) -> udd.Model:
    return udd.Model(
        ["x", "y", "z"],
        {"x": "sigma*(y - x)", "y": "x*(rho - z) - y", "z": "x*y - beta*z"},
        {"sigma": 10.0, "rho": 28.0, "beta": 8.0 / 3.0, **parameters},
    )
