"""Runs of the page that take too much: they end with a sentence, and hold up nobody."""

from __future__ import annotations

import contextlib
import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")
from starlette.testclient import TestClient

from app_for_tests import CHAOS, HOST, ORIGIN, SOCKET, STIFF, TOKEN, question, served, until
from udd.app import calculators, interruption, limits, server, worker

STATIC = Path(server.__file__).parent / "static"


def test_stiff_runs_hold_up_nobody_and_ctrl_c_ends_them(tmp_path: Path) -> None:
    with served(tmp_path / "log") as app, contextlib.ExitStack() as stack:
        for _ in range(6):
            stiff = stack.enter_context(app.open())
            for first in range(0, 480, 120):
                stiff.send(question(STIFF, first=first))
        time.sleep(0.3)
        other = stack.enter_context(app.open())
        other.send(question(CHAOS))
        assert json.loads(other.recv(20))["type"] == "run"
        assert app.page() == 200
        assert app.end() < 2.0


@contextlib.contextmanager
def client_of(monkeypatch: pytest.MonkeyPatch, **budget: Any) -> Iterator[TestClient]:
    """A page whose runs have little."""
    monkeypatch.setattr(
        limits, "RUNS", limits.Budget(**{"processes": 1, "seconds": 60.0, "share": 60.0, **budget})
    )
    app = server.make_app(TOKEN, [HOST])
    with TestClient(app, base_url=ORIGIN, headers={"origin": ORIGIN, "x-udd-token": TOKEN}) as opened:
        yield opened


def test_a_run_has_seconds_to_compute(monkeypatch: pytest.MonkeyPatch) -> None:
    with client_of(monkeypatch, seconds=0.2) as client, client.websocket_connect(SOCKET) as page:
        for first in (0, 120):
            page.send_text(question(STIFF, first=first))
        for _ in range(2):  # the second without computing
            said = page.receive_json()
            assert said["type"] == "error"
            assert said["of"] == "run"
            assert "This takes more than 0.2 s of computing" in said["text"]
            assert len(said["text"]) <= 300
        page.send_text(question(CHAOS, generation=2))
        assert page.receive_json()["type"] == "run"


def test_a_run_has_a_number_of_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "STEPS", 3000)  # of which a second of this run takes 150
    with client_of(monkeypatch) as client, client.websocket_connect(SOCKET) as page:
        page.send_text(question(CHAOS, count=4096))
        assert page.receive_json()["type"] == "run"
        page.receive_bytes()
        end = page.receive_json()
    assert end["type"] == "end"
    assert end["outcome"] == "spent"
    assert 1.0 < end["t"] < 20.0
    assert "ended_spent" in json.loads((STATIC / "texts.en.json").read_text())


def test_a_run_that_takes_too_long_ends_for_one_that_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calculators, "_GRACE", 30.0)
    with (
        client_of(monkeypatch, share=2.0) as client,
        client.websocket_connect(SOCKET) as first,
        client.websocket_connect(SOCKET) as second,
    ):
        first.send_text(question(STIFF))
        (process,) = working(client)
        second.send_text(question(CHAOS))
        assert "others were waiting" in first.receive_json()["text"]
        assert second.receive_json()["type"] == "run"
        assert process.returncode is None  # stopped, and used again


def working(client: TestClient) -> list[Any]:
    """The processes that compute runs, once there are any."""
    runs = client.app.state.parts["runs"]  # type: ignore[attr-defined]
    until(lambda: runs._busy and all(one._process for one in runs._busy), 10)
    return [one._process for one in runs._busy]


def test_a_run_ends_with_its_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calculators, "_GRACE", 30.0)
    with client_of(monkeypatch) as client:
        runs = client.app.state.parts["runs"]  # type: ignore[attr-defined]
        with client.websocket_connect(SOCKET) as page:
            page.send_text(question(STIFF))
            (process,) = working(client)
            time.sleep(0.5)
        until(lambda: not runs._busy, 5)
        assert process.returncode is None  # stopped, and used again


def test_another_run_of_the_page_ends_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    with client_of(monkeypatch) as client, client.websocket_connect(SOCKET) as page:
        page.send_text(question(STIFF))
        page.send_text(question(CHAOS, generation=2))
        said = page.receive_json()
        assert (said["type"], said["generation"]) == ("run", 2)


def test_a_page_asks_only_so_much_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "QUESTIONS", 4)
    with client_of(monkeypatch) as client, client.websocket_connect(SOCKET) as page:
        for first in range(0, 600, 120):
            page.send_text(question(STIFF, first=first))
        assert page.receive_json()["text"] == "The page asks too much at once."


def test_a_map_or_a_table_has_seconds_to_compute(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MAPS", limits.Budget(1, 0.2, 60.0))
    with client_of(monkeypatch) as client, client.websocket_connect(SOCKET) as page:
        page.send_text(question({**STIFF, "type": "section", "surface": "zero"}))
        assert "This takes more than 0.2 s" in page.receive_json()["text"]
        page.send_text(question({**STIFF, "type": "diagram", "low": 0.01, "high": 0.1}))
        assert "This takes more than 0.2 s" in page.receive_json()["text"]
        answer = client.get("/api/run.csv", params={"run": json.dumps(STIFF), "seconds": 60})
        assert answer.status_code == 400
        assert "This takes more than 0.2 s" in answer.text


def test_a_film_of_a_run_has_seconds_to_compute(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("av")
    monkeypatch.setattr(limits, "RUNS", limits.Budget(1, 0.2, 60.0))
    monkeypatch.chdir(tmp_path)
    before = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(interruption.SpentError, match=r"more than 0\.2 s"):
            worker._render({"start": STIFF, "seconds": 60.0}, lambda _: None)
    finally:
        signal.signal(signal.SIGINT, before)
