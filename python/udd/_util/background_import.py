"""Import slow modules while the core computes."""

from __future__ import annotations

import contextlib
import importlib
from threading import Thread


def importing(*modules: str) -> None:
    """Start to import modules that will be needed; who needs one before it is there waits for it.

    Those that cannot be are left to whoever asks for them, who will hear why.
    """

    def work() -> None:
        for name in modules:
            with contextlib.suppress(Exception):
                importlib.import_module(name)

    Thread(target=work, name="udd imports").start()
