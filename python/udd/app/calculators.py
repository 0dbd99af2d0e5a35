"""The processes that compute for the pages, so that nothing that a visitor asks for holds up the server.

A process can be stopped at any moment, which a thread cannot. It answers one question at a time and is used
again; a question whose task is cancelled is stopped.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import pickle
import sys
from collections.abc import AsyncIterator, Callable
from typing import Any

from udd.errors import UddError

from . import limits
from .calculator import LENGTH
from .interruption import SpentError, StoppedError
from .shared_answers import SharedAnswers

_GRACE = 0.5  # s within which a process must stop its work
_LOOK_EVERY = 0.1  # s between two checks for a waiting question
_LONG = 0.5  # s that a question runs before another process is started for those that wait


class Calculators:
    """Processes for questions of one kind.

    As many as there are cores answer in turn. Further ones, up to the budget, start only if all of these have
    been at their questions for long: each costs the time of an import.

    Parameters
    ----------
    budget : limits.Budget
        How many there may be and what a question may take.
    kind : str
        The questions for which they prepare: ``"runs"``, ``"sections"`` or ``"maps"``.
    """

    def __init__(self, budget: limits.Budget, kind: str = "runs") -> None:
        self._budget = budget
        self._kind = kind
        self._usual = min(budget.processes, os.cpu_count() or 1)
        self._allowed = self._usual
        self._slots = asyncio.Semaphore(self._usual)
        self._idle: list[_Calculator] = []
        self._busy: set[_Calculator] = set()
        self._answers = SharedAnswers(limits.KEPT)

    async def ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function of this package returns in another process.

        Equal questions share one computation, and its answer as long as there is room for it.

        Parameters
        ----------
        function : callable
            A function at the top level of its module.
        *arguments
            What can be pickled.

        Raises
        ------
        SpentError
            It took more processor time than a question may, or others waited and it had had its share.
        UddError
            What the function raised; or the process ended.
        """
        key = pickle.dumps((function, arguments))
        return await self._answers.of(key, lambda: self._computed(function, arguments))

    async def _computed(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[Any, int]:
        """Return the answer and how many bytes it has."""
        async with self._slot():
            calculator = self._idle.pop() if self._idle else _Calculator(self._kind)
            self._busy.add(calculator)
            try:
                answer = await calculator.ask((self._budget.seconds, function, arguments))
            finally:
                self._busy.discard(calculator)
                if calculator.ready and len(self._idle) < self._usual:
                    self._idle.append(calculator)
                else:
                    calculator.kill()
        if isinstance(answer, StoppedError):
            answer = SpentError(
                "this took its share of computing time, and others were waiting; try again later"
            )
        if isinstance(answer, Exception):
            raise answer
        return answer, calculator.size

    async def prepare(self) -> None:
        """Start a process for the first question."""
        calculator = _Calculator(self._kind)
        await calculator.start()
        self._idle.append(calculator)

    async def close(self) -> None:
        """End all processes at once."""
        every = [*self._idle, *self._busy]
        for calculator in every:
            calculator.kill()
        await asyncio.gather(*(calculator.wait() for calculator in every))

    @contextlib.asynccontextmanager
    async def _slot(self) -> AsyncIterator[None]:
        """Wait for a turn, in the order of the questions."""
        turn = asyncio.ensure_future(self._slots.acquire())
        try:
            while not (await asyncio.wait({turn}, timeout=_LOOK_EVERY))[0]:
                self._make_room()
        except asyncio.CancelledError:
            if not turn.cancel():
                self._release()
            raise
        try:
            yield
        finally:
            self._release()

    def _make_room(self) -> None:
        """Allow another process if all are at long questions, or stop the longest once it had its share."""
        ages = [calculator.age for calculator in self._busy]
        if len(ages) < self._allowed or min(ages) < _LONG:
            return
        if self._allowed < self._budget.processes:
            self._allowed += 1
            self._slots.release()
            return
        oldest = min((c for c in self._busy if not c.stopping), key=lambda c: c.began, default=None)
        if oldest is not None and oldest.age > self._budget.share:
            oldest.stop()

    def _release(self) -> None:
        if self._allowed > self._usual:
            self._allowed -= 1
        else:
            self._slots.release()


class _Calculator:
    """One process."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._process: asyncio.subprocess.Process | None = None
        self._loop = asyncio.get_running_loop()
        self._killed = False
        self.began = 0.0
        self._prepared: float | None = None
        """The time at which its imports had ended."""
        self.stopping = False
        self.size = 0
        """Bytes of its last answer."""
        self.ready = False
        """True if it can take another question."""

    @property
    def age(self) -> float:
        """Seconds of its work at a question; the imports before the first one do not count."""
        if self._prepared is None:
            return 0.0
        return self._loop.time() - max(self.began, self._prepared)

    async def start(self) -> None:
        """Start the process, out of reach of the terminal's Ctrl-C: the server ends it."""
        try:
            self._process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", "udd.app.calculator", self._kind),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.DEVNULL,
                start_new_session=True,
            )
        except OSError as error:
            raise UddError(f"no process can be started: {error.strerror or error}") from None
        self.ready = True

    async def ask(self, question: tuple[Any, ...]) -> Any:
        """Return the answer; a cancelled question is stopped before this returns."""
        self.began, self.stopping = self._loop.time(), False
        if self._process is None:
            await self.start()
        self.ready = False
        answer = asyncio.ensure_future(self._answer(question))
        try:
            return await asyncio.shield(answer)
        except asyncio.CancelledError:
            self.stop()
            with contextlib.suppress(UddError):
                await answer
            raise

    def stop(self) -> None:
        """Make the process stop its work, or end it."""
        self.stopping = True
        self._write(b"")
        self._loop.call_later(_GRACE, self._give_up, self.began)

    def _give_up(self, began: float) -> None:
        if self.stopping and self.began == began and not self.ready:
            self.kill()

    async def _answer(self, question: tuple[Any, ...]) -> Any:
        assert self._process is not None and self._process.stdout is not None
        try:
            self._write(pickle.dumps(question))
            if self._prepared is None:
                await self._process.stdout.readexactly(LENGTH.size)
                self._prepared = self._loop.time()
            (size,) = LENGTH.unpack(await self._process.stdout.readexactly(LENGTH.size))
            answer = pickle.loads(await self._process.stdout.readexactly(size))
            self.size = size
        except (OSError, EOFError):
            if self.stopping:
                return StoppedError("the process was ended")
            raise UddError("the computation ended early: it took too much memory") from None
        self.ready = True
        return answer

    def _write(self, question: bytes) -> None:
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.write(LENGTH.pack(len(question)) + question)

    def kill(self) -> None:
        """End the process."""
        self.ready = False
        # Once only: a second signal would take the exit status away from asyncio.
        if self._process is not None and self._process.returncode is None and not self._killed:
            self._killed = True
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()

    async def wait(self) -> None:
        """Wait until the process has ended."""
        if self._process is not None:
            await self._process.wait()
