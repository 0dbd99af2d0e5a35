"""The first steps of every process that the server starts."""

from __future__ import annotations

import contextlib
import os
import sys
import threading

from . import limits


def limit(cpu_seconds: int | None = None) -> None:
    """Limit the memory of this process and perhaps its processor time, where the system can; be nice."""
    with contextlib.suppress(AttributeError, OSError):  # Windows has no os.nice
        os.nice(5)
    if sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (limits.MEMORY, limits.MEMORY))
    if cpu_seconds is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 5))


def end_with_server() -> None:
    """End this process when its input ends: the server keeps the other end open for as long as it lives."""

    def wait() -> None:
        while os.read(0, 1 << 12):
            pass
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
