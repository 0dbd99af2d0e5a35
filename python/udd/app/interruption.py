"""Work in the main thread of a process that another thread can stop, within a budget of processor time."""

from __future__ import annotations

import _thread
import signal
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from udd.errors import UddError

T = TypeVar("T")

_SPENT = (
    "this takes more than {:g} s of computing, the most that the page gives it; are the equations stiff, for "
    "example through a large friction?"
)
_LOOK_EVERY = 0.05  # s between two looks at the processor time


class SpentError(UddError):
    """The work took all the computing time that it may have."""


class StoppedError(UddError):
    """Another process stopped the work."""


class Interruptible:
    """Work of the main thread that other threads can stop.

    Python runs the handlers of signals in the main thread only, and the core's loops hear them within 20 ms.
    """

    def __init__(self) -> None:
        self._reason: BaseException | None = None
        self._busy = False
        signal.signal(signal.SIGINT, self._interrupted)

    def run(self, work: Callable[[], T], seconds: float) -> T:
        """Return the result of the work.

        Parameters
        ----------
        work : callable
            Called without arguments.
        seconds : float
            Processor time, summed over all threads, that it may take.

        Raises
        ------
        SpentError
            It took more.
        BaseException
            The reason that `stop` was given.
        """
        self._reason = None
        done = threading.Event()
        watch = threading.Thread(target=self._watch, args=(seconds, done), daemon=True)
        watch.start()
        try:
            try:
                self._busy = True
                return work()
            finally:
                self._busy = False
        finally:
            done.set()
            watch.join()

    def stop(self, reason: BaseException) -> None:
        """Make the work raise the reason; called from another thread. Without work, do nothing."""
        self._reason = reason
        _thread.interrupt_main()

    def _interrupted(self, *_: object) -> None:
        if self._busy and self._reason is not None:
            self._busy = False
            raise self._reason

    def _watch(self, seconds: float, done: threading.Event) -> None:
        end = time.process_time() + seconds
        while not done.wait(_LOOK_EVERY):
            if time.process_time() > end:
                self.stop(SpentError(_SPENT.format(seconds)))
                return
