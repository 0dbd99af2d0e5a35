"""Many pages that ask the same, and a class that only simulates."""

from __future__ import annotations

import asyncio
import json
import os
import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app_for_tests import CHAOS, HOST, ORIGIN, SOCKET, TOKEN, question
from udd.app import limits, server
from udd.app.calculators import Calculators
from udd.app.shared_answers import SharedAnswers
from udd.errors import UddError


class Counted:
    """Work that is counted, ends when it is let go, and notes that it was cancelled."""

    def __init__(self, size: int = 1) -> None:
        self.size = size
        self.calls = 0
        self.cancelled = 0
        self.go = asyncio.Event()

    async def __call__(self) -> tuple[str, int]:
        self.calls += 1
        try:
            await self.go.wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise
        return "answer", self.size


def test_equal_questions_share_one_computation() -> None:
    async def run() -> None:
        answers, work = SharedAnswers(100), Counted()
        both = [asyncio.create_task(answers.of(b"q", work)) for _ in range(2)]
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        both[0].cancel()  # the other one still waits
        work.go.set()
        assert await both[1] == "answer"
        assert await answers.of(b"q", work) == "answer"
        assert (work.calls, work.cancelled) == (1, 0)

    asyncio.run(run())


def test_work_ends_when_all_who_wait_have_gone() -> None:
    async def run() -> None:
        answers, work = SharedAnswers(100), Counted()
        both = [asyncio.create_task(answers.of(b"q", work)) for _ in range(2)]
        await asyncio.sleep(0.01)
        for task in both:
            task.cancel()
        await asyncio.wait(both)
        assert work.cancelled == 1
        work.go.set()
        assert await answers.of(b"q", work) == "answer"
        assert work.calls == 2

    asyncio.run(run())


def test_the_oldest_answers_make_room() -> None:
    async def run() -> None:
        answers, work = SharedAnswers(40), Counted(10)
        work.go.set()
        for key in (b"1", b"2", b"3", b"4", b"1", b"5", b"1", b"2"):
            await answers.of(key, work)
        assert work.calls == 6  # "1" was used lately and is kept, "2" made room for "5"
        large = Counted(11)
        large.go.set()
        for _ in range(2):
            await answers.of(b"large", large)
        assert large.calls == 2

    asyncio.run(run())


def test_an_error_is_not_kept() -> None:
    async def run() -> None:
        answers = SharedAnswers(40)

        async def fails() -> Any:
            raise UddError("no")

        for _ in range(2):
            with pytest.raises(UddError):
                await answers.of(b"q", fails)

    asyncio.run(run())


def test_short_questions_start_no_more_processes_than_cores() -> None:
    """Thirty pages started sixteen processes, each of which imports udd."""

    async def run() -> None:
        pool = Calculators(limits.RUNS)
        started: set[int] = set()

        async def ask(k: int) -> None:
            await pool.ask(divmod, k, 7)
            started.update(c._process.pid for c in (*pool._idle, *pool._busy) if c._process)

        try:
            await asyncio.gather(*(ask(k) for k in range(30)))
            assert 1 <= len(started) <= max(2, os.cpu_count() or 1) + 2
        finally:
            await pool.close()

    asyncio.run(run())


def test_slow_imports_start_no_more_processes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """On a busy machine an import takes seconds: that is no long question."""
    (tmp_path / "sitecustomize.py").write_text("import time; time.sleep(2.0)\n", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))

    async def run() -> None:
        pool = Calculators(limits.RUNS)
        try:
            asked = [asyncio.create_task(pool.ask(divmod, k, 7)) for k in range(30)]
            await asyncio.sleep(1.8)
            assert len(pool._busy) == pool._usual
            assert await asyncio.gather(*asked) == [divmod(k, 7) for k in range(30)]
        finally:
            await pool.close()

    asyncio.run(run())


def test_long_questions_do_not_hold_up_short_ones() -> None:
    async def run() -> None:
        pool = Calculators(limits.Budget(processes=6, seconds=60.0, share=60.0))
        await asyncio.gather(*(pool.prepare() for _ in range(pool._usual)))
        long = [asyncio.create_task(pool.ask(time.sleep, 30.0 + k)) for k in range(pool._usual)]
        try:
            await asyncio.sleep(0.2)
            assert await asyncio.wait_for(pool.ask(divmod, 9, 7), 15) == (1, 2)
        finally:
            for task in long:
                task.cancel()
            await pool.close()

    asyncio.run(run())


def class_of(monkeypatch: pytest.MonkeyPatch) -> TestClient:
    monkeypatch.setattr(limits, "CLASS_PAGES", 2)
    app = server.make_app(TOKEN, [HOST], classroom=True)
    return TestClient(app, base_url=ORIGIN, headers={"origin": ORIGIN, "x-udd-token": TOKEN})


def test_a_class_simulates_and_sends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    with class_of(monkeypatch) as client:
        assert client.get("/api/catalogue").json()["classroom"] is True
        for path in ("/api/table", "/api/jobs/film", "/api/jobs/sample", "/api/jobs/render"):
            answer = client.post(path, content=b"t,Omega\n0,1\n")
            assert answer.status_code == 403
            assert "started for a class" in answer.text
        assert client.get("/api/jobs/x/report.html").status_code == 403
        with client.websocket_connect(SOCKET) as page:
            page.send_text(question(CHAOS))
            assert page.receive_json()["type"] == "run"
        run = {"run": json.dumps(CHAOS), "seconds": 1}
        assert client.get("/api/run.csv", params=run).status_code == 200


def test_a_device_opens_only_so_many_pages_in_a_class(monkeypatch: pytest.MonkeyPatch) -> None:
    with class_of(monkeypatch) as client:
        with client.websocket_connect(SOCKET) as one, client.websocket_connect(SOCKET):
            with client.websocket_connect(SOCKET) as third:
                assert "the most in a class" in third.receive_json()["text"]
                with pytest.raises(WebSocketDisconnect) as refused:
                    third.receive_json()
            assert refused.value.code == 1013
            one.send_text(question(CHAOS))
            assert one.receive_json()["type"] == "run"
        with client.websocket_connect(SOCKET) as again:  # the others were closed
            again.send_text(question(CHAOS))
            assert again.receive_json()["type"] == "run"
