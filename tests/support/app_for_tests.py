"""The page's server as tests talk to it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from udd.app import server

HOST, TOKEN = "127.0.0.1:8765", "sesame"
ORIGIN = f"http://{HOST}"
SOCKET = f"ws://{HOST}/api/socket"
CHAOS: dict[str, Any] = {"model": {"kind": "disk", "W": 0.03}, "state": [0.0, 0.001, 0.04, 0.0]}


@pytest.fixture
def client() -> Iterator[TestClient]:
    app = server.make_app(TOKEN, [HOST, "localhost:8765"])
    headers = {"origin": ORIGIN, "x-udd-token": TOKEN}
    with TestClient(app, base_url=ORIGIN, headers=headers) as opened:
        yield opened
