"""Connections without a request, or too many: the page answers the others and logs little."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import threading
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")
from websockets.sync.client import connect
from websockets.typing import Origin

from app_for_tests import CHAOS, HALF, TOKEN, question, served, until
from udd.app import connections, limits, server

STATES: list[Any] = []  # of the servers so far
STATIC = Path(server.__file__).parent / "static"


@contextlib.contextmanager
def listening(monkeypatch: pytest.MonkeyPatch, **changed: Any) -> Iterator[tuple[str, int]]:
    """The address of a server in a thread, with other limits."""
    for name, value in changed.items():
        monkeypatch.setattr(limits, name, value)
    with socket.create_server(("127.0.0.1", 0)) as made:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        at: tuple[str, int] = made.getsockname()
        app = connections.server_of(server.make_app(TOKEN, [f"127.0.0.1:{at[1]}"]))
        thread = threading.Thread(target=app.run, kwargs={"sockets": [made]})
        thread.start()
        try:
            until(lambda: app.started, 10)
            STATES.append(app.server_state)
            yield at
        finally:
            app.should_exit = True
            thread.join(10)


def page_of(at: tuple[str, int]) -> int:
    with urllib.request.urlopen(f"http://127.0.0.1:{at[1]}/?token={TOKEN}", timeout=10) as answer:
        status: int = answer.status
        return status


def is_closed(made: socket.socket) -> bool:
    """Return True if the other side has closed the connection."""
    made.setblocking(False)
    try:
        while data := made.recv(4096):
            assert data
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


@pytest.mark.parametrize("sent", [b"", HALF, HALF + b"\r\n" + HALF])
def test_a_connection_that_says_little_is_closed(monkeypatch: pytest.MonkeyPatch, sent: bytes) -> None:
    with listening(monkeypatch, PAUSE=0.4) as at, socket.create_connection(at) as made:
        made.sendall(sent)
        time.sleep(0.1)
        if sent.count(b"GET") > 1:
            assert made.recv(4096).startswith(b"HTTP/1.1 403 ")
        began, trickled = time.monotonic(), 0
        while time.monotonic() - began < 5 and not is_closed(made):
            with contextlib.suppress(OSError):
                trickled += made.send(b"x")  # a byte now and then does not keep it open
            time.sleep(0.05)
        assert trickled > 1
        assert time.monotonic() - began < 3.0


def test_an_answer_that_nobody_reads_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    with listening(monkeypatch, PAUSE=0.4) as at, socket.socket() as made:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        made.connect(at)
        made.sendall(f"GET /static/style.css HTTP/1.1\r\nhost: 127.0.0.1:{at[1]}\r\n\r\n".encode() * 100)
        until(lambda: STATES[-1].total_requests, 10)
        until(lambda: not STATES[-1].connections, 10)
        received = 0
        made.settimeout(5)
        with contextlib.suppress(ConnectionError):
            while data := made.recv(1 << 16):
                received += len(data)
    assert 4096 < received < 50 * (STATIC / "style.css").stat().st_size


def test_a_websocket_stays_open(monkeypatch: pytest.MonkeyPatch) -> None:
    with listening(monkeypatch, PAUSE=0.3) as at:
        name = f"127.0.0.1:{at[1]}"
        with connect(f"ws://{name}/api/socket?token={TOKEN}", origin=Origin(f"http://{name}")) as page:
            time.sleep(1.0)
            page.send(question(CHAOS))
            assert json.loads(page.recv(20))["type"] == "run"


@pytest.mark.parametrize("limit", ["CONNECTIONS", "CLIENT_CONNECTIONS"])
def test_too_many_connections_close_those_that_wait(monkeypatch: pytest.MonkeyPatch, limit: str) -> None:
    with listening(monkeypatch, **{limit: 8}) as at, contextlib.ExitStack() as stack:
        half = [stack.enter_context(socket.create_connection(at)) for _ in range(40)]
        until(lambda: sum(map(is_closed, half)) >= 32, 5)
        assert page_of(at) == 200
        assert not is_closed(half[-1])  # the newest ones


def test_connections_at_work_are_not_closed_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    with listening(monkeypatch, CLIENT_CONNECTIONS=2) as at, contextlib.ExitStack() as stack:
        name = f"127.0.0.1:{at[1]}"
        for _ in range(2):
            stack.enter_context(
                connect(f"ws://{name}/api/socket?token={TOKEN}", origin=Origin(f"http://{name}"))
            )
        with socket.create_connection(at, 5) as made:
            assert made.recv(100).startswith(b"HTTP/1.1 503 ")


def test_half_open_connections_do_not_stop_the_page(tmp_path: Path) -> None:
    with served(tmp_path / "log", files=256) as app, contextlib.ExitStack() as stack:
        for _ in range(600):
            with contextlib.suppress(OSError):
                stack.enter_context(app.half_open())
        assert app.page() == 200
        assert app.end() < 2.0
        log = (tmp_path / "log").read_text()
    assert len(log.splitlines()) < 8, log[:2000]


def test_a_page_without_files_to_open_comes_back(tmp_path: Path) -> None:
    with served(tmp_path / "log", files=48) as app, contextlib.ExitStack() as stack:
        for _ in range(100):
            with contextlib.suppress(OSError):
                stack.enter_context(app.half_open())
        assert app.page() == 200
    log = (tmp_path / "log").read_text()
    assert len(log.splitlines()) < 8, log[:2000]


def test_the_same_line_is_logged_once_a_minute() -> None:
    once = connections.OncePerMinute()

    def passes(text: str) -> bool:
        return bool(once.filter(logging.LogRecord("udd", logging.WARNING, "", 0, text, None, None)))

    assert passes("Exception in callback 0x7f01")
    assert not passes("Exception in callback 0x7f02")
    assert passes("Invalid HTTP request received.")
