"""The kind of motion on each attractor of a diagram."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.chaos.recurrence import APERIODIC
from udd.models.state_scaling import Floats
from udd.simulation.batch import Batch
from udd.simulation.outcomes import FINISHED, OUTCOMES

from .classification import Classification, MotionClassifier, decided
from .section_runs import Crossings, SectionRunner

__all__ = ["MOTIONS", "kinds_of"]

MOTIONS = ("none", "equilibrium", "rotating state", "cycle", "torus", "chaos", "aperiodic", "left")
"""``none`` has no verdict; of what is ``aperiodic`` the exponents leave open what it is; ``left`` is off the
wheels, or at infinity."""

_LEFT = [OUTCOMES.index("ejected"), OUTCOMES.index("escaped")]
_PARTS = 20.0  # A distance that grows by exp of this shows chaos.
_STAYS = 3.0  # A distance that changes by less than exp of this does not change.
_SPANS = (0.4, 4.0)  # Shares of the time of the section points. The first is enough for most chaos.
_TURNS = 1e-6  # Typical sizes per typical time. A slower state does not rotate.


def kinds_of(
    runner: SectionRunner,
    judge: MotionClassifier,
    crossings: Crossings,
    verdicts: Classification,
    rows: Floats,
    values: Floats,
) -> NDArray[np.int8]:
    """Return the place in `MOTIONS` of each job.

    A motion that does not come back is chaos if neighbouring orbits diverge. It is a torus if two directions
    neither grow nor shrink. It is a cycle, of more rounds than can be counted, if a single direction does so.
    """
    kind = np.zeros(len(values), dtype=np.int8)
    is_decided = decided(crossings, verdicts)
    kind[np.isin(crossings.outcome, _LEFT)] = MOTIONS.index("left")
    kind[is_decided & (verdicts.period > 0)] = MOTIONS.index("cycle")
    kind[is_decided & (verdicts.period == APERIODIC)] = MOTIONS.index("aperiodic")
    rest = np.flatnonzero(is_decided & verdicts.rest)
    for job in rest.tolist():
        state = judge.attractor(crossings, verdicts, job).states[0]
        turns = _turns(judge, state, float(values[job]))
        kind[job] = MOTIONS.index("rotating state" if turns else "equilibrium")
    free = int((~np.isfinite(judge.coordinates.size)).sum())
    for share in _SPANS:
        open_ = np.flatnonzero(kind == MOTIONS.index("aperiodic"))
        if not len(open_):
            break
        time = share * float(np.nanmedian(np.ptp(crossings.t[open_], axis=1)))
        values, starts = np.ascontiguousarray(rows[open_]), np.ascontiguousarray(crossings.end[open_])
        limits = runner.rtol, runner.atol, runner.threads, None, runner.max_step
        batch = Batch(runner.model, values, starts, *limits)
        got = _core.lyapunov(batch, True, time, 0.0, 1e-300)
        growth = got["value"] * got["time"][:, None]
        done = got["outcome"] == FINISHED
        chaos = done & (growth.max(axis=1) > _PARTS)
        kind[open_[chaos]] = MOTIONS.index("chaos")
        if share == _SPANS[-1]:
            # Angles that nothing depends on neither grow nor shrink on any motion.
            stay = (np.abs(growth) < _STAYS).sum(axis=1) - free
            still = done & (growth.max(axis=1) < _STAYS)
            kind[open_[still & (stay >= 2)]] = MOTIONS.index("torus")
            kind[open_[still & (stay == 1)]] = MOTIONS.index("cycle")
    return kind


def _turns(judge: MotionClassifier, state: Floats, value: float) -> bool:
    """Return True if a state at rest is a rotation."""
    model, coordinates = judge.at(value), judge.coordinates
    rotation = model.profile.dynamics.rotation
    if rotation is not None:
        k = model.state_names.index(rotation)
        turning = abs(float(state[k])) / float(coordinates.size[k])
    else:
        free = ~np.isfinite(coordinates.size)
        rates = model.rates(0.0, state)[free] * coordinates.clock
        turning = float(np.abs(rates).max(initial=0.0))
    return turning > _TURNS
