"""Slow results that several tests need: computed once per run, then read from disk."""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import udd

P = ParamSpec("P")
R = TypeVar("R")


@functools.cache
def version() -> str:
    """Hash of udd's files, the compiled module among them."""
    folder = Path(udd.__file__).parent
    state = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.suffix in {".py", ".so", ".pyd"}):
        state.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return state.hexdigest()


def folder() -> Path:
    """The run's folder, the same for all its processes; `conftest` puts it into the environment."""
    return Path(os.environ["UDD_TEST_CACHE"])


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock file; the system releases it if the process dies."""
    with path.open("a+b") as file:
        if os.name == "nt":
            import msvcrt

            while True:
                try:
                    msvcrt.locking(file.fileno(), msvcrt.LK_LOCK, 1)  # type: ignore[attr-defined]
                    break
                except OSError:  # after ten seconds it gives up
                    continue
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def key(*values: Any) -> str:
    """Hash of values that can be pickled; a file counts by its name and content."""
    state = hashlib.sha256(version().encode())
    for value in values:
        if isinstance(value, Path) and value.is_file():
            value = (value.name, value.read_bytes())
        # Pickled twice, since the first copy of a record may share objects that an equal record does not.
        state.update(pickle.dumps(pickle.loads(pickle.dumps(value))))
    return state.hexdigest()[:32]


def cached_on_disk(compute: Callable[P, R]) -> Callable[P, R]:
    """Return the function with its results cached for the run, by a hash of its arguments and of udd.

    Results and arguments must be such that pickle takes them; an argument that names a file is a `Path`. If
    two processes need the same result, the second one waits for the first one. Every caller gets a copy.
    """

    @functools.wraps(compute)
    def read(*args: P.args, **kwargs: P.kwargs) -> R:
        options = [entry for item in sorted(kwargs.items()) for entry in item]
        name = f"{compute.__name__}-{key(compute.__module__, compute.__qualname__, *args, *options)}"
        path = folder() / f"{name}.pickle"
        if not path.is_file():
            with locked(folder() / f"{name}.lock"):
                if not path.is_file():
                    part = path.with_suffix(f".{os.getpid()}")
                    part.write_bytes(pickle.dumps(compute(*args, **kwargs)))
                    part.replace(path)  # whole or not at all
        result: R = pickle.loads(path.read_bytes())
        return result

    return read
