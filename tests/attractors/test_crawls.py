"""Slow passages and basins around other origins."""

from __future__ import annotations

import numpy as np
import pytest

import udd

pytest.importorskip("xarray", reason="basins need the extra 'scale'")

XY = ["x", "y"]


def kinds(result: object) -> list[str]:
    names = result["kind"].attrs["flag_meanings"].split()  # type: ignore[index]
    return [names[k] for k in result["kind"].to_numpy().tolist()]  # type: ignore[index]


def test_a_crawl_past_a_saddle_is_no_attractor() -> None:
    # On the circle r = 1 the phase obeys q' = 1.0001 + cos(q) with no rest; but at (0, 0) there is a focus
    # that repels at the rate 1e-4.
    radius = "1e-4*(1 - x^2 - y^2)"
    model = udd.Model(XY, [f"{radius}*x - y", f"{radius}*y + x"])
    basins = udd.basins(model, {"x": [1e-7, 1e-6, 0.9]}, state0=[0.0, 0.0], n=24)
    assert "equilibrium" not in kinds(basins)


def test_a_saddle_on_the_way_is_followed_to_the_cycle() -> None:
    # x leaves the saddle (0, 1) at the rate 1e-3 a long time after the start; then it comes to the cycle.
    model = udd.Model(
        ["x", "y", "z"],
        ["0.02*x*(1 - x)", "-z + y*(x - 0.5)*4 - y*(y^2 + z^2)", "y + z*(x - 0.5)*4 - z*(y^2 + z^2)"],
    )
    basins = udd.basins(model, {"x": [1e-10, 1e-6]}, state0=[0.0, 0.1, 0.1], section="y", n=24, transient=24)
    assert kinds(basins) == ["periodic"]
    assert basins["fraction"].to_numpy().tolist() == [1.0]


def test_a_start_on_a_saddle_has_no_attractor() -> None:
    model = udd.Model(["x", "v"], ["v", "x - x^3 - 0.2*v"])
    basins = udd.basins(model, {"x": [-1.0, 0.0, 1.0]}, state0=[0.0, 0.0], n=12, transient=12)
    assert kinds(basins) == ["equilibrium"] * 2
    assert basins["attractor"].to_numpy().tolist() == [1, 0, 2]


@pytest.mark.parametrize(("origin", "size"), [(0.0, 1.0), (1e4, 1.0), (0.0, 1e-4), (50.0, 1e3)])
def test_basins_do_not_depend_on_origin_and_units(origin: float, size: float) -> None:
    x = f"((x - {origin!r})/{size!r})"
    model = udd.Model(["x", "v"], ["v", f"{size!r}*({x} - {x}^3) - 0.2*v"])
    grid = {"x": origin + size * np.array([-1.3, -0.7, 0.6, 1.4])}
    basins = udd.basins(model, grid, state0=[0.0, 0.0], n=12, transient=12)
    assert kinds(basins) == ["equilibrium"] * 2
    wells = (basins["orbit_x"].to_numpy().ravel() - origin) / size
    np.testing.assert_allclose(sorted(wells), [-1.0, 1.0], atol=1e-3)
