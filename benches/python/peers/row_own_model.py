"""A model of the user's own: Lorenz's of 1963, given to udd as text, one trajectory at rtol 1e-9."""

from __future__ import annotations

from typing import Any

from peers import row_trajectory, udd_rows
from peers.harness import Entry, Row
from peers.problems import LORENZ

BOUND = 1.5e-5  # what DOP853 at rtol 1e-9 leaves at t = 8, where neighbours have parted 1400 times


def entry(setting: str, final: Any) -> Entry:
    """From ``final(start, t)``, the state at t."""
    return row_trajectory.entry(setting, final, flow=LORENZ)


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import dop853, numba_scalar

    return entry(*numba_scalar.final(dop853.lorenz, LORENZ.parameters, rtol, atol))


def heyoka(tol: float = 1e-7) -> Entry:
    from peers import heyoka_peer

    return entry(*heyoka_peer.final(heyoka_peer.lorenz(), list(LORENZ.parameters), tol))


ROW = Row(
    number=8,
    title="a model as text (Lorenz 1963), one trajectory, rtol 1e-9",
    unit="time units/s",
    bound=BOUND,
    error="state at t = 8",
    full=1_000_000,
    smallest=100,
    entries={
        "udd": lambda: entry(*udd_rows.own_model()),
        "heyoka": heyoka,
        "numba": numba,
        "SciPy": lambda: row_trajectory.scipy(LORENZ),
    },
    inspect=row_trajectory.bounded(LORENZ),
)
