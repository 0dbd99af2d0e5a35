"""How long work is spread over threads and shown while it runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from udd.errors import ModelError

PROGRESS_THRESHOLD = 1000
"""With fewer jobs than this no progress bar is shown unasked."""


def thread_count(threads: int | None) -> int:
    """The checked number of threads; 0 stands for one per core."""
    if threads is None:
        return 0
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ModelError(f"threads must be a whole number from 1 on, not {threads!r}")
    return threads


@contextmanager
def progress_bar(
    jobs: int, unit: str, progress: bool | None
) -> Iterator[Callable[[int], Callable[[int], None] | None]]:
    """A progress bar on stderr.

    Gives a function from the number of jobs done before to the callback that the core calls with the number
    done since; the callback is None where no bar is shown.
    """
    shown = progress if progress is not None else jobs >= PROGRESS_THRESHOLD and sys.stderr.isatty()
    if not shown:
        yield lambda before: None
        return
    from tqdm import tqdm

    with tqdm(total=jobs, unit=f" {unit}", file=sys.stderr, dynamic_ncols=True) as line:

        def since(before: int) -> Callable[[int], None]:
            def show(done: int) -> None:
                line.update(before + done - line.n)

            return show

        yield since
        line.update(jobs - line.n)
