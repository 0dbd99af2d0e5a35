"""What a command answers: text for a person, data for a machine."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class CommandResult:
    """The result of a command; `code` is its exit code."""

    text: str
    data: Mapping[str, Any]
    code: int = 0


def is_terminal() -> bool:
    """Whether somebody sees a progress bar."""
    return sys.stderr.isatty()


@contextmanager
def status_line() -> Iterator[Callable[[str], None]]:
    """Show on one line what is being done and for how long; nothing where nobody watches."""
    from tqdm import tqdm

    with tqdm(bar_format="{desc} [{elapsed}]", disable=not is_terminal(), leave=False) as bar:

        def tell(text: str) -> None:
            bar.set_description_str(text)
            bar.refresh()

        yield tell
