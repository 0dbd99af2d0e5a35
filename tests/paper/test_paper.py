"""The paper's figures and claims, as `udd paper` makes them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from udd.cli import main
from udd.paper import CLAIMS, FIGURES, device, films, page
from udd.paper.falls import falls
from udd.paper.figures.clock import C, D, periods
from udd.paper.figures.heights import limit
from udd.paper.figures.overturning import growth
from udd.paper.savgol import smoothed
from udd.paper.shared_films import Lab

# Verdicts on the claims. Those that do not hold are known from elsewhere too: the friction law has no
# threshold, the disk is chaotic at 5.5 cm/s, the Hopf bifurcation is subcritical, a damped pendulum locks.
HOLD = """limits angular-momentum scales zero-drive-swings slow-ascent higher-deeper ejection dle-3.9
coexistence lorenz-limit waterwheel unforced-pendulum steady-torque diffusive-state unstable-rotation
unstable-rotation-disk rotation-approximation damping-stabilises driven-by-nothing-periodic
slow-and-fast isochrony overturning-height"""
WITH_A_REMARK = """converted-drives constant-inertia friction-law slow-chaos torque-shape chaos-3.9 order-7.1
dle-4.5 dle-7.1 bistable clock-period clock-robust successive-heights spin-down
falls-to-either-side no-detuning like-a-swing falls-filmed drive-range"""
FAIL = "static-friction order-5.5 stable-below not-from-rest forced-pendulum theta-plateaus"
VERDICTS = {
    key: verdict
    for verdict, keys in (("holds", HOLD), ("holds with a remark", WITH_A_REMARK), ("does not hold", FAIL))
    for key in keys.split()
}


def nowhere(_text: str) -> None:
    pass


def test_every_claim_has_an_expected_verdict() -> None:
    assert set(VERDICTS) == set(CLAIMS)


@pytest.mark.parametrize("key", [key for key, item in CLAIMS.items() if not item.filmed])
def test_claim(key: str, tmp_path: Path) -> None:
    result = CLAIMS[key].check(Lab(tmp_path, nowhere))
    assert result.verdict == VERDICTS[key], result.evidence
    assert "nan" not in result.evidence
    assert bool(result.remark) == (result.verdict != "holds")


@pytest.mark.parametrize("key", [key for key, entry in FIGURES.items() if not entry.filmed])
def test_figure(key: str, tmp_path: Path) -> None:
    made = FIGURES[key].draw(Lab(tmp_path, nowhere))
    for ax in made.axes:
        assert ax.get_xlabel() or ax.get_ylabel()
        assert ax.has_data()


def test_the_rotating_state_is_at_rest_but_for_its_turning() -> None:
    omega, y, z = device.rotating(0.088, -1)
    np.testing.assert_allclose(
        device.disk(0.088).rates(0.0, [omega, y, z, 0.0]), [0, 0, 0, omega], atol=1e-12
    )


def test_the_figure_eights_period_follows_the_law_of_large_drives() -> None:
    w = np.array([30.0, 100.0, 1000.0])
    # The next term falls as 1/w^2: 1e-4 at w = 30.
    np.testing.assert_allclose(periods(w) * np.sqrt(w), C + D / w, atol=2e-4)
    assert periods(np.array([10.0]))[0] == pytest.approx(3.35832224912, abs=1e-9)


def test_the_limit_map_has_the_fixed_point_that_is_said() -> None:
    # 6 (2 h) = (1 + 4 h)^(3/2), squared.
    fixed = np.roots([64, -96, 12, 1]).max()
    assert limit(np.array([fixed]))[0] == pytest.approx(fixed, abs=1e-12)
    assert f"{fixed:.3f}" in FIGURES["heights"].caption


def test_smoothing_gives_a_smooth_run_back() -> None:
    run = udd.simulate(udd.Disk(0.014), np.arange(0, 10, 0.04), device.SLOW_START)
    motion = smoothed(udd.Measurement(run.t, run.state[:, 1:]), udd.Disk(0.014))
    # At 25 frames per second the fastest swings turn by half a radian from frame to frame.
    assert np.abs(motion.state[::5, 0] - run.Omega).max() < 0.05 * np.abs(run.Omega).max()
    inertia = 0.08**2 / 2 + run.Y**2 + run.Z**2
    J = inertia * run.Omega - 0.014 * run.Y
    assert np.abs(motion.J[::5] - J).max() < 0.05 * np.abs(J).max()


def test_every_filmed_start_stays_between_the_wheels() -> None:
    for recipe in films.RECIPES.values():
        assert udd.simulate(udd.Disk(recipe.W), recipe.duration, recipe.start).outcome == "finished"


def test_a_film_is_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def make(recipe: films.Recipe, _name: str, film: Path, table: Path, _tell: Any) -> None:
        made.append(recipe)
        film.write_bytes(b"film")
        run = udd.simulate(udd.Disk(0.0), np.arange(0, 1, 0.04), recipe.start)
        udd.Measurement(run.t, run.state[:, 1:], meta={"R": 0.08}).to_csv(table)

    monkeypatch.setattr(films, "_make", make)
    first, again = (films.measured("0.0", tmp_path, nowhere) for _ in range(2))
    assert len(made) == 1
    np.testing.assert_array_equal(first.values, again.values)
    # Another recipe is another film.
    monkeypatch.setitem(films.RECIPES, "0.0", films.Recipe(0.0, device.ZERO_START, 3.0, 9))
    films.measured("0.0", tmp_path, nowhere)
    assert len(made) == 2


def test_the_command_writes_a_page_that_stands_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--out", str(tmp_path), "--only", "eigenvalues", "--only", "stable-below", "--json"]
    assert main(["paper", *arguments]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["claims"][0]["verdict"] == "does not hold"
    page = Path(reported["page"]).read_text()
    assert "data:image/png;base64," in page
    assert "does not hold" in page
    assert not any(word in page for word in ("http://", "https://", "<script", 'src="/'))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["eigenvalues.png", "index.html"]


def test_what_needs_films_is_listed_where_there_are_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for entries, kept in ((FIGURES, {"geometry", "slow-polar"}), (CLAIMS, {"scales", "falls-filmed"})):
        for key in [key for key in entries if key not in kept]:
            monkeypatch.delitem(entries, key)
    assert main(["paper", "--out", str(tmp_path), "--no-films", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["left_out"] == ["slow-polar", "falls-filmed"]
    assert [item["key"] for item in reported["figures"]] == ["geometry"]
    text = Path(reported["page"]).read_text()
    assert "Small drive: polar coordinates (Figure 7)" in text
    assert "data:image/svg+xml;base64," in text


def test_drawings_are_the_same_bytes_every_time() -> None:
    first, again = (page.svg(FIGURES["geometry"].draw(Lab(Path(), nowhere))) for _ in range(2))
    assert first == again


def test_falls_of_a_made_up_motion() -> None:
    t = np.linspace(0, 40, 40001)
    # Hanging, up on the right, down on the left; then up on the left and down there: one whole turn back.
    theta = np.interp(t, [0, 5, 10, 20, 30, 40], np.pi * np.array([1, 1, 0, -1, -0.05, -1.0]))
    result = falls(t, np.sin(theta), np.cos(theta))
    assert result.rose.tolist() == [1, -1]
    assert result.side.tolist() == [-1, -1]
    assert result.turns.tolist() == [-1, 0]
    assert result.lengths.tolist() == [2]
    # Resting to 5 s, then 0.3 rad at each speed about hanging: 0.3/(pi/5) + 2 of 0.3/(0.1 pi), 0.3/(0.095 pi)
    # beside the turning points.
    close = 5 + 0.3 / (np.pi / 5) + 0.3 / (np.pi / 10) + 2 * 0.3 / (0.095 * np.pi)
    assert result.plateau == pytest.approx(close / 40, abs=1e-3)
    assert result.rising == pytest.approx((5 + 10) / 40, abs=1e-3)


def test_the_offsets_growth_is_the_integral_of_its_rate() -> None:
    from scipy.integrate import quad

    for height in (0.3, 1.4):
        whole = quad(lambda z: (np.sqrt(1 + 4 * z) - 1) / 2, 0, height)[0]
        assert growth(np.array(height)) == pytest.approx(whole, rel=1e-12)


def test_bad_keys_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "x")
    assert main(["paper", "--out", out, "--only", "nothing"]) == 1
    assert "no figure or claim is called 'nothing'" in capsys.readouterr().err
    assert main(["paper", "--out", out, "--only", "friction", "--no-films"]) == 1
    assert "friction needs a film" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
