"""A bifurcation diagram: 200 + 200 points of z = 0, z' > 0 at 1000 drives, rtol 1e-9, two threads.

The first 200 points of a drive are the transient: they are counted, and only the others are found and kept.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from peers import problems, row_section, udd_rows
from peers.harness import Entry, Row
from peers.row_sweep import drives

TRANSIENT, KEPT = 200, 200
COUNT = 1000


def inspect(answer: Any) -> str:
    w, points = np.asarray(answer[0]), np.asarray(answer[1])
    off = np.abs(points[..., 2]).max()
    if not off <= 1e-12:
        return f"points up to {off:.1g} off the section"
    if (points[..., 0] * points[..., 1] >= w[:, None]).any():
        return "points that cross downwards"
    # Above w = 8 a cycle with two points, symmetric to each other: omega and -omega.
    cycle = np.abs(points[w > 8.5][:, -20:, 0])
    if len(cycle) and np.ptp(cycle, axis=1).max() > 1e-3:
        return "points scatter where the attractor is a cycle"
    return ""


def entry(setting: str, run: Any, note: str = "", least: int = 0) -> Entry:
    """From ``run(w, starts, transient, kept)``: points, shape (len(w), kept, 3)."""

    def work(n: int) -> tuple[float, Any]:
        w = drives(n)
        return n * (TRANSIENT + KEPT), (w, run(w, np.tile(problems.START, (n, 1)), TRANSIENT, KEPT))

    def probe() -> float:
        starts, n = problems.probe_starts(), problems.SECTION_POINTS
        return problems.point_error(run(np.ones(len(starts)), starts, n - 1, 1)[:, 0])

    return Entry(setting, work, probe, note, least)


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from numba import njit, prange

    from peers import dop853
    from peers import numba_scalar as own

    one = own.crossings_of(dop853.dle, 3, 1, 3, level=2)

    @njit(parallel=True, **own.FAST)
    def run(w: Any, starts: Any, transient: int, kept: int, rtol: float, atol: float) -> Any:
        points = np.empty((len(w), kept, 3))
        for i in prange(len(w)):
            one((starts[i, 0], starts[i, 1], starts[i, 2]), (w[i],), transient, points[i], rtol, atol)
        return points

    run(np.ones(2), np.ones((2, 3)), 1, 1, rtol, atol)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", lambda *given: run(*given, rtol, atol))


def lanes(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from numba import njit

    from peers import dop853, numba_lanes
    from peers import numba_scalar as scalar

    own = numba_lanes.layout(dop853.dle, 3, 1, 3, level=2)
    begin, dense = numba_lanes.starter(dop853.dle, 3, 1), scalar.dense_of(dop853.dle, 3, 1)
    interpolated, crossing, load = scalar.interpolated, scalar.crossing, own.load
    step, size, width = own.step, own.size, numba_lanes.LANES
    T, STOP, H, MOST, CROSSED = own.t, own.end, own.h, own.most, own.crossed

    @njit(**scalar.FAST)
    def share(w: Any, starts: Any, first: int, transient: int, points: Any, rtol: float, atol: float) -> None:
        s = np.zeros(size)
        owner, have = np.full(width, -1), np.zeros(width, np.int64)
        kept = points.shape[1]
        upcoming, live, hits = first, width, 1.0
        while live > 0:
            if hits > 0.0:
                for lane in range(width):
                    if owner[lane] == -2 or (owner[lane] >= 0 and s[CROSSED + lane] == 0.0):
                        continue
                    if owner[lane] >= 0:
                        if have[lane] >= 0:
                            f = dense(*load(s, lane))
                            x = crossing(f[2], 0.0)
                            for c in range(3):
                                points[owner[lane], have[lane], c] = interpolated(f[c], x)
                        have[lane] += 1
                        if have[lane] < kept:
                            continue
                    if upcoming < len(w):
                        i = upcoming
                        owner[lane], have[lane] = i, -transient
                        begin(s, lane, (starts[i, 0], starts[i, 1], starts[i, 2]), (w[i],))
                        s[T + lane], s[STOP + lane], s[H + lane], s[MOST + lane] = 0.0, 1e300, 0.05, 5.0
                        upcoming += 2
                    else:
                        s[STOP + lane] = 0.0
                        s[T + lane] = 0.0
                        owner[lane] = -2
                        live -= 1
            hits = step(s, rtol, atol)

    def run(w: Any, starts: Any, transient: int, kept: int) -> Any:
        points = np.empty((len(w), kept, 3))
        with ThreadPoolExecutor(2) as pool:
            work = (transient, points, rtol, atol)
            for done in [pool.submit(share, w, starts, i, *work) for i in range(2)]:
                done.result()
        return points

    run(np.ones(2), np.ones((2, 3)), 1, 1)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", run, least=COUNT)


def heyoka(tol: float = 1e-7, width: int = 8) -> Entry:
    import heyoka as hy

    from peers import heyoka_peer

    class Worker:
        """An integrator of a batch and the points its event finds."""

        def __init__(self) -> None:
            equations = heyoka_peer.dle()
            section = hy.nt_event_batch(equations[2][0], self.record, direction=hy.event_direction.positive)
            self.ta = heyoka_peer.batch(equations, 3, 1, width, tol, nt_events=[section])
            self.have = [0] * width
            self.points: Any = None

        def __deepcopy__(self, memory: Any) -> Worker:
            return self

        def record(self, ta: Any, t: float, sign: int, lane: int) -> None:
            i = self.have[lane]
            if 0 <= i < self.points.shape[1]:
                ta.update_d_output(np.full(width, t))
                self.points[lane, i] = ta.d_output[:, lane]
            self.have[lane] = i + 1

        def run(self, w: Any, starts: Any, transient: int, points: Any) -> None:
            n, kept = len(w), points.shape[1]
            self.points = np.empty((width, kept, 3))
            self.have = [-transient] * width
            self.ta.pars[0, :n] = w
            self.ta.pars[0, n:] = w[-1]
            self.ta.state[:, :n] = starts.T
            self.ta.state[:, n:] = starts[-1][:, None]
            while min(self.have) < kept:
                # The clock is set back often: its rounding would put points off the section.
                self.ta.set_time(0.0)
                self.ta.propagate_until(min(100.0, 5.0 * (kept - min(self.have))))
            points[:] = self.points[:n]

    pair = [Worker(), Worker()]

    def run(w: Any, starts: Any, transient: int, kept: int) -> Any:
        points = np.empty((len(w), kept, 3))

        def share(first: int) -> None:
            for at in range(first * width, len(w), 2 * width):
                part = slice(at, at + width)
                pair[first].run(w[part], starts[part], transient, points[part])

        with ThreadPoolExecutor(2) as pool:
            list(pool.map(share, range(2)))
        return points

    return entry(f"Taylor, nt_event_batch, tol {tol:g}", run, least=64)


def per_drive(setting: str, points: Any, note: str) -> Entry:
    """From ``points(start, n, w)``, one drive after the other."""

    def run(w: Any, starts: Any, transient: int, kept: int) -> Any:
        results = [
            points(start, transient + kept, float(a))[transient:] for a, start in zip(w, starts, strict=True)
        ]
        return np.array(results)

    return entry(setting, run, note)


def pynamicalsys(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import pynamicalsys_peer

    points = pynamicalsys_peer.points(rtol, atol)
    return per_drive(f"rk45, rtol {rtol:g}", points, "one thread")


def pydiffsol(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import pydiffsol_peer

    return per_drive(f"tsit45, stop, rtol {rtol:g}", pydiffsol_peer.points(rtol, atol), "one thread")


def diffrax(rtol: float = 8e-10, atol: float = 8e-13) -> Entry:
    from peers import diffrax_peer

    return per_drive(f"Dopri8, Event, rtol {rtol:g}", diffrax_peer.points(rtol, atol), "one thread")


def scipy(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    points = row_section.scipy_points(rtol, atol)
    return per_drive(f"DOP853, events, rtol {rtol:g}", points, "one thread")


ROW = Row(
    number=6,
    title="bifurcation diagram, 1000 drives x (200 + 200) points, rtol 1e-9, two threads",
    unit="points/s",
    path="sections",
    threads=2,
    bound=1.2e-7,
    error="5th point",
    full=COUNT,
    smallest=1,
    entries={
        "udd": lambda: entry(*udd_rows.bifurcation()),
        "lanes": lanes,
        "numba": numba,
        "heyoka": heyoka,
        "JiTCODE": row_section.jitcode,
        "diffrax": diffrax,
        "pydiffsol": pydiffsol,
        "pynamicalsys": pynamicalsys,
        "SciPy": scipy,
    },
    inspect=inspect,
)
