"""Measurement files: exact round trips, rough real files, and one clear sentence for bad ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from udd.measurement import Measurement, MeasurementError, read_measurement

REAL = Path(__file__).parents[3] / "shared" / "data" / "real"
N = 40


def disk(n: int = N) -> Measurement:
    rng = np.random.default_rng(1)
    t = np.arange(n) / 25 + 1e-3 * rng.random(n)
    values = rng.normal(size=(n, 3)) * [0.04, 0.04, 30.0]
    values[7] = np.nan
    flag = np.array([""] * n, dtype="<U40")
    flag[7], flag[9] = 'lost: one mark, said "red"', "dup"
    return Measurement(
        t,
        values,
        sigma=np.exp(rng.normal(size=(n, 3))) * 1e-4,
        rho=rng.uniform(-0.9, 0.9, size=(n, 3)),
        flag=flag,
        meta={
            "R": 0.08,
            "W": 0.1 + 0.2,
            "source": "a film.mp4",
            "frames": 40,
            "pivot": [1.5, 2.0],
            "id": "25",
            "e": "",
        },
    )


def same(a: Measurement, b: Measurement) -> None:
    assert a.names == b.names and dict(a.meta) == dict(b.meta)
    assert np.array_equal(a.t, b.t) and np.array_equal(a.values, b.values, equal_nan=True)
    for x, y in ((a.sigma, b.sigma), (a.rho, b.rho)):
        assert (x is None) == (y is None)
        assert x is None or y is None or np.array_equal(x, y, equal_nan=True)
    assert a.flag.tolist() == b.flag.tolist()


def test_csv_round_trip_keeps_every_bit(tmp_path: Path) -> None:
    m = disk()
    m.to_csv(tmp_path / "m.csv")
    same(m, read_measurement(tmp_path / "m.csv"))
    assert [p.name for p in tmp_path.iterdir()] == ["m.csv"]


def test_parquet_round_trip_keeps_every_bit(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    m = disk()
    m.to_parquet(tmp_path / "m.parquet")
    same(m, read_measurement(tmp_path / "m.parquet"))


def test_fast_rotation_across_a_gap_is_not_rewrapped(tmp_path: Path) -> None:
    t = np.arange(30.0)
    m = Measurement(t, np.column_stack([t * 0, t * 0, 5.0 * t]))  # 5 rad per row, more than half a turn
    m.to_csv(tmp_path / "m.csv")
    assert np.array_equal(read_measurement(tmp_path / "m.csv")["beta"], m["beta"])


def test_wrapped_angles_are_unwrapped(tmp_path: Path) -> None:
    t = np.arange(100) / 25
    beta = 9.0 * t
    wrapped = np.angle(np.exp(1j * beta))
    rows = "\n".join(f"{a!r},0,0,{b!r}" for a, b in zip(t.tolist(), wrapped.tolist(), strict=True))
    (tmp_path / "m.csv").write_text("t,Y,Z,beta\n" + rows + "\n")
    # adding whole turns rounds in the last bits of numbers up to 36
    assert np.allclose(read_measurement(tmp_path / "m.csv")["beta"], beta, rtol=0, atol=1e-13)


def test_covariance_has_the_given_sigmas_and_correlations() -> None:
    m = disk()
    assert m.sigma is not None and m.rho is not None
    c = m.covariance()
    assert np.allclose(np.sqrt(np.einsum("nii->ni", c)), m.sigma, rtol=1e-15)
    assert np.allclose(c[:, 0, 2], m.rho[:, 1] * m.sigma[:, 0] * m.sigma[:, 2], rtol=1e-15)


def test_a_slice_may_be_empty() -> None:
    nothing = disk().slice(1e3, 2e3)
    assert len(nothing) == 0 and nothing.rho is not None and nothing.rho.shape == (0, 3)


THREE = {"theta": [1.0, 2.0, 3.0]}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((range(3), 0.3), "values must be a column or a table (n, m), not of shape ()"),
        (
            (range(3), np.zeros((3, 2, 2))),
            "values must be a column or a table (n, m), not of shape (3, 2, 2)",
        ),
        ((["2024-01-01"] * 3, THREE), "t must be numbers"),
        ((range(3), {"theta": ["a", "b", "c"]}), "theta must be numbers"),
        ((range(3), {"a": [1, 2], "b": [1, 2, 3]}), "columns of one length, not of shapes a (2,), b (3,)"),
        ((range(3), THREE, 0.1), "sigma must be a column or a table (n, m), not of shape ()"),
        ((range(3), THREE, None, [1, 2]), "rho has shape (2,), expected (3, 0)"),
        ((range(3), THREE, None, None, None, 3), "meta must be entries by their names, not 3"),
        ((range(3), THREE, None, None, None, None, 3), "names must be a list of the columns' names, not 3"),
        ((range(3), {3: [1, 2, 3]}), "names must be a list of the columns' names, not (3,)"),
    ],
)
def test_wrong_arguments_of_a_measurement_are_named(arguments: tuple[Any, ...], says: str) -> None:
    with pytest.raises(MeasurementError) as error:
        Measurement(*arguments)
    assert says in str(error.value) and "\n" not in str(error.value)


def test_wrong_options_of_a_reader_are_named(tmp_path: Path) -> None:
    path = write(tmp_path, table())
    with pytest.raises(MeasurementError, match="columns must be names of columns, not 3"):
        read_measurement(path, columns=3)  # type: ignore[arg-type]
    with pytest.raises(MeasurementError, match="inputs must be names of columns, not 3"):
        read_measurement(path, inputs=3)  # type: ignore[arg-type]
    with pytest.raises(MeasurementError, match="states is a list of columns, not 3"):
        read_measurement(path, states=3)  # type: ignore[arg-type]


def test_slice_and_seen() -> None:
    m = disk()
    assert not m.seen[7] and not m.seen[9] and m.seen.sum() == N - 2
    part = m.slice(m.t[5], m.t[20])
    assert len(part) == 15 and part.t[0] == m.t[5] and part.flag[4] == "dup"
    with pytest.raises(ValueError):
        m.values[0, 0] = 0.0  # frozen


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    return path


ROWS = [f"{i / 25},{0.01 * i},0.02,{0.1 * i}" for i in range(20)]


def table(*, head: str = "t,Y,Z,beta", rows: list[str] = ROWS, **lines: str) -> str:
    rows = list(rows)
    for key, line in lines.items():
        rows[int(key[1:])] = line
    return "\n".join([head, *rows]) + "\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the file is empty"),
        ("# R = 0.08\n", "the file holds no rows"),
        ("t,Y,Z,beta\n", "the file holds no rows"),
        (table(head="t,Y,W,beta"), "no column Z: found t, Y, W, beta"),
        (table(head="frame,Y,Z,beta"), "no column t: found frame, Y, Z, beta"),
        (table(head="t,Y,Y,beta"), "two columns are called Y"),
        (table(head="t,a,b,c"), "no column theta: found t, a, b, c"),
        (
            table(r3="0.12,left,0.02,0.3"),
            "line 5: 'left' is not a number for Y",
        ),
        (
            table(r3="0.12,1_0,0.02,0.3"),
            "line 5: '1_0' is not a number for Y",
        ),
        (table(r3="0.12,0.1,0.02"), "line 5 ends before column beta: 3 of 4 cells"),
        (table(r3=",0.1,0.02,0.3"), "line 5: the time is missing or infinite"),
        (
            table(r3="0.08,0.1,0.02,0.3"),
            "line 5 repeats the time 0.08 s: times must increase",
        ),
        (
            table(r3="0.07,0.1,0.02,0.3"),
            "line 5 goes back in time from 0.08 s: times must increase",
        ),
        (table(r3="0.12,inf,0.02,0.3"), "line 5: Y is infinite"),
        (table(rows=[f"{i},nan,,NaN" for i in range(20)]), "no usable row: Y, Z, beta"),
        (table(rows=ROWS[:9]), "too short: 9 usable rows, at least 10 are needed"),
        (
            table(
                head="t,theta,sigma_theta",
                rows=[f"{i},0.1,{0.1 if i != 4 else 0}" for i in range(12)],
            ),
            "line 6: sigma_theta is 0.0, it must be positive and finite",
        ),
        (
            table(
                head="t,theta,sigma_theta",
                rows=[f"{i},0.1,{0.1 if i != 4 else ''}" for i in range(12)],
            ),
            "line 6: theta has a value but sigma_theta is missing",
        ),
        ("\n".join(f"{i} 0.1" for i in range(20)), "no header names the columns"),
    ],
)
def test_bad_files_are_named_in_one_sentence(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(MeasurementError) as error:
        read_measurement(write(tmp_path, text))
    assert says in str(error.value) and "\n" not in str(error.value)


def test_missing_file_folder_and_binary(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="there is no such file"):
        read_measurement(tmp_path / "nothing.csv")
    with pytest.raises(MeasurementError, match="cannot be read"):
        read_measurement(tmp_path)
    (tmp_path / "x.csv").write_bytes(b"\x00\x00\x00\x18ftypmp42" + bytes(100))
    with pytest.raises(MeasurementError, match="not a text table"):
        read_measurement(tmp_path / "x.csv")


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text("old")
    with pytest.raises(MeasurementError, match="header value of bad"):
        disk().with_meta(bad=object()).to_csv(path)
    assert path.read_text() == "old" and len(list(tmp_path.iterdir())) == 1


def test_what_the_caller_says_wins_over_the_header(tmp_path: Path) -> None:
    path = write(tmp_path, "# W = 0.05\n# R = 0.07\n" + table())
    assert read_measurement(path).meta["W"] == 0.05
    m = read_measurement(path, W=0.04, R=None)
    assert m.meta["W"] == 0.04 and m.meta["R"] == 0.07


def test_semicolons_with_decimal_commas(tmp_path: Path) -> None:
    rows = [f"{i / 25};{0.01 * i};0.02;{0.1 * i}".replace(".", ",") for i in range(20)]
    m = read_measurement(write(tmp_path, table(head="Time [s];Y [m];Z [m];beta (rad)", rows=[*rows])))
    assert m.t[3] == 0.12 and m["beta"][3] == 0.1 * 3


@pytest.mark.parametrize(
    ("head", "sizes", "told"),
    [
        ("Time (ms),Angle (deg)", (1e3, 180 / np.pi), "t from ms to s, theta from deg to rad"),
        ("t_ms,theta_deg", (1e3, 180 / np.pi), "t from ms to s, theta from deg to rad"),
        ("time/min,angle [°]", (1 / 60, 180 / np.pi), "t from min to s, theta from ° to rad"),
        ("time / ms,angle deg", (1e3, 180 / np.pi), "t from ms to s, theta from deg to rad"),
        ("t [s],theta [mrad]", (1.0, 1e3), "theta from mrad to rad"),
        ("t (video) [s],Angle (deg) (1)", (1.0, 180 / np.pi), "theta from deg to rad"),
        ("t (s),theta (Grad)", (1.0, 180 / np.pi), "theta from Grad to rad"),
        ("t (h),theta (arcmin)", (1 / 3600, 60 * 180 / np.pi), "t from h to s, theta from arcmin to rad"),
        ("t (\N{GREEK SMALL LETTER MU}s),theta (rad)", (1e6, 1.0), "t from .s to s"),
        ("t (\N{MICRO SIGN}s),theta (rad)", (1e6, 1.0), "t from .s to s"),
        ("t (s),Y (mm),Z (cm),beta (deg)", (1.0, 1e3, 1e2, 180 / np.pi), "Y from mm to m, Z from cm to m"),
    ],
)
def test_units_in_column_names_are_converted_and_told(
    tmp_path: Path, head: str, sizes: tuple[float, ...], told: str
) -> None:
    truth = np.column_stack([np.arange(40) / 25, *([np.linspace(0.01, 0.7, 40)] * (len(sizes) - 1))])
    rows = [",".join(f"{x:.12g}" for x in row * sizes) for row in truth]
    with pytest.warns(UserWarning, match=f"converted {told}"):
        m = read_measurement(write(tmp_path, "\n".join([head, *rows]) + "\n"))
    assert np.allclose(np.column_stack([m.t, m.values]), truth, rtol=1e-9)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("t,theta (rpm)", "theta is counted in rad, but the column is called theta (rpm)"),
        ("t,theta (cm)", "theta is counted in rad, but the column is called theta (cm)"),
        ("t (deg),theta", "t is counted in s, but the column is called t (deg)"),
        ("t,theta (grd)", "the unit 'grd' of theta is not known; write deg or rad"),
        ("t (frames),theta", "the unit 'frames' of t is not known; write s or ms"),
    ],
)
def test_a_unit_that_cannot_be_or_is_not_known_is_refused(tmp_path: Path, head: str, said: str) -> None:
    path = write(tmp_path, "\n".join([head, *(f"{i / 25},0.1" for i in range(20))]) + "\n")
    with pytest.raises(MeasurementError) as error:
        read_measurement(path)
    assert str(error.value) == f"{path}: {said}"


def test_of_an_own_model_times_and_angles_are_converted_and_lengths_stay(tmp_path: Path) -> None:
    head = "t (ms),q (deg),w (deg/s),x (mm),u (V)"
    path = write(tmp_path, "\n".join([head, *(f"{40 * i},180,90,5,3" for i in range(20))]) + "\n")
    with pytest.warns(UserWarning) as reported:
        m = read_measurement(path, states=["q", "w", "x", "u"])
    np.testing.assert_allclose(m.t, np.arange(20) / 25)
    np.testing.assert_allclose(m.values[3], [np.pi, np.pi / 2, 5, 3])
    kept, converted = (str(item.message) for item in reported)
    assert kept == f'{path}: x stays in mm (columns="x=x" makes it m)'
    assert "converted t from ms to s, q from deg to rad, w from deg/s to rad/s, as" in converted
    with pytest.warns(UserWarning, match="x from mm to m"):
        assert read_measurement(path, "x=x", ["q", "w", "x", "u"])["x"][3] == 0.005


def test_a_time_in_a_unit_that_is_not_known_is_told_of_an_own_model(tmp_path: Path) -> None:
    path = write(tmp_path, "\n".join(["t (years),x", *(f"{i},{i}" for i in range(20))]) + "\n")
    with pytest.warns(UserWarning, match="the unit 'years' of t is not known, its numbers stay"):
        assert read_measurement(path, states=["x"]).t[3] == 3.0
    with pytest.raises(MeasurementError, match="theta is counted in rad, but the column is called theta"):
        read_measurement(write(tmp_path, "t,theta (rpm)\n0,1\n"), states=["theta"])


def test_an_angle_in_degrees_is_unwrapped_in_radians(tmp_path: Path) -> None:
    turned = 9.0 * np.arange(60) / 25
    rows = [f"{i / 25},{np.degrees(np.angle(np.exp(1j * b))):.12g}" for i, b in enumerate(turned)]
    with pytest.warns(UserWarning, match="theta from deg to rad"):
        m = read_measurement(write(tmp_path, "\n".join(["t,theta (deg)", *rows]) + "\n"))
    assert np.allclose(m["theta"], turned)


def test_names_that_only_look_like_units_stay(tmp_path: Path) -> None:
    rows = "\n".join(f"{i / 25},{i},{0.01 * i},{i}" for i in range(20))
    m = read_measurement(write(tmp_path, "t,t_ms,theta,x_mm\n" + rows + "\n"))  # the last is not asked for
    assert m.t[3] == 0.12 and m["theta"][3] == 0.03
    each = read_measurement(tmp_path / "bad.csv", states=["x_mm"])
    assert each["x_mm"][3] == 3.0


@pytest.mark.skipif(not REAL.is_dir(), reason="the shared real data are not here")
@pytest.mark.parametrize(
    ("name", "columns", "rows", "first"),
    [  # first angle from the file's own first row
        (
            "string_pendulum_a.txt",
            None,
            4206,
            np.arctan2(0.4143889733848767, 1.4155257921331112),
        ),
        (
            "string_pendulum_b.txt",
            None,
            3948,
            np.arctan2(0.32620016167727206, 1.0882805245630045),
        ),
        (
            "string_pendulum_c.txt",
            None,
            4123,
            np.arctan2(0.24835480730132775, 0.8322618965900378),
        ),
        (
            "string_pendulum_d.txt",
            None,
            4100,
            np.arctan2(0.17697842313450085, 0.5763125719536614),
        ),
        ("cup_pendulum.txt", "t,theta,_", 2330, 0.7020338666008175),
        ("lab_pendulum.txt", "_,t,theta,_", 556, 1.1383885512243586),
    ],
)
def test_real_files(name: str, columns: str | None, rows: int, first: float, tmp_path: Path) -> None:
    m = read_measurement(REAL / name, columns=columns)
    assert m.kind == "pendulum" and len(m) == rows and m.seen.all()
    assert m["theta"][0] == first
    m.to_csv(tmp_path / "copy.csv")
    same(m, read_measurement(tmp_path / "copy.csv"))
