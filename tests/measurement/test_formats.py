"""Files of other programs: a known motion is read from each; a broken file is reported in one sentence."""

from __future__ import annotations

import io
import pickle
import warnings
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import savemat

from udd.measurement import Measurement, MeasurementError, read_measurement
from udd.measurement.formats import compiled, format_of, hdf5, is_table

DRIVEN = Path(__file__).parents[3] / "shared" / "data" / "driven"
N = 60
T = np.cumsum(np.random.default_rng(5).uniform(0.01, 0.05, N))  # unevenly sampled
THETA = 0.4 * np.cos(3 * T)
OMEGA = -1.2 * np.sin(3 * T)
U = np.sin(T)
SLOW = np.arange(30) / 10 + 0.004
V = np.cos(SLOW)
BOB = 0.7 * np.sin(THETA), -0.7 * np.cos(THETA)  # x, y; y up


def table(names: list[str], *columns: NDArray[np.float64], mark: str = ",", comma: bool = False) -> str:
    rows = [mark.join(repr(float(x)) for x in row) for row in zip(*columns, strict=True)]
    text = "\n".join(rows) + "\n"
    return mark.join(names) + "\n" + (text.replace(".", ",") if comma else text)


def phyphox(names: list[str], *columns: NDArray[np.float64], mark: str = ",", point: str = ".") -> str:
    """As the app writes it: quoted names, ten digits, NaN below what is shorter."""
    length = max(map(len, columns))
    cells = [[f"{x:.9E}" for x in column] + ["NaN"] * (length - len(column)) for column in columns]
    rows = [mark.join(row).replace(".", point) for row in zip(*cells, strict=True)]
    return "\n".join([mark.join(f'"{name}"' for name in names), *rows]) + "\n"


def archive(**files: str | bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, content in files.items():
            opened.writestr(name, content)
    return buffer.getvalue()


def phyphox_zip() -> bytes:
    gyroscope = ["Time (s)", "Gyroscope x (rad/s)", "Gyroscope y (rad/s)", "Gyroscope z (rad/s)"]
    acceleration = ["Time (s)", "Acceleration x (m/s^2)"]
    files = {
        "Accelerometer.csv": phyphox(acceleration, SLOW, V),
        "Gyroscope.csv": phyphox(gyroscope, T, 0 * T, 0 * T, OMEGA),
        "meta/device.csv": '"property","value"\n"deviceModel","x"\n',
        "meta/time.csv": '"event","experiment time","system time","system time text"\n"START",0,0,"x"\n',
    }
    return archive(**files)


ANGLE, SCALE, ORIGIN, FRAME = 10.0, 250.0, (320.0, 100.0), 1000 / 30


def trk(points: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]) -> str:
    """A project with axes that are turned, and a clip that begins at frame 4 and takes every second frame."""

    def prop(name: str, value: object, kind: str = "double") -> str:
        return f'<property name="{name}" type="{kind}">{value}</property>\n'

    def thing(kind: str, content: str) -> str:
        return f'<object class="org.opensourcephysics.{kind}">\n{content}</object>\n'

    a = np.radians(ANGLE)
    tracks = ""
    for name, (x, y) in points.items():
        across, up = x * np.cos(a) - y * np.sin(a), x * np.sin(a) + y * np.cos(a)
        marks = ""
        for k in range(len(x)):
            pixel = prop("x", ORIGIN[0] + SCALE * across[k]) + prop("y", ORIGIN[1] - SCALE * up[k])
            mark = thing("cabrillo.tracker.PointMass$FrameData", pixel)
            marks += prop(f"[{4 + 2 * k}]", mark, "object")
            marks += prop(f"[{5 + 2 * k}]", mark, "object") if k == 0 else ""  # not a frame of the clip
        content = prop("mass", 1.0) + prop("name", name, "string") + prop("framedata", marks, "array")
        tracks += prop("item", thing("cabrillo.tracker.PointMass", content), "object")
    axes = prop("xorigin", ORIGIN[0]) + prop("yorigin", ORIGIN[1]) + prop("angle", ANGLE)
    axes += prop("xscale", SCALE) + prop("yscale", SCALE)
    first = prop("[0]", thing("media.core.ImageCoordSystem$FrameData", axes), "object")
    clip = prop("startframe", 4, "int") + prop("stepsize", 2, "int") + prop("stepcount", N, "int")
    panel = prop("videoclip", thing("media.core.VideoClip", clip + prop("starttime", 500.0)), "object")
    panel += prop("clipcontrol", thing("media.core.StepperClipControl", prop("delta_t", FRAME)), "object")
    panel += prop("coords", thing("media.core.ImageCoordSystem", prop("framedata", first, "array")), "object")
    panel += prop("tracks", tracks, "collection")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + thing("cabrillo.tracker.TrackerPanel", panel)


def npz(**arrays: object) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def mat(content: dict[str, object], version: str = "5") -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, content, format=version, do_compression=version == "5")
    return buffer.getvalue()


def hdf5_file(*, matlab: bool = False) -> bytes:
    h5py = pytest.importorskip("h5py")
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512 if matlab else 0) as file:
        group = file.create_group("run")
        for name, column in (("time", T), ("theta", THETA), ("torque", U)):
            group[name] = column[None, :] if matlab else column
        group["torque"].attrs["units"] = "N m"
        file["W"] = 0.04
        if matlab:
            note = file.create_dataset("note", data=np.array([[ord(c)] for c in "bench"], dtype=np.uint16))
            note.attrs["MATLAB_class"] = np.bytes_("char")
            file.create_group("#refs#")["a"] = np.arange(3.0)
        else:
            file.attrs["note"] = "bench"
    raw = bytearray(buffer.getvalue())
    if matlab:
        raw[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    return bytes(raw)


def tracker_export(mark: str = "\t", comma: bool = False) -> str:
    """Tracker's table of two points: the pivot, marked twice, and the bob; lines end with a delimiter."""
    lines = [
        "#multi:",
        mark + f"mass A{mark}{mark}mass B{mark}{mark}",
        mark.join(["t", "x", "y", "x", "y", ""]),
    ]
    for k in range(N):
        numbers = [f"{x:.12E}" for x in (0.01, 0.02, BOB[0][k], BOB[1][k])]
        cells = [f"{T[k]:.12E}", *(numbers if k < 2 else ["", "", *numbers[2:]]), ""]
        lines.append(mark.join(cells).replace(".", "," if comma else "."))
    lines.append(f"{T[-1] + 0.1}".replace(".", "," if comma else ".") + mark * 5)  # a frame without marks
    return "\n".join(lines) + "\n"


EXCEL = "\ufeffsep=;\r\n" + table(
    ["Zeit [ms]", "Winkel (°)", "Drehzahl [rpm]", "Strom (A)"],
    1e3 * T,
    np.degrees(THETA),
    OMEGA * 30 / np.pi,
    U,
    mark=";",
    comma=True,
).replace("\n", "\r\n") + ";;;\r\n;;;\r\n"  # fmt: skip


def put(tmp_path: Path, name: str, content: str | bytes) -> Path:
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def close(m: Measurement, name: str, truth: NDArray[np.float64], rtol: float = 1e-9) -> None:
    """To the digits that the file has."""
    np.testing.assert_allclose(m[name], truth, rtol=0, atol=rtol * np.abs(truth).max())


def test_excels_table(tmp_path: Path) -> None:
    for content in (
        EXCEL.encode("utf-8"),
        EXCEL.lstrip("\ufeff").encode("utf-16"),
        EXCEL.encode("cp1252", "ignore"),
    ):
        path = put(tmp_path, "excel.csv", content)
        with pytest.warns(UserWarning, match="t from ms to s, theta from ° to rad, omega from rpm to rad/s"):
            m = read_measurement(
                path, columns={"theta": "Winkel", "omega": "Drehzahl"}, inputs={"i": "Strom"}
            )
        assert len(m) == N and m.meta["input_units"] == {"i": "A"}
        np.testing.assert_allclose(m.t, T, rtol=1e-14)
        for name, truth in (("theta", THETA), ("omega", OMEGA), ("i", U)):
            close(m, name, truth, 1e-14)
        assert m.meta["columns"] == {
            "t": "Zeit [ms], ms to s",
            "theta": "Winkel (°), ° to rad",
            "omega": "Drehzahl [rpm], rpm to rad/s",
            "i": "Strom (A), input",
        }


@pytest.mark.parametrize(("mark", "point"), [(",", "."), ("\t", "."), ("\t", ","), (";", ","), (";", ".")])
def test_phyphox_tables(tmp_path: Path, mark: str, point: str) -> None:
    names = ["Time (s)", "Gyroscope x (rad/s)", "Gyroscope z (rad/s)", "Absolute (rad/s)"]
    path = put(tmp_path, "Raw Data.csv", phyphox(names, T, 0 * T, OMEGA, OMEGA[:-3], mark=mark, point=point))
    m = read_measurement(path, columns={"omega": "Gyroscope z (rad/s)"})
    close(m, "omega", OMEGA, 1e-8)
    assert m.meta["columns"]["passed over"] == "Gyroscope x (rad/s), Absolute (rad/s)"


def test_a_phyphox_archive_has_a_clock_for_each_sensor(tmp_path: Path) -> None:
    path = put(tmp_path, "phyphox.zip", phyphox_zip())
    m = read_measurement(path, columns={"omega": "Gyroscope z"}, inputs={"a": "Acceleration x"}, hold="zero")
    close(m, "omega", OMEGA, 1e-8)
    assert m.inputs["a"].hold == "zero" and m.meta["input_units"] == {"a": "m/s^2"}
    np.testing.assert_allclose(m.inputs["a"].t, SLOW, rtol=1e-9)
    np.testing.assert_allclose(m.inputs["a"].values, V, atol=1e-9)
    with pytest.raises(MeasurementError, match=r"different clocks \(Accelerometer, Gyroscope\)"):
        read_measurement(path, columns={"omega": "Gyroscope z", "a": "Acceleration x"})
    with pytest.raises(
        MeasurementError, match=r"no column theta: found Time .s., Acceleration x .m/s.2., Time"
    ):
        read_measurement(path)


@pytest.mark.parametrize(("mark", "comma"), [("\t", False), (",", False), (";", True), ("\t", True)])
def test_trackers_table_of_several_points(tmp_path: Path, mark: str, comma: bool) -> None:
    path = put(tmp_path, "points.txt", tracker_export(mark, comma))
    m = read_measurement(path, columns={"x": "mass B x", "y": "mass B y"})
    assert m.names == ("x", "y") and len(m) == N + 1 and m.seen.sum() == N
    np.testing.assert_allclose(m["x"][:-1], BOB[0], atol=1e-12)
    bob = read_measurement(path, columns={"theta": ("mass B x", "mass B y")})
    assert bob.kind == "pendulum"
    np.testing.assert_allclose(bob["theta"][:-1], THETA, atol=1e-11)
    with pytest.raises(MeasurementError, match="found t, mass A x, mass A y, mass B x, mass B y"):
        read_measurement(path)


def test_a_tracker_project_in_its_own_axes(tmp_path: Path) -> None:
    alone = read_measurement(put(tmp_path, "bob.trk", trk({"mass A": BOB})))
    assert alone.kind == "pendulum" and len(alone) == N
    np.testing.assert_allclose(alone.t, 0.5 + 2 * np.arange(N) * FRAME / 1e3, rtol=1e-14)
    # pixels of some hundred are written to sixteen digits
    np.testing.assert_allclose(alone["theta"], THETA, atol=1e-13)
    assert alone.meta["length"] == pytest.approx(0.7, rel=1e-13)
    short = BOB[0][:12] * 2, BOB[1][:12] * 2
    both = put(
        tmp_path, "both.trz", archive(**{"swing.trk": trk({"up": BOB, "down": short}), "swing.mp4": b"x"})
    )
    m = read_measurement(both, columns={"a": "up x", "b": "down y"})
    np.testing.assert_allclose(m["a"], BOB[0], atol=1e-13)
    np.testing.assert_allclose(m["b"][:12], short[1], atol=1e-13)
    assert np.isnan(m["b"][12:]).all()


@pytest.mark.parametrize("version", ["4", "5"])
def test_matlab_files(tmp_path: Path, version: str) -> None:
    content: dict[str, object] = {"time": T, "angle": THETA[:, None], "torque": U, "W": 0.04}
    m = read_measurement(put(tmp_path, "run.mat", mat(content, version)), inputs=["torque"])
    assert m.kind == "pendulum" and m.meta["W"] == 0.04
    assert np.array_equal(m.t, T) and np.array_equal(m["theta"], THETA) and np.array_equal(m["torque"], U)


def test_matlab_structures_and_matrices(tmp_path: Path) -> None:
    content: dict[str, object] = {"run": {"t": T, "q": np.column_stack([THETA, OMEGA]), "note": "bench"}}
    m = read_measurement(put(tmp_path, "run.mat", mat(content)), columns={"theta": "q_1", "omega": "run.q_2"})
    assert np.array_equal(m["omega"], OMEGA) and m.meta["note"] == "bench"


@pytest.mark.parametrize("matlab", [False, True])
def test_hdf5_and_matlab_7_3(tmp_path: Path, matlab: bool) -> None:
    path = put(tmp_path, "run.mat" if matlab else "run.h5", hdf5_file(matlab=matlab))
    m = read_measurement(path, inputs={"tau": "run/torque"})
    assert np.array_equal(m.t, T) and np.array_equal(m["theta"], THETA) and np.array_equal(m["tau"], U)
    assert m.meta["W"] == 0.04 and m.meta["note"] == "bench" and m.meta["input_units"] == {"tau": "N m"}


def test_hdf5_without_its_package_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hdf5, "find_spec", lambda _name: None)
    with pytest.raises(MeasurementError, match=r"need the package h5py \(pip install 'udd\[hdf5\]'\)"):
        read_measurement(put(tmp_path, "run.h5", hdf5.SIGNATURE + bytes(100)))


def test_a_crash_of_the_hdf5_library_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("h5py")
    crash = put(tmp_path, "crash.py", "import os; os.abort()")
    monkeypatch.setattr(compiled, "READER", str(crash))
    with pytest.raises(MeasurementError, match="the HDF5 file cannot be read: it is broken"):
        read_measurement(put(tmp_path, "run.h5", hdf5_file()))


def test_numpy_archives(tmp_path: Path) -> None:
    path = put(tmp_path, "run.npz", npz(t_ms=1e3 * T, theta=THETA, u=U, W=0.04, clock=SLOW, v=V))
    with pytest.warns(UserWarning, match="converted t from ms to s"):
        m = read_measurement(path, inputs=["u"])
    np.testing.assert_allclose(m.t, T, rtol=1e-15)
    assert np.array_equal(m["theta"], THETA) and np.array_equal(m["u"], U) and m.meta["W"] == 0.04
    item = tmp_path / "run.npy"
    np.save(item, np.column_stack([T, THETA, U]))
    m = read_measurement(item, columns="t,theta,_")
    assert np.array_equal(m["theta"], THETA)
    with pytest.raises(MeasurementError, match="columns gives 2 names, but the file has column_1, column_2"):
        read_measurement(item, columns="t,theta")


class Trap:
    """Code that would run if it were unpickled."""

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str, str]]:
        return open, ("ran", "w")


def test_nothing_is_unpickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = put(tmp_path, "run.npz", npz(t=T, theta=np.array([Trap()] * N, dtype=object)))
    assert b"ran" in pickle.dumps(Trap())
    for name in ("run.npz", "run.npy"):
        if name == "run.npy":
            np.save(tmp_path / name, np.array([Trap()] * N, dtype=object))
        with pytest.raises(MeasurementError, match=r"cannot be read: .*allow_pickle"):
            read_measurement(path.with_name(name))
    assert not (tmp_path / "ran").exists()


def test_parquet_of_others(tmp_path: Path) -> None:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    pq.write_table(pa.table({"Time (s)": T, "pos (deg)": np.degrees(THETA), "i": U}), tmp_path / "a.parquet")
    with pytest.warns(UserWarning, match="theta from deg to rad"):
        m = read_measurement(tmp_path / "a.parquet", columns={"theta": "pos"}, inputs=["i"])
    close(m, "theta", THETA, 1e-15)


def rows_of(mark: str, quote: str = "", point: str = ".") -> str:
    """Times and angles, four digits each."""
    cells = [
        [f"{quote}{x:.4f}{quote}".replace(".", point) for x in row] for row in zip(T, THETA, strict=True)
    ]
    return "\n".join(mark.join(row) for row in cells) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        "t theta\n" + rows_of(" ", point=","),
        "t  theta\n" + rows_of("  ", point=","),
        '"t","theta"\n' + rows_of(",", '"', ","),
        "t;theta\n" + rows_of(";", '"', ","),
        "t\ttheta\n" + rows_of("\t", point=","),
    ],
)
def test_decimal_commas_between_blanks_and_in_quotes(tmp_path: Path, text: str) -> None:
    m = read_measurement(put(tmp_path, "a.csv", text))
    assert np.array_equal(m.t, T.round(4)) and np.array_equal(m["theta"], THETA.round(4))


def test_decimal_commas_between_commas_are_refused(tmp_path: Path) -> None:
    path = put(tmp_path, "a.csv", "t,theta\n" + rows_of(",", point=","))
    says = "rows have 4 whole numbers for 2 columns, as decimal commas between commas make them: separate "
    with pytest.raises(MeasurementError, match=f"{says}columns by semicolons"):
        read_measurement(path)
    whole = put(tmp_path, "b.csv", "t,theta\n" + "".join(f"{k},{k % 3}\n" for k in range(20)))
    assert read_measurement(whole)["theta"][5] == 2.0


@pytest.mark.parametrize(
    "names", [["clock ms", "Winkel deg"], ["clock_ms", "Winkel_deg"], ["clock / ms", "Winkel in deg"]]
)
def test_a_unit_without_brackets_counts_of_what_is_said_to_be_an_angle(
    tmp_path: Path, names: list[str]
) -> None:
    path = put(tmp_path, "a.csv", table([*names, "u_ms"], 1e3 * T, np.degrees(THETA), U))
    with pytest.warns(UserWarning, match="t from ms to s, theta from deg to rad"):
        m = read_measurement(path, columns={"t": names[0], "theta": names[1]})
    np.testing.assert_allclose(m.t, T)
    np.testing.assert_allclose(m["theta"], THETA)


@pytest.mark.parametrize("head", ["timestamp,angle", "Time,angle", "flag,angle,when"])
def test_dates_become_seconds_since_the_first(tmp_path: Path, head: str) -> None:
    start = datetime(2024, 12, 31, 23, 59, 59, tzinfo=UTC)
    dates = [str(start + timedelta(seconds=float(t))) for t in T.round(3)]
    rows = zip(THETA, dates, strict=True)
    cells = [f",{a:.4f},{date}" if head.startswith("flag") else f"{date},{a:.4f}" for a, date in rows]
    with pytest.warns(UserWarning, match="converted t from dates to s since the first"):
        m = read_measurement(put(tmp_path, "a.csv", "\n".join([head, *cells]) + "\n"))
    np.testing.assert_allclose(m.t, (T - T[0]).round(3), atol=1e-3)
    assert np.array_equal(m["theta"], THETA.round(4))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("when,angle\n03.05.2024 12:00,x\n", "'03.05.2024 12:00' is no date that is read: write the time in"),
        (
            "time,angle\n12:00:01,1\n",
            "line 2: '12:00:01' is not a number for t (a time is in",
        ),
        ("when,angle\n2024-05-03,1\nsoon,2\n", "line 3: 'soon' is no date like that of the first row"),
        (
            "when,angle\n2024-05-03 01:00,1\n2024-05-03T02:00Z,2\n",
            "line 3: '2024-05-03T02:00Z' is no date like",
        ),
        ("when,angle\none,two\n", "no row holds numbers"),
    ],
)
def test_what_is_no_time_is_named(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(MeasurementError) as error:
        read_measurement(put(tmp_path, "a.csv", text))
    assert says in str(error.value) and "\n" not in str(error.value)


def test_the_header_stands_above_rows_with_words(tmp_path: Path) -> None:
    rows = "".join(f"{t:.4f},{a:.4f},seen by eye\n" for t, a in zip(T, THETA, strict=True))
    path = put(tmp_path, "a.csv", "my swing\nclock,pos,note\n" + rows)
    m = read_measurement(path, columns={"t": "clock", "theta": "pos"})
    assert np.array_equal(m["theta"], THETA.round(4))


def plain(**columns: NDArray[np.float64]) -> str:
    return table(list(columns), *columns.values())


def test_samples_at_a_rate(tmp_path: Path) -> None:
    path = put(tmp_path, "v.csv", table(['"V1"', '"V2"', ""], U, THETA, U).replace("0.0099", "0.0099"))
    m = read_measurement(path, columns={"y": "V2"}, inputs=["V1"], rate=610.35)
    assert np.array_equal(m.t, np.arange(N) / 610.35) and np.array_equal(m["V1"], U)
    with pytest.raises(
        MeasurementError, match=r"no column t: found V1, V2; of evenly spaced samples say .* rate="
    ):
        read_measurement(path, columns={"y": "V2"})
    with pytest.raises(MeasurementError, match="rate is for files without times, but here is t"):
        read_measurement(put(tmp_path, "t.csv", plain(t=T, theta=THETA)), rate=10.0)
    with pytest.raises(MeasurementError, match="rate must be a positive number"):
        read_measurement(path, columns={"y": "V2"}, rate=0.0)


def test_repeated_times_are_refused_or_the_first_is_kept(tmp_path: Path) -> None:
    rows = np.sort(np.r_[np.arange(N), [7, 7, N - 1]])
    path = put(tmp_path, "again.csv", plain(t=T[rows], theta=THETA[rows], u=np.arange(len(rows)) * 1.0))
    with pytest.raises(
        MeasurementError, match=r'line 10 repeats the time .*\(repeated="first" keeps the first'
    ):
        read_measurement(path)
    m = read_measurement(path, repeated="first", inputs=["u"])
    assert np.array_equal(m.t, T) and m["u"][7] == 7 and m["u"][8] == 10


def test_a_clock_that_starts_anew_gives_parts(tmp_path: Path) -> None:
    path = put(
        tmp_path, "twice.csv", plain(t=np.r_[T, T[:20]], theta=np.r_[THETA, OMEGA[:20]], u=np.r_[U, V[:20]])
    )
    with pytest.raises(MeasurementError, match=r"line 62 goes back in time .*\(part=0, part=1 \.\.\. reads"):
        read_measurement(path)
    first, second = (read_measurement(path, part=k, inputs=["u"]) for k in (0, 1))
    assert np.array_equal(first["theta"], THETA)
    assert np.array_equal(second["theta"], OMEGA[:20]) and np.array_equal(second.inputs["u"].values, V[:20])
    with pytest.raises(MeasurementError, match="there is no part 2: the file has 2 runs"):
        read_measurement(path, part=2)


def test_gaps_stay_gaps_and_empty_samples_of_an_input_are_left_out(tmp_path: Path) -> None:
    keep = np.r_[0:20, 35:N]
    text = plain(t=T[keep], theta=THETA[keep], u=U[keep]).splitlines()
    text[4] = text[4].rsplit(",", 1)[0] + ","
    m = read_measurement(put(tmp_path, "gap.csv", "\n".join(text) + "\n"), inputs=["u"])
    assert np.array_equal(m.t, T[keep]) and len(m.inputs["u"]) == len(keep) - 1
    assert m.meta["columns"]["u"] == "u, input, 1 samples empty"


def test_what_was_read_keeps_its_word_on_columns_in_a_copy(tmp_path: Path) -> None:
    path = put(tmp_path, "a.csv", plain(time=T, position=THETA, torque=U, junk=U))
    m = read_measurement(path, columns="theta=position", inputs="tau=torque")
    m.to_csv(tmp_path / "copy.csv")
    copy = read_measurement(tmp_path / "copy.csv")
    assert dict(copy.meta) == dict(m.meta) and np.array_equal(copy["tau"], U)
    assert m.meta["columns"]["passed over"] == "junk"
    assert read_measurement(tmp_path / "copy.csv", inputs=["tau"]).inputs["tau"].values[3] == U[3]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"columns": {"theta": "angular"}}, "no column angular: found t, position (mm), torque"),
        ({"inputs": ["torque"]}, "no column theta: found t, position (mm), torque; which of them is it"),
        (
            {"columns": {"x": "position"}, "inputs": ["force"]},
            "no column force: found t, position (mm), torque",
        ),
        (
            {"columns": {"theta": "position"}},
            "theta is counted in rad, but the column is called position (mm)",
        ),
        (
            {"columns": {"x": "position"}, "inputs": {"x": "torque"}},
            "an input and a column are both called x",
        ),
        (
            {"columns": {"x": "position"}, "inputs": {"a b": "torque"}},
            "an input's name must be fit for a formula",
        ),
        ({"columns": {"x": 3}}, "columns needs the name of a column for x, not 3"),
        ({"columns": "x=position,=torque"}, "columns must look like theta=position, not '=torque'"),
        ({"columns": {"x": "position"}, "inputs": [3]}, "inputs must be names of columns"),
        ({"columns": {"x": "position"}, "inputs": ["torque"], "hold": "none"}, "hold must be one of"),
        ({"columns": {"x": "position"}, "repeated": "last"}, "repeated must be"),
        ({"columns": {"x": "position"}, "part": -1}, "there is no part -1"),
    ],
)
def test_wrong_requests_are_named_in_one_sentence(
    tmp_path: Path, options: dict[str, object], says: str
) -> None:
    path = put(tmp_path, "a.csv", table(["t", "position (mm)", "torque"], T, THETA, U))
    with pytest.raises(MeasurementError) as error, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read_measurement(path, **options)  # type: ignore[arg-type]
    assert says in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        (
            "a.xlsx",
            archive(**{"xl/workbook.xml": "<x/>"}),
            "this is an Excel workbook: save its sheet as CSV",
        ),
        ("a.xlsb", archive(**{"xl/workbook.bin": "x"}), "this is an Excel workbook: save its sheet as CSV"),
        (
            "a.ods",
            archive(mimetype="application/vnd.oasis.opendocument.spreadsheet", **{"content.xml": "<x/>"}),
            "this is a spreadsheet (OpenDocument): save its sheet as CSV",
        ),
        (
            "a.xls",
            bytes.fromhex("d0cf11e0a1b11ae1") + bytes(600),
            "this is an Excel workbook or another old Office file: save its sheet as CSV",
        ),
        ("a.zip", archive(**{"photo.jpg": b"x"}), "the archive holds no table (.csv): found photo.jpg"),
        ("a.zip", archive(**{"a.csv": "t,theta\n"}), "holds no rows"),
        ("a.trk", "<object class='other'/>", "not a project of Tracker"),
        ("a.trk", '<!DOCTYPE x [<!ENTITY a "b">]><x/>', "holds XML entities"),
        ("a.trk", trk({}), "the Tracker project holds no marked point"),
        ("a.npz", npz(words=np.array(["a", "b"])), "the file holds no arrays of numbers"),
        ("a.mat", mat({"s": "words"}), "the file holds no arrays of numbers"),
        ("a.mat", b"not of MATLAB at all, by far", "the MATLAB file cannot be read"),
    ],
)
def test_wrong_files_are_named_in_one_sentence(
    tmp_path: Path, name: str, content: str | bytes, says: str
) -> None:
    with pytest.raises(MeasurementError) as error:
        read_measurement(put(tmp_path, name, content))
    assert says in str(error.value) and "\n" not in str(error.value)


def parquet_file() -> bytes:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    buffer = io.BytesIO()
    pq.write_table(pa.table({"t": T, "theta": THETA}), buffer)
    return buffer.getvalue()


BROKEN: dict[str, Callable[[], bytes]] = {
    "excel.csv": lambda: EXCEL.encode(),
    "excel.txt": lambda: EXCEL.lstrip("\ufeff").encode("utf-16"),
    "points.txt": lambda: tracker_export().encode(),
    "swing.trk": lambda: trk({"mass A": BOB}).encode(),
    "swing.trz": lambda: archive(**{"swing.trk": trk({"mass A": BOB})}),
    "phyphox.zip": phyphox_zip,
    "run4.mat": lambda: mat({"t": T, "theta": THETA}, "4"),
    "run5.mat": lambda: mat({"run": {"t": T, "theta": THETA}}),
    "run73.mat": lambda: hdf5_file(matlab=True),
    "run.h5": hdf5_file,
    "run.npz": lambda: npz(t=T, theta=THETA),
    "run.parquet": parquet_file,
}


# At night twice as many of each.
@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("name", BROKEN)
def test_cut_and_mutated_files_are_read_or_refused_in_one_sentence(
    tmp_path: Path, name: str, times: int
) -> None:
    whole = BROKEN[name]()
    rng = np.random.default_rng(11)
    kind = format_of(whole[:4096], Path(name).suffix).name
    few = times * (2 if kind in ("HDF5", "MATLAB", "Parquet") else 25)  # each of these takes a process
    broken = [whole[: int(cut)] for cut in np.linspace(1, len(whole) - 1, few)]
    for _ in range(3 * few):
        mutated = bytearray(whole)
        for place in rng.integers(0, len(whole) if rng.random() < 0.5 else min(600, len(whole)), size=3):
            mutated[place] = rng.integers(0, 256)
        broken.append(bytes(mutated))
    refused = 0
    for content in broken:
        path = put(tmp_path, name, content)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read_measurement(path)
        except MeasurementError as error:
            refused += 1
            assert "\n" not in str(error) and len(str(error)) < 1000
    assert refused >= few // 2


def test_films_are_no_tables() -> None:
    assert not is_table(b"\x00\x00\x00\x18ftypmp42" + bytes(50))
    assert all(is_table(make()[:4096], Path(name).suffix) for name, make in BROKEN.items())


@pytest.mark.skipif(not DRIVEN.is_dir(), reason="the shared driven data are not here")
@pytest.mark.parametrize(
    ("name", "options", "rows", "first"),
    [  # the last input of the file's own first row
        (
            "torque_pendulum_pd.csv",
            {"columns": {"theta": "position", "omega": "velocity"}, "inputs": ["torque"]},
            1170,
            -4.395604395604379988e-03,
        ),
        (
            "torque_pendulum_energy.csv",
            {"columns": {"theta": "position"}, "inputs": {"tau": "torque"}},
            4000,
            -1.318681318681313996e-02,
        ),
        (
            "double_pendulum_A_00.csv",
            {"columns": "q1=pos_meas1,q2=pos_meas2", "inputs": ["tau_meas1", "tau_meas2"]},
            4997,
            8.791208791208759976e-03,
        ),
        (
            "double_pendulum_A_05.csv",
            {"columns": "q1=pos_meas1,q2=pos_meas2", "inputs": ["tau_meas1", "tau_meas2"]},
            4997,
            2.930402930402919992e-03,
        ),
        ("silverbox_snls80mv.csv", {"columns": "y=V2", "inputs": ["V1"], "rate": 610.35}, 131072, 0.0057756),
    ],
)
def test_real_driven_machines(name: str, options: dict[str, object], rows: int, first: float) -> None:
    m = read_measurement(DRIVEN / name, **options)  # type: ignore[arg-type]
    assert len(m) == rows and m.seen.all()
    signal = list(m.inputs.values())[-1]
    assert len(signal) == rows and signal.values[0] == first
