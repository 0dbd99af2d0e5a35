"""One page's WebSocket: what it asks for, and the answers.

A page asks for pieces of a run, and for maps; each question carries a generation, which the answer repeats.
The server keeps nothing that the page could not ask for again, so a page whose connection dropped goes on
where it was.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Mapping
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from udd._util.validation import number
from udd.errors import UddError

from . import limits, maps, wire
from .calculators import Calculators
from .error_text import sentence
from .growing_run import RATE, Runs, columns_of, grown
from .interruption import SpentError
from .jobs import Jobs, Send
from .spec import message_of, start_of, whole

_WAITING = 64  # messages that a page may be behind


class Page:
    """The open questions of one connected page."""

    def __init__(self, socket: WebSocket, jobs: Jobs, calculators: Mapping[str, Calculators]) -> None:
        self._socket = socket
        self._jobs = jobs
        self._calculators = calculators
        self._runs = Runs()
        self._out: asyncio.Queue[dict[str, Any] | bytes] = asyncio.Queue(_WAITING)
        self._open: dict[asyncio.Task[None], tuple[str, int]] = {}  # questions by kind and generation
        self._turns = {kind: asyncio.Lock() for kind in ("run", "section", "diagram")}

    async def serve(self) -> None:
        """Answer until the page is gone; what it asked for ends with it."""
        await self._socket.accept()
        loops = [asyncio.create_task(self._reading()), asyncio.create_task(self._sending())]
        try:
            await asyncio.wait(loops, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for job in self._jobs.jobs.values():
                job.watchers.discard(self.post)
            tasks = [*loops, *self._open]
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)

    def post(self, message: dict[str, Any] | bytes) -> None:
        """Send without waiting; a page that is far behind misses pictures, not words."""
        if self._out.full() and isinstance(message, bytes):
            return
        if self._out.full():
            self._out.get_nowait()
        self._out.put_nowait(message)

    async def _sending(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                message = await self._out.get()
                if isinstance(message, bytes):
                    await self._socket.send_bytes(message)
                else:
                    await self._socket.send_text(json.dumps(message))

    async def _reading(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, KeyError):  # KeyError: a binary message
            while True:
                await self._answer(await self._socket.receive_text())

    async def _answer(self, text: str) -> None:
        said: dict[str, Any] = {}
        try:
            if len(text) > limits.MESSAGE:
                raise UddError("the message is too long")
            said = message_of(text)
            kind = str(said.get("type"))
            handlers: dict[str, Callable[[dict[str, Any]], Any]] = {
                "run": self._run,
                "section": self._section,
                "diagram": self._diagram,
                "watch": self._watch,
                "cancel": self._cancel,
            }
            if kind not in handlers:
                raise UddError(f"no message is called {kind!r}")
            await handlers[kind](said)
        except (UddError, OverflowError) as error:
            await self._out.put(_refused(said, error))

    async def _run(self, said: dict[str, Any]) -> None:
        generation = whole(said, "generation", 0, 2**32 - 1)
        which = whole(said, "run", 0, 1)
        first = whole(said, "first", 0, 2**31)
        count = whole(said, "count", 1, limits.SAMPLES)
        start = start_of(said)
        if first > limits.MODEL_SECONDS * RATE:
            raise UddError("the run is not that long")

        async def answers() -> AsyncIterator[dict[str, Any] | bytes]:
            run = self._runs.of(start)
            while states := run.lacks(first + count):
                try:
                    run.take(states, await self._calculators["runs"].ask(grown, start, states))
                except SpentError as error:
                    run.end(error)
            rows, last = run.piece(first, count)
            if first == 0:
                about = {"columns": columns_of(start.model), "motor": run.motor}
                yield {"type": "run", "generation": generation, "run": which, **about}
            yield wire.piece(generation, which, first, rows, last)
            if last:
                end = {"outcome": run.outcome, "t": float(run.t[-1]), "count": len(run.t)}
                yield {"type": "end", "generation": generation, "run": which, **end}

        self._begin(said, generation, answers())

    async def _section(self, said: dict[str, Any]) -> None:
        generation = whole(said, "generation", 0, 2**32 - 1)
        start, surface = start_of(said), str(said.get("surface"))
        count = whole(said, "count", 2, limits.POINTS)

        async def answers() -> AsyncIterator[dict[str, Any] | bytes]:
            done = 0
            while done < count:
                done = min(count, max(200, 4 * done))  # each call computes the earlier ones again
                points, outcome = await self._calculators["sections"].ask(maps.section, start, surface, done)
                yield wire.section(generation, points)
                yield {"type": "section", "generation": generation, "found": len(points), "outcome": outcome}
                if outcome != "finished":
                    return

        self._begin(said, generation, answers())

    async def _diagram(self, said: dict[str, Any]) -> None:
        generation = whole(said, "generation", 0, 2**32 - 1)
        start = start_of(said)
        low, high = (number(name, said.get(name)) for name in ("low", "high"))
        if not 0 < low < high:
            raise UddError("a diagram needs 0 < low < high")

        async def answers() -> AsyncIterator[dict[str, Any] | bytes]:
            for count in maps.VALUES:
                answer = await self._calculators["maps"].ask(maps.diagram, start, low, high, count)
                yield wire.diagram(generation, answer)
                answer = await self._calculators["maps"].ask(maps.exponents, start, low, high, count)
                yield wire.exponents(generation, answer)
            yield {"type": "diagram", "generation": generation}

        self._begin(said, generation, answers())

    def _begin(
        self, said: dict[str, Any], generation: int, answers: AsyncIterator[dict[str, Any] | bytes]
    ) -> None:
        """Send answers one by one, after those to earlier questions of the kind and generation.

        A question of another generation ends those.
        """
        kind = str(said["type"])
        for task, (other, older) in self._open.items():
            if other == kind and older != generation:
                task.cancel()
        if len(self._open) >= limits.QUESTIONS:
            raise UddError("the page asks too much at once")

        async def work() -> None:
            try:
                async with self._turns[kind]:
                    async for answer in answers:
                        await self._out.put(answer)
            except (UddError, OverflowError) as error:
                await self._out.put(_refused(said, error))

        task = asyncio.create_task(work())
        self._open[task] = (kind, generation)
        task.add_done_callback(self._open.pop)

    async def _watch(self, said: dict[str, Any]) -> None:
        job = self._jobs.jobs.get(str(said.get("job")))
        if job is None:
            raise UddError("there is no such job any more")
        job.watchers.add(self.post)
        await self._out.put(job.said())

    async def _cancel(self, said: dict[str, Any]) -> None:
        job = self._jobs.jobs.get(str(said.get("job")))
        if job is not None:
            self._jobs.cancel(job)


def _refused(said: dict[str, Any], error: Exception) -> dict[str, Any]:
    return {
        "type": "error",
        "of": said.get("type"),
        "generation": said.get("generation"),
        "text": sentence(error),
    }


__all__ = ["Page", "Send"]
