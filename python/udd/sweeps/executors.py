"""Work handed to anything that has `submit`."""

from __future__ import annotations

import queue
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor, CancelledError, Future
from typing import Any, Protocol

_WINDOW = 1000  # chunks handed over at once: enough for any cluster, and memory stays bounded
_TRIES = 3


class Executor(Protocol):
    """Anything with ``submit``: those of `concurrent.futures`, Dask's ``Client.get_executor()``."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        """Have it done."""


class ChunksLost(Exception):
    """Chunks that are not finished although nobody asked to stop; the message says why."""


def here(
    work: Callable[..., Any],
    chunks: Iterable[int],
    arguments: Callable[[int], tuple[Any, ...]],
    keep: Callable[[int, Any], None],
) -> None:
    """Work on the chunks one after the other in this process."""
    for chunk in chunks:
        keep(chunk, work(*arguments(chunk)))


def spread(
    executor: Executor,
    work: Callable[..., Any],
    chunks: Iterable[int],
    arguments: Callable[[int], tuple[Any, ...]],
    keep: Callable[[int, Any], None],
) -> None:
    """Work on the chunks with an executor; one whose worker died is handed over again.

    Raises
    ------
    ChunksLost
        The executor takes no more work, or a chunk's workers died again and again; all others are done.
    """
    waiting, tries = deque(chunks), Counter[int]()
    flying: dict[Future[Any], int] = {}
    landed: queue.SimpleQueue[Future[Any]] = queue.SimpleQueue()
    lost: list[str] = []
    # Dask gives the same call the same key, and a key that failed fails at once.
    run = uuid.uuid4().hex
    try:
        while waiting or flying:
            while waiting and len(flying) < _WINDOW:
                chunk = waiting[0]
                ticket = f"{run}-{chunk}-{tries[chunk]}"
                try:
                    future = executor.submit(_ticketed, ticket, work, *arguments(chunk))
                except RuntimeError as broken:  # or shut down
                    raise ChunksLost(f"the executor takes no more work ({_said(broken)})") from broken
                tries[waiting.popleft()] += 1
                flying[future] = chunk
                future.add_done_callback(landed.put)
            future = _next(landed)
            chunk = flying.pop(future)
            error = CancelledError() if future.cancelled() else future.exception()
            if error is None:
                keep(chunk, future.result())
            elif not _died(error):
                raise error
            elif tries[chunk] < _TRIES:
                waiting.append(chunk)
            else:
                lost.append(f"chunk {chunk} failed {_TRIES} times ({_said(error)})")
    finally:
        for future in flying:
            future.cancel()
    if lost:
        addition = f", as did {len(lost) - 1} more" if len(lost) > 1 else ""
        raise ChunksLost(lost[0] + addition)


def _ticketed(_ticket: str, work: Callable[..., Any], *arguments: Any) -> Any:
    return work(*arguments)


def _next(landed: queue.SimpleQueue[Future[Any]]) -> Future[Any]:
    while True:
        try:
            # Not for ever: on some systems Ctrl-C would wait as long.
            return landed.get(timeout=0.5)
        except queue.Empty:
            continue


def _died(error: BaseException) -> bool:
    """Return True if the worker or its machine failed, and not the work."""
    kinds = (BrokenExecutor, CancelledError, OSError, MemoryError, KeyboardInterrupt, SystemExit)
    # Dask's KilledWorker and the like, without importing Dask.
    return isinstance(error, kinds) or type(error).__module__.partition(".")[0] == "distributed"


def _said(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text[:200] if text else type(error).__name__
