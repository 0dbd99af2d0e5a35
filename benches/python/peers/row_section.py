"""100,000 points of the section z = 0, z' > 0 at w = 1, each on it to 1e-12, rtol 1e-9, one thread."""

from __future__ import annotations

from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Missing, Row

COUNT = 100_000


def inspect(answer: Any) -> str:
    points = np.asarray(answer)
    off = np.abs(points[:, 2]).max()
    if not off <= 1e-12:
        return f"points up to {off:.1g} off the section"
    # z' = 1 - omega y > 0.
    wrong = int((points[:, 0] * points[:, 1] >= 1.0).sum())
    return f"{wrong} points cross downwards" if wrong else ""


def entry(setting: str, points: Any, note: str = "") -> Entry:
    """From ``points(start, n)``, the first n points, shape (n, 3)."""

    def work(n: int) -> tuple[float, Any]:
        return n, points(np.array(problems.START), n)

    def probe() -> float:
        n = problems.SECTION_POINTS
        return problems.point_error(np.array([points(start, n)[n - 1] for start in problems.probe_starts()]))

    return Entry(setting, work, probe, note)


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import dop853, numba_scalar

    cross = numba_scalar.crossings_of(dop853.dle, 3, 1, 3, level=2)

    def points(start: Any, n: int) -> Any:
        result = np.empty((n, 3))
        cross((start[0], start[1], start[2]), (1.0,), 0, result, rtol, atol)
        return result

    points((1.0, 1.0, 0.01), 2)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", points)


def heyoka(tol: float = 1e-7) -> Entry:
    import heyoka as hy

    from peers import heyoka_peer

    equations = heyoka_peer.dle()
    results: list[Any] = []

    def record(ta: Any, t: float, sign: int) -> None:
        ta.update_d_output(t)
        results.append(ta.d_output.copy())

    section = hy.nt_event(equations[2][0], record, direction=hy.event_direction.positive)
    ta = heyoka_peer.single(equations, 3, [1.0], tol, nt_events=[section])

    def points(start: Any, n: int) -> Any:
        results.clear()
        ta.state[:] = start
        # The clock is set back often: at t = 10^5 its rounding alone would put a point 1e-11 off.
        while len(results) < n:
            ta.time = 0.0
            ta.propagate_until(min(1000.0, 4.5 * (n - len(results)) + 5.0))
        return np.array(results[:n])

    return entry(f"Taylor, nt_event, tol {tol:g}", points)


def scipy_points(rtol: float, atol: float) -> Any:
    """``points(start, n, w=1)`` with SciPy's events."""
    from scipy.integrate import solve_ivp

    def height(t: float, y: Any, w: float) -> float:
        return float(y[2])

    height.direction = 1.0  # type: ignore[attr-defined]

    def points(start: Any, n: int, w: float = 1.0) -> Any:
        results: list[Any] = []
        options = {"method": "DOP853", "rtol": rtol, "atol": atol, "events": height, "args": (w,)}
        while len(results) < n:
            height.terminal = min(100, n - len(results))  # type: ignore[attr-defined]
            run = solve_ivp(problems.dle, (0.0, 1e9), start, **options)
            results += list(run.y_events[0])
            start = run.y[:, -1]
            start[2] = 1e-300  # past the section, not to be found again
        return np.array(results)

    return points


def scipy(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    return entry(f"DOP853, events, rtol {rtol:g}", scipy_points(rtol, atol))


def jitcode() -> Entry:
    raise Missing("JiTCODE finds no events")


def diffrax(rtol: float = 8e-10, atol: float = 8e-13) -> Entry:
    from peers import diffrax_peer

    return entry(f"Dopri8, Event, rtol {rtol:g}", diffrax_peer.points(rtol, atol))


def pydiffsol(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import pydiffsol_peer

    return entry(f"tsit45, stop, rtol {rtol:g}", pydiffsol_peer.points(rtol, atol))


def pynamicalsys(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import pynamicalsys_peer

    return entry(f"rk45, rtol {rtol:g}", pynamicalsys_peer.points(rtol, atol))


ROW = Row(
    number=5,
    title="section points at w = 1 to 1e-12, rtol 1e-9, one thread",
    unit="points/s",
    path="section",
    bound=1.2e-7,
    error="5th point",
    full=COUNT,
    smallest=20,
    entries={
        "udd": lambda: entry(*udd_rows.section()),
        "numba": numba,
        "heyoka": heyoka,
        "JiTCODE": jitcode,
        "diffrax": diffrax,
        "pydiffsol": pydiffsol,
        "pynamicalsys": pynamicalsys,
        "SciPy": scipy,
    },
    inspect=inspect,
)
