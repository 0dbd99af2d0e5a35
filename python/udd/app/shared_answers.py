"""Answers that equal questions share: while one of them is computed, and afterwards."""

from __future__ import annotations

import asyncio
import contextlib
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any


@dataclass
class _Work:
    """A computation and how many questions wait for it."""

    task: asyncio.Task[Any]
    waiting: int = 0


class SharedAnswers:
    """Answers by the bytes of their question.

    A class that opens the same link asks the same thirty times. The answer is computed once, as the bits of a
    result do not depend on who asks.

    Parameters
    ----------
    room : int
        Bytes of answers that are kept; one of more than a quarter of them is not.
    """

    def __init__(self, room: int) -> None:
        self._room = room
        self._used = 0
        self._kept: OrderedDict[bytes, tuple[Any, int]] = OrderedDict()
        self._works: dict[bytes, _Work] = {}

    async def of(self, question: bytes, compute: Callable[[], Awaitable[tuple[Any, int]]]) -> Any:
        """Return the answer to a question.

        Parameters
        ----------
        question : bytes
            Equal for equal questions.
        compute : callable
            Returns the answer and its bytes; called if nothing is kept and nobody computes it. It is
            cancelled when all who wait for it are.
        """
        if question in self._kept:
            self._kept.move_to_end(question)
            return self._kept[question][0]
        work = self._works.get(question)
        if work is None:
            work = _Work(asyncio.ensure_future(self._compute(question, compute)))
            self._works[question] = work
        work.waiting += 1
        try:
            return await asyncio.shield(work.task)
        except asyncio.CancelledError:
            if work.waiting == 1:
                self._forget(question, work)
                work.task.cancel()
                with contextlib.suppress(asyncio.CancelledError, Exception):
                    await work.task
            raise
        finally:
            work.waiting -= 1

    async def _compute(self, question: bytes, compute: Callable[[], Awaitable[tuple[Any, int]]]) -> Any:
        task = asyncio.current_task()
        try:
            answer, size = await compute()
        finally:
            work = self._works.get(question)
            if work is not None and work.task is task:
                self._forget(question, work)
        if size <= self._room // 4:
            self._kept[question] = answer, size
            self._used += size
        while self._used > self._room:
            self._used -= self._kept.popitem(last=False)[1][1]
        return answer

    def _forget(self, question: bytes, work: _Work) -> None:
        if self._works.get(question) is work:
            del self._works[question]
