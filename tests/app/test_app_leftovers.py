"""Files and processes of a killed server."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")

from app_for_tests import STIFF, question, served, until
from udd.app import folders


def test_folders_of_dead_servers_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = (
        "import time; from udd.app.folders import workspace\n"
        "with workspace() as folder: print(folder, flush=True); time.sleep(60)"
    )
    alive, dead = (
        subprocess.Popen(
            [sys.executable, "-c", code],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "TMPDIR": str(tmp_path)},
        )
        for _ in range(2)
    )
    try:
        kept, left = (Path(one.stdout.readline().strip()) for one in (alive, dead))  # type: ignore[union-attr]
        (left / "upload").mkdir()
        (left / "upload" / "film").write_bytes(b"film")
        dead.kill()
        dead.wait(10)
        assert left.exists()
        (tmp_path / "udd-app-other").mkdir()  # no server's
        (tmp_path / "udd-app-link").symlink_to(tmp_path / "udd-app-other")
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        with folders.workspace() as own:
            assert not left.exists()
            assert kept.exists()
            assert own.stat().st_mode & 0o077 == 0
        names = {path.name for path in tmp_path.iterdir()}
        assert names == {kept.name, "udd-app-other", "udd-app-link"}
    finally:
        for one in (alive, dead):
            one.kill()
            one.wait(10)
            assert one.stdout is not None
            one.stdout.close()


def test_ctrl_c_during_an_upload_and_a_job_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "made").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "made"))
    with served(tmp_path / "log") as app, app.half_open(b"") as upload:
        asked = f"POST /api/jobs/{{}}?{app.at.query} HTTP/1.1\r\nhost: {app.at.netloc}\r\norigin: http://{app.at.netloc}"
        with app.half_open(asked.format("sample").encode() + b"\r\ncontent-length: 0\r\n\r\n") as job:
            assert job.recv(4096).startswith(b"HTTP/1.1 200")
        upload.sendall(asked.format("film").encode() + b"\r\ncontent-length: 1000\r\n\r\nabc")
        until(lambda: list((tmp_path / "made").glob("*/*/upload")), 10)
        until(lambda: list((tmp_path / "made").glob("*/*/out")), 20)
        assert app.end() < 2.0
    assert list((tmp_path / "made").iterdir()) == []
    assert (tmp_path / "log").read_text() == "Ctrl-C ends it.\nudd: stopped\n"


def test_the_processes_of_a_killed_server_end(tmp_path: Path) -> None:
    with served(tmp_path / "log") as app, app.open() as page:
        page.send(question(STIFF))
        children = Path(f"/proc/{app.process.pid}/task/{app.process.pid}/children")
        if not children.exists():
            pytest.skip("needs /proc")
        until(lambda: children.read_text().split(), 10)
        made = children.read_text().split()
        app.process.kill()
        app.process.wait(10)
        until(lambda: not any(Path(f"/proc/{child}").exists() for child in made), 5)
