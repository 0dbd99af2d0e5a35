"""A forecast's fan holds the truth as often as it says, and its valid time is what the members show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import simulated
import udd
from udd.cli import main
from udd.errors import FitError, UddError


@pytest.fixture(scope="module")
def swing() -> tuple[udd.Measurement, np.ndarray]:
    """A pendulum's record of 40 s and its true angle."""
    t = np.arange(0, 40, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.8]).state[:, 1]
    noise = 2e-3 * np.random.default_rng(1).standard_normal(len(t))
    return udd.Measurement(t, {"theta": theta + noise}), theta


@pytest.fixture(scope="module")
def swung(swing: tuple[udd.Measurement, np.ndarray]) -> udd.Fit:
    return udd.fit(swing[0].slice(0, 20), udd.Pendulum(1.0, k0=0.03))


@pytest.fixture(scope="module")
def rolled() -> tuple[udd.Measurement, udd.Forecast]:
    """A disk's record of 30 s and its forecast from 20 s on."""
    measured, _ = simulated.film(udd.Disk(0.042), np.random.default_rng(5), 30.0)
    fitted = udd.fit(measured.slice(0, 20), udd.Disk(0.0415))
    return measured, udd.forecast(measured, fitted, 9.0, start=20.0, members=60)


def test_the_fan_of_a_pendulum_covers_as_often_as_it_says() -> None:
    """If the model is exact and its model error is small, coverage is the nominal one."""
    ahead, inside, z = np.array([0.0, 1.0, 4.0, 18.0]), [], []
    for rng in np.random.default_rng(2).spawn(30):
        truth = udd.Pendulum(rng.uniform(0.5, 1.5), k0=rng.uniform(0.005, 0.03))
        t = np.arange(0, 40, 0.2)
        theta = udd.simulate(truth, t, [0.0, rng.uniform(0.3, 1.2)]).state[:, 1]
        seen = udd.Measurement(t, {"theta": theta + 2e-3 * rng.standard_normal(len(t))})
        fitted = udd.fit(seen.slice(0, 20), udd.Pendulum(1.02 * truth.length, k0=0.02))
        result = udd.forecast(seen, fitted, ahead, start=20.0, members=100, level=0.8)
        true = theta[np.round(result.t / 0.2).astype(int), None]
        inside.append((true >= result.low) & (true <= result.high))
        z.append((true - result.members.mean(axis=0)) / result.members.std(axis=0))
    # 30 records and four times that go together within a record: between 30 and 120 draws with p = 0.8, whose
    # share scatters by 0.037 to 0.073.
    assert 0.62 < np.mean(inside) < 0.95
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.35


@pytest.mark.slow
def test_the_fan_of_a_disk_covers_the_truth() -> None:
    """In a larger experiment of 20 records a band of 0.9 contains 0.81 of the truth, with a standard error of
    0.03: the spread of a chaotic fan is not normal."""
    ahead, inside, z = np.array([0.0, 0.4, 1.0, 2.0, 4.0]), [], []
    for rng in np.random.default_rng(1).spawn(6):
        truth = udd.Disk(rng.uniform(0.03, 0.05))
        t = np.arange(0, 28, 0.04)
        run = udd.simulate(truth, t, simulated.start_between_wheels(truth, 28.0, rng), method="dopri5")
        true = run.state[:, 1:] + [1e-3, -7e-4, 0.0]  # the pivot is not where it was taken to be
        seen = udd.Measurement(t[: len(true)], true + [5e-4, 5e-4, 7e-3] * rng.standard_normal(true.shape))
        fitted = udd.fit(seen.slice(0, 20), udd.Disk(1.02 * truth.W))
        for start in (20.0, 21.0, 22.0, 23.0):
            result = udd.forecast(seen, fitted, ahead, start=start, members=60, level=0.9)
            there = true[np.round(result.t / 0.04).astype(int)]
            inside.append((there >= result.low) & (there <= result.high))
            z.append((there - np.nanmean(result.members, axis=0)) / np.nanstd(result.members, axis=0))
    # 24 forecasts of six records: their share scatters by 0.055.
    assert np.mean(inside) > 0.75
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.15


def test_the_fan_opens_and_the_model_is_let_go_where_asked(
    rolled: tuple[udd.Measurement, udd.Forecast],
) -> None:
    measured, result = rolled
    last = measured.t[measured.seen & (measured.t <= 20.0)][-1]
    assert result.start == pytest.approx(last)
    assert result.t[-1] == pytest.approx(last + 9.0)
    assert result.members.shape == (60, 901, 3)
    width = (result.high - result.low)[:, 1]
    assert width[0] < 1.5e-3  # six times the noise of a frame would say nothing was filtered
    assert np.nanmax(width[-200:]) > 0.03  # chaos has filled the attractor
    # No frame after the start is used.
    cut = udd.forecast(measured.slice(0, 20), result.fit, 9.0, members=60)
    np.testing.assert_array_equal(cut.members, result.members)


def test_the_valid_time_is_that_of_half_the_members(rolled: tuple[udd.Measurement, udd.Forecast]) -> None:
    _, result = rolled
    size = np.hypot(*(result.members - result.median)[:, :, :2].transpose(2, 0, 1))
    parted = np.array([np.argmax(~(row <= 5e-3)) if (~(row <= 5e-3)).any() else 10**9 for row in size])
    k = round(result.valid_time / 0.01)
    # Within a grid step of the median of the members' own times.
    assert np.mean(parted <= k - 1) <= 0.5 <= np.mean(parted <= k + 1)
    assert result.valid_low <= result.valid_time <= result.valid_high
    assert 0.0 < result.measured_valid_time <= 9.0
    looser = udd.forecast(result.measurement, result.fit, 9.0, start=20.0, members=60, error=0.02)
    assert looser.valid_time > result.valid_time


def test_the_lyapunov_time_is_that_of_the_model(rolled: tuple[udd.Measurement, udd.Forecast]) -> None:
    _, result = rolled
    rate = udd.lyapunov(result.fit.model.replace(edge="ignore"))
    assert result.lyapunov_time == pytest.approx(1.0 / rate, rel=0.05)  # 1-2 % error of a short average
    assert result.lyapunov_times == pytest.approx(result.valid_time / result.lyapunov_time)


def test_a_model_is_fitted_first(swing: tuple[udd.Measurement, np.ndarray], swung: udd.Fit) -> None:
    measured, _ = swing
    a = udd.forecast(measured, udd.Pendulum(1.0, k0=0.03), 5.0, start=19.98, members=20)
    b = udd.forecast(measured, swung, 5.0, start=19.98, members=20)
    np.testing.assert_array_equal(a.members, b.members)
    assert a.valid_time == np.inf  # a milliradian does not grow to 50
    assert a.lyapunov_time == np.inf
    assert np.isnan(a.lyapunov_times)


def test_the_seed_decides(swing: tuple[udd.Measurement, np.ndarray], swung: udd.Fit) -> None:
    item, two, other = (udd.forecast(swing[0], swung, 2.0, members=20, rng=s) for s in (3, 3, 4))
    np.testing.assert_array_equal(item.members, two.members)
    assert (item.members != other.members).any()


def test_a_fit_that_does_not_explain_its_data_widens_the_fan(
    swing: tuple[udd.Measurement, np.ndarray], swung: udd.Fit
) -> None:
    plain = udd.forecast(swing[0], replace(swung, chi2=swung.dof), 5.0, members=40)
    worse = udd.forecast(swing[0], replace(swung, chi2=9 * swung.dof), 5.0, members=40)
    spread = [result.members[:, :, 0].std(axis=0) for result in (plain, worse)]
    # Three times the draws, of which the filter of a narrow window corrects a part.
    assert np.median(spread[1] / spread[0]) == pytest.approx(3.0, rel=0.15)


def test_a_gap_before_the_start_is_not_filtered_across(swing: tuple[udd.Measurement, np.ndarray]) -> None:
    measured, _ = swing
    holes = measured.rows((measured.t < 18.0) | (measured.t > 19.6))
    fitted = udd.fit(holes.slice(0, 18), udd.Pendulum(1.0, k0=0.03))
    result = udd.forecast(holes, fitted, 2.0, start=20.5, members=20)
    assert np.abs(result.median[0, 0] - measured["theta"][np.searchsorted(measured.t, result.start)]) < 8e-3
    with pytest.raises(FitError, match="4 consecutive frames"):
        udd.forecast(holes, fitted, 2.0, start=19.8, members=20)


def test_a_joint_fit_forecasts_each_of_its_films() -> None:
    """Two films of one pendulum by cameras with different tilts."""
    t, lean = np.arange(0, 30, 0.05), (0.03, -0.05)
    rng = np.random.default_rng(8)
    true = [udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, a]).state[:, 1] for a in (0.5, 0.9)]
    films = [
        udd.Measurement(t, {"theta": theta + by + 1e-3 * rng.standard_normal(len(t))})
        for theta, by in zip(true, lean, strict=True)
    ]
    joint = udd.fit(films, udd.Pendulum(1.0, k0=0.03))
    for k, film in enumerate(films):
        result = udd.forecast(film, joint, [0.0, 2.0], start=20.0, members=20)
        # The first camera's tilt for the second film would cause an error of 0.08.
        np.testing.assert_allclose(result.median[:, 0], (true[k] + lean[k])[[400, 440]], atol=3e-3)
    cut = films[1].slice(0, 20.01)
    with pytest.raises(FitError, match="pass the number of this one"):
        udd.forecast(cut, joint, 1.0)
    again = udd.forecast(cut, joint, [0.0, 2.0], members=20, film=1)
    np.testing.assert_array_equal(again.members, result.members)
    with pytest.raises(UddError, match="film must be a whole number from 0 to 1"):
        udd.forecast(cut, joint, 1.0, film=2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"measurement": 3}, "a measurement is needed"),
        ({"t": 0.0}, "t must be above 0"),
        ({"t": [1.0, 1.0]}, "increasing from 0"),
        ({"t": float("nan")}, "t must be finite"),
        ({"start": -1.0}, "holds 0 usable frames"),
        ({"start": 41.0}, "start is 41 s, but the record ends at 39.95 s"),
        ({"window": 0.1}, "at least 6"),
        ({"members": 1}, "members must be a whole number"),
        ({"level": 1.0}, "level must be below 1"),
        ({"error": 0.0}, "error must be above 0"),
        ({"model": udd.Disk(0.04)}, "does not explain"),
    ],
)
def test_bad_input_is_named(
    swing: tuple[udd.Measurement, np.ndarray], swung: udd.Fit, change: dict[str, object], message: str
) -> None:
    arguments = {"measurement": swing[0], "model": swung, **change}
    with pytest.raises(UddError, match=message):
        udd.forecast(**arguments)  # type: ignore[arg-type]


def test_the_picture_shows_the_fan(rolled: tuple[udd.Measurement, udd.Forecast]) -> None:
    _, result = rolled
    ax = udd.plot.forecast(result, coordinate="Y")
    assert "Y" in ax.get_ylabel()
    median = next(line for line in ax.lines if line.get_label() == "median")
    np.testing.assert_allclose(median.get_ydata(), 100 * result.median[:, 0])
    with pytest.raises(UddError, match="not theta"):
        udd.plot.forecast(result, coordinate="theta")
    with pytest.raises(UddError, match="a forecast has a fan"):
        udd.plot.forecast(result.fit)
    plt.close("all")


def test_the_command(
    swing: tuple[udd.Measurement, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import json

    file, out, picture = tmp_path / "swing.csv", tmp_path / "ahead.csv", tmp_path / "ahead.png"
    swing[0].to_csv(file)
    argv = ["forecast", str(file), "--pendulum", "1.0", "--start", "20", "--t", "3", "--members", "20"]
    assert main([*argv, "--out", str(out), "--out", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "forecast from T = 20 s for 3 s, 20 members" in said
    assert "valid to 50 mrad until the end of the forecast" in said
    assert out.read_text().splitlines()[0] == "t,theta,theta_low,theta_high"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main([*argv, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["valid_time_s"] is None  # beyond the forecast
    table = np.loadtxt(out, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table[:, 0], data["t"])
    np.testing.assert_array_equal(table[:, 1], data["theta"]["median"])
    assert main([*argv, "--out", str(tmp_path / "ahead.xls")]) == 1
    assert "must end in" in capsys.readouterr().err


@pytest.mark.parametrize("x", ["x", "theta"])  # an angle of one's own is no pendulum of udd's
def test_a_users_own_model_is_run_on_too(x):
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 16.0, 0.02)
    truth = udd.Model([x, "v"], {x: "v", "v": f"-k*{x} - c*v"}, {"k": 9.0, "c": 0.05})
    motion = udd.simulate(truth, t, [1.0, 0.0]).state
    seen = udd.Measurement(t, motion[:, :1] + 0.01 * rng.standard_normal((len(t), 1)), names=(x,))
    result = udd.forecast(seen, truth.with_parameters({"k": 8.8}), start=12.0, t=t[601:] - t[600])
    assert result.names == (x,) and result.lyapunov_time == np.inf and result.valid_time == np.inf
    inside = (result.low[:, 0] <= motion[600:, 0]) & (motion[600:, 0] <= result.high[:, 0])
    # The band is one of 95 %; its errors go together for as long as the forecast lasts.
    assert inside.mean() > 0.7
    assert np.abs(result.median[:, 0] - motion[600:, 0]).max() < 0.02
    assert result.to_dict()[x]["median"].shape == (200,)


def test_a_generator_and_the_name_of_before_give_the_same_fan(
    swing: tuple[udd.Measurement, np.ndarray], swung: udd.Fit
) -> None:
    item = udd.forecast(swing[0], swung, 2.0, members=20, rng=3)
    other = udd.forecast(swing[0], swung, 2.0, members=20, rng=np.random.default_rng(3))
    with pytest.warns(DeprecationWarning, match=r"seed=\.\.\.\) is called rng="):
        before = udd.forecast(swing[0], swung, 2.0, members=20, seed=3)
    np.testing.assert_array_equal(item.members, other.members)
    np.testing.assert_array_equal(item.members, before.members)
    with pytest.raises(udd.errors.ModelError, match="rng must be a whole number, 0 or more"):
        udd.forecast(swing[0], swung, 2.0, members=20, rng=-1)
