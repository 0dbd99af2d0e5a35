"""Independent pieces of work, done side by side."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

From = TypeVar("From")
To = TypeVar("To")


def parallel_map(work: Callable[[From], To], pieces: Iterable[From]) -> list[To]:
    """Do the same to every piece, on all cores; the results in the pieces' order.

    The core works without Python's lock, and its own threads do not fill the cores: a solve has parts that go
    frame by frame. A time limit of the caller also holds in the threads.
    """
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            limits = [(copy_context(), piece) for piece in pieces]
            return list(pool.map(lambda limit: limit[0].run(work, limit[1]), limits))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
