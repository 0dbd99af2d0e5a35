"""One queue of jobs, each in a process and a folder of its own; any can be cancelled."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import secrets
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from udd.errors import UddError

from . import limits, wire

Send = Callable[[dict[str, Any] | bytes], None]

_LINE = 8 << 20  # bytes of a message from a job
ENDED = ("done", "failed", "cancelled")
REFUSED = "refused.json"  # of a failed job: frames to click on, for another job with the same film


@dataclass
class Job:
    """A job and its state.

    Attributes
    ----------
    asked : dict
        The question to the process.
    state : str
        ``"waiting"``, ``"running"``, ``"done"``, ``"failed"`` or ``"cancelled"``.
    stages : list of str
        Its reports of progress, in order.
    answer : dict
        Its result, or ``{"error": sentence}``.
    """

    asked: dict[str, Any]
    folder: Path
    id: str = field(default_factory=lambda: secrets.token_hex(8))
    state: str = "waiting"
    stages: list[str] = field(default_factory=list)
    answer: dict[str, Any] = field(default_factory=dict)
    watchers: set[Send] = field(default_factory=set)
    process: asyncio.subprocess.Process | None = None
    killed: bool = False

    def said(self) -> dict[str, Any]:
        """Return its state as a message for pages."""
        return {
            "type": "job",
            "job": self.id,
            "kind": self.asked["kind"],
            "state": self.state,
            "stages": self.stages,
            "answer": self.answer,
        }

    def tell(self) -> None:
        """Send its state to the pages that watch it."""
        for send in list(self.watchers):
            send(self.said())

    def file(self, name: str) -> Path | None:
        """One of the files that it made, by a name that it gave."""
        return self.folder / "out" / name if name in self.part_names else None

    @property
    def part_names(self) -> set[str]:
        """Names of the files that it made."""
        return {part["name"] for part in self.answer.get("parts", ())}


class Jobs:
    """The queue; one job runs at a time."""

    def __init__(self) -> None:
        self.jobs: dict[str, Job] = {}
        self._queue: asyncio.Queue[Job | None] = asyncio.Queue()
        self._task: asyncio.Task[None] | None = None

    def submit(self, asked: dict[str, Any], folder: Path) -> Job:
        """Queue a job; the oldest that has ended makes room.

        Raises
        ------
        UddError
            Too many are waiting.
        """
        ended = [job for job in self.jobs.values() if job.state in ENDED]
        while len(self.jobs) >= limits.JOBS and ended:
            self.forget(ended.pop(0))
        if len(self.jobs) >= limits.JOBS:
            shutil.rmtree(folder, ignore_errors=True)
            raise UddError("Too many jobs are waiting: cancel one.")
        job = Job(asked, folder)
        self.jobs[job.id] = job
        self._queue.put_nowait(job)
        return job

    def cancel(self, job: Job) -> None:
        """Stop a job, whether it waits or runs."""
        if job.state in ENDED:
            return
        job.state = "cancelled"
        _kill(job)
        _empty(job)
        job.tell()

    def forget(self, job: Job) -> None:
        """Drop a job with all that it made."""
        self.cancel(job)
        self.jobs.pop(job.id, None)
        shutil.rmtree(job.folder, ignore_errors=True)

    async def __aenter__(self) -> Jobs:
        self._task = asyncio.create_task(self._work())
        return self

    async def __aexit__(self, *_: object) -> None:
        for job in list(self.jobs.values()):
            self.forget(job)
        if self._task is not None:
            # Not cancelled: the process of a job that was killed is to be waited for.
            self._queue.put_nowait(None)
            await self._task

    async def _work(self) -> None:
        while (job := await self._queue.get()) is not None:
            if job.state != "waiting":
                continue
            job.state = "running"
            job.tell()
            # No process can be started, its folder is gone, or it broke off within a word.
            with contextlib.suppress(OSError, ValueError):
                await _run(job)
            if job.state == "running":  # it ended without a word
                job.state = "failed"
                job.answer = {
                    "error": "The job ended early: it took too much memory or time, or its file broke it."
                }
            _empty(job)
            job.tell()


async def _run(job: Job) -> None:
    job.process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-P", "-m", "udd.app.worker"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=job.folder,
        limit=_LINE,
    )
    assert job.process.stdin is not None and job.process.stdout is not None
    try:
        if job.state == "running":  # it may have been cancelled meanwhile
            await _talk(job, job.process.stdin, job.process.stdout)
    finally:
        _kill(job)
        await job.process.wait()


async def _talk(job: Job, to: asyncio.StreamWriter, back: asyncio.StreamReader) -> None:
    to.write((json.dumps(job.asked) + "\n").encode())
    with contextlib.suppress(ConnectionError):
        await to.drain()  # and left open: the process ends with its input
    async for line in back:
        if job.state != "running":
            break
        _take(job, json.loads(line))


def _take(job: Job, message: dict[str, Any]) -> None:
    if "say" in message:
        job.stages.append(str(message["say"]))
        job.tell()
    elif "frame" in message:
        picture = wire.frame({"job": job.id, **message["frame"]}, base64.b64decode(message["jpeg"]))
        for send in list(job.watchers):
            send(picture)
    elif "done" in message:
        job.state, job.answer = "done", message["done"]
    elif "error" in message:
        parts = message.get("parts", [])
        job.state, job.answer = "failed", {"error": str(message["error"]), "parts": parts}


def _kill(job: Job) -> None:
    # Once only: a second signal would take the exit status away from asyncio.
    if job.process is not None and job.process.returncode is None and not job.killed:
        job.killed = True
        with contextlib.suppress(ProcessLookupError):
            job.process.kill()


def _empty(job: Job) -> None:
    """Delete what was uploaded, and the folder of a job that has made nothing; keep a film for clicks."""
    if REFUSED in job.part_names:
        return
    if job.state == "done" or (job.state == "failed" and job.answer.get("parts")):
        (job.folder / job.asked.get("file", "none")).unlink(missing_ok=True)
    else:
        shutil.rmtree(job.folder, ignore_errors=True)
