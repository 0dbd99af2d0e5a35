"""Tables as programs of school laboratories export them: two lines of names, cut-off logs, XML."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import udd
from udd.errors import MeasurementError

ANGLE = 0.5 * np.cos(0.3 * np.arange(40))


def written(path: Path, lines: list[str], mark: str = ",", end: list[str] | None = None) -> Path:
    rows = [f"{0.1 * i:.3f}{mark}{a:.5f}" for i, a in enumerate(ANGLE)]
    path.write_text("\n".join([*lines, *rows, *(end or [])]) + "\n", encoding="utf-8")
    return path


def test_definitions_of_cassy_name_the_columns(tmp_path: Path):
    rows = [f"{0.1 * i:.3f}\t{a:.5f}".replace(".", ",") for i, a in enumerate(ANGLE)]
    head = ["MIN=0\t-1", "MAX=40\t1", "SCALE=10\t0,5", "DEC=1\t3", 'DEF="Zeit" t / s\t"Winkel" &b_A1 / °']
    path = tmp_path / "cassy.txt"
    path.write_bytes(("\ufeff" + "\r\n".join([*head, *rows]) + "\r\n").encode())
    with pytest.warns(UserWarning, match="theta from ° to rad"):
        result = udd.read_measurement(path, columns="t=Zeit,theta=Winkel")
    assert len(result) == 40 and np.allclose(result["theta"], np.radians(ANGLE), atol=1e-7)
    assert result.t[-1] == pytest.approx(3.9)


@pytest.mark.parametrize(
    ("lines", "columns", "units"),
    [
        (["Axis1", "Number of data,40", "Time,Analog 1", "ms,Pendulum angle [deg]"], "theta=Analog 1", 1e-3),
        (["Time,Angle", "s,deg"], "theta=Angle", 1.0),
        (["Time,Angle", "(s),(deg)"], "theta=Angle", 1.0),
        (["Time,Angle", "[ms],[°]"], "theta=Angle", 1e-3),
        (["Messung,Sensor", "ms,deg"], "t=Messung,theta=Sensor", 1e-3),
        (["Zeit,Winkel", "min,deg"], "theta=Winkel", 60.0),
    ],
)
def test_units_may_stand_below_the_names(tmp_path: Path, lines, columns, units):
    with pytest.warns(UserWarning, match="deg|°"):
        result = udd.read_measurement(written(tmp_path / "two.csv", lines), columns=columns)
    assert len(result) == 40 and np.allclose(result["theta"], np.radians(ANGLE), atol=1e-6)
    assert result.t[-1] == pytest.approx(3.9 * units)


def test_a_unit_of_an_input_below_its_name_is_kept(tmp_path: Path):
    path = written(tmp_path / "volts.csv", ["Time,Motor", "s,V"])
    result = udd.read_measurement(path, columns={"x": "Motor"}, inputs={"u": "Motor"})
    assert result.meta["input_units"] == {"u": "V"}


@pytest.mark.parametrize("end", [";0.1234", "4.0", ";"])
def test_a_last_row_that_is_cut_off_is_passed_over(tmp_path: Path, end: str):
    path = written(tmp_path / "log.csv", ["Time;Angle1"], ";", [end])
    if end == ";":  # an empty row, which spreadsheets leave
        assert len(udd.read_measurement(path, columns={"theta": "Angle1"})) == 40
        return
    with pytest.warns(UserWarning, match=r"line 42, the last, .* is passed over"):
        result = udd.read_measurement(path, columns={"theta": "Angle1"})
    assert len(result) == 40


def test_a_row_without_a_time_in_the_middle_is_refused(tmp_path: Path):
    path = written(tmp_path / "log.csv", ["Time;Angle1"], ";", [";0.1", "4.1;0.2"])
    with pytest.raises(MeasurementError, match="line 42: the time is missing"):
        udd.read_measurement(path, columns={"theta": "Angle1"})


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("a.labx", '<?xml version="1.0"?><cassylab><x/></cassylab>', "a project of CASSY Lab"),
        ("b.labx", "<lab/>", "a project of CASSY Lab"),
        (
            "c.phyphox",
            '<!-- mine --><phyphox version="1.7"><title>x</title></phyphox>',
            "an experiment of phyphox",
        ),
        ("d.xml", '<?xml version="1.0"?>\n<phyphox/>', "an experiment of phyphox"),
        ("e.cmbl", "<Document/>", "a project of Logger Pro"),
        ("f.xml", '<?xml version="1.0"?><kml/>', r"XML of another program than Tracker \(<kml>\)"),
        ("g.trk", '<object class="else"/>', "not a project of Tracker"),
    ],
)
def test_xml_of_other_programs_is_called_what_it_is(tmp_path: Path, name: str, content: str, what: str):
    (tmp_path / name).write_text(content)
    with pytest.raises(MeasurementError, match=what):
        udd.read_measurement(tmp_path / name)
