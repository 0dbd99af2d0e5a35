"""The page's server as tests talk to it."""

from __future__ import annotations

import contextlib
import json
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from starlette.testclient import TestClient
from websockets.sync.client import connect
from websockets.typing import Origin

from udd.app import server

HOST, TOKEN = "127.0.0.1:8765", "sesame"
ORIGIN = f"http://{HOST}"
SOCKET = f"ws://{HOST}/api/socket"
CHAOS: dict[str, Any] = {"model": {"kind": "disk", "W": 0.03}, "state": [0.0, 0.001, 0.04, 0.0]}
STIFF = {**CHAOS, "model": {"kind": "disk", "W": 0.03, "k0": 1e6}}
HALF = b"GET / HTTP/1.1\r\nhost: x\r\n"


@pytest.fixture
def client() -> Iterator[TestClient]:
    app = server.make_app(TOKEN, [HOST, "localhost:8765"])
    headers = {"origin": ORIGIN, "x-udd-token": TOKEN}
    with TestClient(app, base_url=ORIGIN, headers=headers) as opened:
        yield opened


def question(start: dict[str, Any], **more: int) -> str:
    about = {"type": "run", "generation": 1, "run": 0, "first": 0, "count": 120}
    return json.dumps({**about, **start, **more})


def until(condition: Callable[[], object], seconds: float) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come about in time"
        time.sleep(0.02)


class Served:
    """`udd app` as people start it."""

    def __init__(self, log: Path, files: int = 1024) -> None:
        def limit() -> None:
            import resource

            resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))

        command = [sys.executable, "-m", "udd", "app", "--no-browser", "--port", "0"]
        with log.open("w") as errors:
            self.process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=errors, text=True, preexec_fn=limit
            )
        assert self.process.stdout is not None
        self.link = self.process.stdout.readline().strip()
        self.at = urlsplit(self.link)

    def open(self) -> connect:
        where = f"ws://{self.at.netloc}/api/socket?{self.at.query}"
        return connect(where, origin=Origin(f"http://{self.at.netloc}"))

    def half_open(self, sent: bytes = HALF) -> socket.socket:
        made = socket.create_connection((self.at.hostname, self.at.port), 5)
        made.sendall(sent)
        return made

    def page(self) -> int:
        with urllib.request.urlopen(self.link, timeout=20) as answer:
            status: int = answer.status
            return status

    def end(self) -> float:
        """Press Ctrl-C; the seconds until it has ended."""
        began = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(30)
        return time.monotonic() - began


@contextlib.contextmanager
def served(log: Path, files: int = 1024) -> Iterator[Served]:
    if sys.platform == "win32":
        pytest.skip("needs limits of open files")
    item = Served(log, files)
    try:
        yield item
    finally:
        item.process.kill()
        item.process.wait(10)
        assert item.process.stdout is not None
        item.process.stdout.close()
