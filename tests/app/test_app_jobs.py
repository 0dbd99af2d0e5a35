"""The page's uploads and jobs: limits, refusals in one sentence, results, cancelling."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import time
from collections.abc import AsyncIterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from markupsafe import Markup

pytest.importorskip("starlette")
pytest.importorskip("httpx2")
from starlette.testclient import TestClient

import udd
from app_for_tests import CHAOS, SOCKET, client
from bob_films import arc, swing
from film_for_tests import FPS, write
from small_films import shot
from udd.app import error_text, jobs, limits, report_parts, uploads, worker
from udd.film import Defects
from udd.markers.layout import NAMED, PALE
from udd.report.document import Column, Figure, Gallery, Head, Image, Report, Section, Table

__all__ = ["client"]


def ended(client: TestClient, job: str, seconds: float = 120.0) -> dict[str, Any]:
    """Return the last message of a job."""
    with client.websocket_connect(SOCKET) as socket:
        socket.send_json({"type": "watch", "job": job})
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            message = socket.receive()
            if "text" in message and message["text"] is not None:
                said: dict[str, Any] = json.loads(message["text"])
                if said.get("state") in jobs.ENDED:
                    return said
    raise AssertionError("the job did not end")


def sent(client: TestClient, content: bytes, **known: str) -> dict[str, Any]:
    answer = client.post("/api/jobs/film", content=content, params=known)
    assert answer.status_code == 200, answer.text
    return ended(client, answer.json()["job"])


def folders(client: TestClient) -> list[Path]:
    return [job.folder for job in client.app.state.jobs.jobs.values()]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\0\1\2" * 1000, "not a film that can be decoded"),
        (b"this is no table", "No row holds numbers"),
        (b"t,Y,Z,beta\n" + b"".join(b"%f,0.01,0.01,1\n" % (k / 25) for k in range(99)), "drive speed W"),
    ],
)
def test_a_file_that_cannot_be_used_gets_one_sentence(client: TestClient, content: bytes, words: str) -> None:
    pytest.importorskip("av")
    said = sent(client, content)
    assert said["state"] == "failed"
    assert words in said["answer"]["error"]
    assert "\n" not in said["answer"]["error"]
    assert "udd-app" not in said["answer"]["error"]  # no path of this machine
    assert not any(folder.exists() for folder in folders(client))


@pytest.mark.parametrize(
    ("error", "shown"),
    [
        (
            "the data take more than the limit of 1 GB (limit=1e10 allows more)",
            "The data take more than the limit of 1 GB.",
        ),
        (
            'row 3 repeats the time (repeated="first" keeps the first of such rows)',
            "Row 3 repeats the time.",
        ),
        (
            "line 9 goes back in time (part=0, part=1 ... reads the rows between such jumps)",
            "Line 9 goes back in time.",
        ),
        (
            "no column t: found a; of evenly spaced samples say how many a second, rate=",
            "No column t: found a.",
        ),
        (
            "no column t: found a, b; which of them is it, columns={'t': ...}?",
            "No column t: found a, b.",
        ),
        (
            'no header names the columns: say what they are, for example columns="t,theta,_"',
            "No header names the columns: say what they are.",
        ),
        (
            "the contact is not determined: give pivot=(u, v) in pixels",
            "The contact is not determined: click the contact.",
        ),
        ("show all marks, or give your own (layout)", "Show all marks, or give your own."),
        ("W is 4.2 m/s (expected 0.042): is it in cm/s?", "W is 4.2 m/s (expected 0.042): is it in cm/s?"),
    ],
)
def test_the_page_names_no_argument_of_python(error: str, shown: str) -> None:
    assert error_text.sentence(ValueError(error)) == shown


def test_an_upload_that_names_files_of_the_host_is_refused(client: TestClient, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    secret, evil = tmp_path / "secret", tmp_path / "evil.h5"
    secret.write_bytes(bytes(range(40)))
    with h5py.File(evil, "w") as file:
        file["t"] = np.arange(40) / 25
        file.create_dataset("theta", (40,), "u1", external=[(str(secret), 0, 40)])
    said = sent(client, evil.read_bytes(), length="1.0")
    assert said["state"] == "failed"
    error = "The HDF5 file cannot be read: 'theta' is stored in another file (external storage): "
    assert said["answer"]["error"] == f"{error}copy the data into the file itself."
    playlist = sent(client, f"ffconcat version 1.0\nfile {secret}\n".encode(), length="1.0")
    assert playlist["state"] == "failed" and "\n" not in playlist["answer"]["error"]


def test_a_film_that_is_cut_off_is_refused(client: TestClient) -> None:
    pytest.importorskip("cv2")
    whole = (Path(udd.__file__).parent / "demo" / "sample.mp4").read_bytes()
    said = sent(client, whole[: len(whole) // 3], W="0.042")
    assert said["state"] == "failed"
    assert "cut off" in said["answer"]["error"]


def test_a_refused_film_stays_for_clicks(client: TestClient, tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    film = shot(tmp_path / "no_red.mp4", 0.6, defects=Defects(mark_strength=(0, 0, 1, 1)))
    said = sent(client, film.path.read_bytes(), W="0.039")
    assert said["state"] == "failed" and [p["name"] for p in said["answer"]["parts"]] == [jobs.REFUSED]
    data = client.get(f"/api/jobs/{said['job']}/{jobs.REFUSED}").json()
    assert data["size"] == [276, 350] and data["frames"][0]["uri"].startswith("data:image/jpeg")
    where = {"of": said["job"]}
    clicked = {"clicks": {"frame": 99, "pivot": [138, 166]}, "leave_out": [[3, 4]]}
    answer = client.post("/api/jobs/again", params=where, content=json.dumps(clicked))
    again = ended(client, answer.json()["job"])
    assert again["answer"]["error"].startswith("Clicks: there is no frame 99")
    kept = client.get(f"/api/jobs/{again['job']}/{jobs.REFUSED}").json()["start"]
    assert kept["pivot"] == [[138, 166]] and kept["leave_out"] == "3-4"
    for params, content, words in (
        ({"of": "none"}, "{}", "choose it again"),
        (where, '{"config": "/etc/passwd"}', "has no 'config'"),
        (where, "no JSON", "JSON"),
    ):
        answer = client.post("/api/jobs/again", params=params, content=content)
        assert answer.status_code == 400 and words in answer.text


def test_a_pendulums_film_is_tracked(client: TestClient, tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    rate, length = np.sqrt(9.81 / 0.25), 900 * 0.25  # rad/s and pixels
    t = np.arange(60) / FPS
    theta = 0.2 * np.exp(-0.02 * t) * np.cos(rate * t)
    film = write(tmp_path / "clock.mp4", swing([(*arc(theta, length), (190, 35, 40))], (140, 145, 140)))
    said = sent(client, film.read_bytes(), bob="red", length="0.25")
    assert "tracking the film" in said["stages"]
    # too short to be fitted, but the motion is kept
    assert "record for longer" in said["answer"]["error"]
    assert [part["name"] for part in said["answer"]["parts"]] == ["measurement.csv"]
    table = tmp_path / "motion.csv"
    table.write_bytes(client.get(f"/api/jobs/{said['job']}/measurement.csv").content)
    m = udd.read_measurement(table)
    assert m.seen.all() and np.abs(m["theta"] - theta).max() < 2e-3 and m.meta["length"] == 0.25
    other = sent(client, film.read_bytes(), bob="blue", length="0.25")
    assert other["answer"]["error"].startswith("No bob of that colour moves in this film")
    data = client.get(f"/api/jobs/{other['job']}/{jobs.REFUSED}").json()
    assert data["bobs"] == 1 and data["tools"] == ["bob", "pivot", "region"]
    for params, words in (
        ({"bob": "red"}, "needs the length"),
        ({"bob": "pink", "length": "0.3"}, "Bob must be"),
        ({"bob": "red,red", "length": "0.3"}, "Bob: two bobs need two colours"),
        ({"config": "radius = 0.1"}, "a config has no 'radius'"),
        ({"config": "no table"}, "is not TOML"),
    ):
        answer = client.post("/api/jobs/film", content=film.read_bytes(), params=params)
        assert answer.status_code == 400 and words in answer.text


def test_each_language_lists_the_colours_of_bobs() -> None:
    for file in sorted(files("udd.app").joinpath("static").iterdir(), key=str):
        if file.name.startswith("texts.") and file.name.endswith(".json"):
            rows = json.loads(file.read_text(encoding="utf-8"))["loop_bobs"]
            assert [value for value, _ in rows] == [*NAMED, *PALE], file.name


def test_an_upload_is_no_larger_than_fits(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "UPLOAD", 1 << 20)
    declared = client.post("/api/jobs/film", content=b"x" * (2 << 20))
    assert (declared.status_code, declared.text) == (413, "The file is larger than 1 MB.")
    piecewise = client.post("/api/jobs/film", content=iter([b"x" * (1 << 19)] * 4))
    assert (piecewise.status_code, piecewise.text) == (413, "The file is larger than 1 MB.")
    empty = client.post("/api/jobs/film", content=b"")
    assert (empty.status_code, empty.text) == (400, "The file is empty.")
    folder: Path = client.app.state.parts["folder"]  # type: ignore[attr-defined]
    assert [path.name for path in folder.iterdir()] == ["lock"]


def test_what_is_uploaded_is_private(tmp_path: Path) -> None:
    folder = uploads.private_folder(tmp_path)
    assert folder.stat().st_mode & 0o077 == 0

    async def chunks() -> Any:
        yield b"a,b\n"

    assert asyncio.run(uploads.receive(chunks(), folder)) == folder / "upload.csv"


def test_a_job_ends_in_a_verdict_whose_parts_can_be_taken(client: TestClient) -> None:
    t = np.arange(0, 24, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.6]).theta
    theta = theta + 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    table = "t,theta\n" + "".join(f"{a:.3f},{b:.6f}\n" for a, b in zip(t, theta, strict=True))
    said = sent(client, table.encode(), length="1.0")
    assert said["state"] == "done", said
    assert said["answer"]["verdict"] == "nothing missing"
    assert said["stages"][0] == "reading the table"
    names = [part["name"] for part in said["answer"]["parts"]]
    assert names[:3] == ["report.html", "measurement.csv", "discovery.json"]
    assert any(name.endswith(".png") for name in names)
    report = client.get(f"/api/jobs/{said['job']}/report.html")
    assert "default-src 'none'" in report.headers["content-security-policy"]
    for name in names:
        taken = client.get(f"/api/jobs/{said['job']}/{name}", params={"download": "1"})
        assert taken.status_code == 200
        assert taken.headers["content-disposition"].startswith("attachment")
    assert client.get(f"/api/jobs/{said['job']}/upload.csv").status_code == 404  # deleted, and never a part
    assert client.get(f"/api/jobs/{said['job']}/..%2Fupload.csv").status_code == 404
    (folder,) = folders(client)
    assert [path.name for path in folder.iterdir()] == ["out"]


def test_a_run_of_the_page_becomes_a_film(client: TestClient, tmp_path: Path) -> None:
    pytest.importorskip("av")
    from udd.tracking import Film

    job = client.post("/api/jobs/render?seconds=2", content=json.dumps(CHAOS).encode()).json()["job"]
    said = ended(client, job)
    assert said["state"] == "done", said
    (part,) = said["answer"]["parts"]
    film = tmp_path / "run.mp4"
    film.write_bytes(client.get(f"/api/jobs/{job}/{part['name']}").content)
    times = [picture.t for picture in Film(film).pictures()]
    assert len(times) in (49, 50)  # 25 a second; the last one's exposure must end within the run
    np.testing.assert_allclose(np.diff(times), 0.04, atol=1e-4)


def test_a_job_can_be_cancelled(client: TestClient) -> None:
    job = client.post("/api/jobs/sample").json()["job"]
    waiting = client.post("/api/jobs/sample").json()["job"]
    with client.websocket_connect(SOCKET) as socket:
        for one in (waiting, job):
            socket.send_json({"type": "cancel", "job": one})
    assert ended(client, job)["state"] == "cancelled"
    assert ended(client, waiting)["state"] == "cancelled"
    assert not any(folder.exists() for folder in folders(client))


def test_a_job_that_breaks_off_does_not_stop_the_queue(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def outcomes() -> list[jobs.Job]:
        async with jobs.Jobs() as queue:
            gone = queue.submit({"kind": "loop"}, tmp_path / "gone")
            cut = queue.submit({"kind": "loop"}, tmp_path)
            while not {gone.state, cut.state} <= set(jobs.ENDED):
                await asyncio.sleep(0.01)
            return [gone, cut]

    echo = shutil.which("echo")
    if echo is None:
        pytest.skip("needs a program that says something that is no message")
    monkeypatch.setattr("sys.executable", echo)
    ended = asyncio.run(asyncio.wait_for(outcomes(), 30))
    assert [job.state for job in ended] == ["failed", "failed"]
    assert all("ended early" in job.answer["error"] for job in ended)


def test_only_so_many_jobs_wait(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "JOBS", 1)
    first = client.post("/api/jobs/sample").json()["job"]
    assert client.post("/api/jobs/sample").text == "Too many jobs are waiting: cancel one."
    with client.websocket_connect(SOCKET) as socket:
        socket.send_json({"type": "cancel", "job": first})
    assert ended(client, first)["state"] == "cancelled"
    assert client.post("/api/jobs/sample").status_code == 200


@pytest.mark.parametrize(
    ("path", "body", "words"),
    [
        ("/api/jobs/shell", None, "There is no such job."),
        ("/api/jobs/render?seconds=5", b"x", "is not JSON"),
        ("/api/jobs/render?seconds=5", b"[" * 60_000, "is not JSON"),
        ("/api/jobs/render?seconds=500", json.dumps(CHAOS).encode(), "A film lasts from 0.5 to 60 s."),
        ("/api/jobs/film?W=fast", b"x", "W must be a number: a number is needed, not 'fast'."),
        (
            "/api/jobs/film?W=0,042",
            b"x",
            "W must be a number: the decimal sign is a point: 0.042, not 0,042.",
        ),
        ("/api/jobs/film?W=1_0", b"x", "W must be a number"),
        ("/api/jobs/film?W=nan", b"x", "W must be finite."),
    ],
)
def test_a_job_that_makes_no_sense_is_refused(
    client: TestClient, path: str, body: bytes | None, words: str
) -> None:
    answer = client.post(path, content=body)
    assert answer.status_code == 400
    assert words in answer.text
    assert not client.app.state.jobs.jobs  # type: ignore[attr-defined]


def test_no_more_is_read_of_a_request_than_a_message_may_have(client: TestClient) -> None:
    answer = client.post("/api/jobs/render?seconds=5", content=iter([b" " * (1 << 15)] * 4))
    assert (answer.status_code, answer.text) == (413, "The request is larger than 64 kB.")


def test_a_request_that_stops_halfway_is_given_up(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(limits, "PAUSE", 0.05)

    async def halfway() -> AsyncIterator[bytes]:
        yield b"{"
        await asyncio.sleep(60)

    for taken in (uploads.text(halfway()), uploads.receive(halfway(), tmp_path / "made")):
        (tmp_path / "made").mkdir(exist_ok=True)
        with pytest.raises(udd.UddError, match="stopped halfway"):
            asyncio.run(taken)


def test_a_films_size_is_limited(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    sample = Path(udd.__file__).parent / "demo" / "sample.mp4"
    monkeypatch.setattr(limits, "PIXELS", 1000)
    with pytest.raises(udd.errors.UddError, match="too large"):
        worker._check(sample)
    monkeypatch.undo()
    monkeypatch.setattr(limits, "FRAMES", 100)
    with pytest.raises(udd.errors.UddError, match="at most 100"):
        worker._check(sample)


def test_the_marks_are_told_while_a_film_is_tracked(tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    import cv2

    times = np.arange(0, 0.8, 0.005)
    run = udd.simulate(udd.Disk(0.03), times, [2.0, 0.02, -0.02, 0.0])
    film = udd.render(run, tmp_path / "short.mp4", size=(330, 420), scale=1050)
    told: list[dict[str, Any]] = []
    measured = worker._tracked(film.path, {"disk_radius": 0.08}, told.append)
    frames = [message for message in told if "frame" in message]
    assert frames[-1]["frame"]["number"] == frames[-1]["frame"]["of"] == len(measured)
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(frames[-1]["jpeg"]), np.uint8), cv2.IMREAD_COLOR)
    # Where the first mark is said to be, the picture is red: blue, green, red.
    u, v = np.round(frames[-1]["frame"]["marks"][0]).astype(int)
    blue, green, red = picture[v, u].astype(int)
    assert red > 2 * max(blue, green)


def test_the_parts_of_a_report_are_files(tmp_path: Path) -> None:
    pixel = base64.b64encode(b"PNG").decode()
    dot = Figure(Image(f"data:image/png;base64,{pixel}", "A dot", 100), "A caption")
    numbers = Table("One & all", (Column("a"),), ((Markup("1,5 <b>mm</b>"),),))
    report = Report(Head("", ""), (Section("One", (Gallery((dot,)), numbers)),))
    made = report_parts.save_parts(report, tmp_path)
    assert made[3:] == [
        {"name": "picture-1.png", "title": "A dot"},
        {"name": "table-1.csv", "title": "Table: One & all"},
    ]
    assert (tmp_path / "picture-1.png").read_bytes() == b"PNG"
    assert (tmp_path / "table-1.csv").read_text() == 'a\n"1,5 mm"\n'
