"""A process that computes for the pages: `python -m udd.app.calculator KIND`.

It reads questions from its input and writes answers to its output. Both are the length of a pickle, then the
pickle. A question has the seconds of processor time that it may take, a function of this package and its
arguments; a length of zero stops the work. The first length in its output is zero: its imports have ended.
Questions come from this package alone, never from a visitor.
"""

from __future__ import annotations

import importlib
import os
import pickle
import queue
import struct
import sys
import threading
from typing import Any, BinaryIO

from udd.errors import UddError

from . import child_process
from .interruption import Interruptible, StoppedError

LENGTH = struct.Struct("<Q")
_NEEDED = ("growing_run", "maps")


def main() -> None:
    """Answer questions until the input ends, which is when the server does."""
    source, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    child_process.limit()
    work = Interruptible()
    questions: queue.SimpleQueue[tuple[threading.Event, bytes]] = queue.SimpleQueue()
    # Before the imports: a process whose server has ended meanwhile must end too.
    threading.Thread(target=_listen, args=(source, work, questions), daemon=True).start()
    for module in _NEEDED:  # before the first question, which would wait for them
        importlib.import_module(f"{__package__}.{module}")
    if sys.argv[1:] == ["maps"]:
        sys.modules[f"{__package__}.maps"].warm_up()
    answers.write(LENGTH.pack(0))
    answers.flush()
    while True:
        stopped, question = questions.get()
        answer = pickle.dumps(_answer(work, stopped, *pickle.loads(question)))
        answers.write(LENGTH.pack(len(answer)))
        answers.write(answer)
        answers.flush()


def _listen(
    source: BinaryIO, work: Interruptible, questions: queue.SimpleQueue[tuple[threading.Event, bytes]]
) -> None:
    try:
        stopped = threading.Event()
        while True:
            (size,) = LENGTH.unpack(source.read(LENGTH.size))
            if size:
                stopped = threading.Event()
                questions.put((stopped, source.read(size)))
            else:
                stopped.set()  # for work that has not begun
                work.stop(StoppedError("the work was stopped"))
    except struct.error:  # the input has ended
        pass
    finally:
        os._exit(0)


def _answer(
    work: Interruptible, stopped: threading.Event, seconds: float, function: Any, arguments: tuple[Any, ...]
) -> Any:
    """Return the function's result, or the error that it raised."""

    def called() -> Any:
        if stopped.is_set():
            raise StoppedError("the work was stopped")
        return function(*arguments)

    try:
        return work.run(called, seconds)
    except MemoryError:
        return UddError("this takes more memory than the page gives it")
    except Exception as error:
        return error


if __name__ == "__main__":
    main()
