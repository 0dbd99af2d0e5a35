"""Reading by compiled libraries, in a process that can open no file, with limits on memory and time."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from udd._util.child_process import ChildProcess
from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from .numpy_arrays import one_line_message

READER = str(Path(__file__).with_name("compiled_process.py"))
PATIENCE = 300.0  # s
# The libraries' own threads would take time to start, and none may be started later.
_ALONE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


@dataclass
class Content:
    """Columns of a file in their order (numbers or texts), their units, and the metadata of the file."""

    names: list[str] = field(default_factory=list)
    columns: list[Any] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    meta: dict[str, Any] = field(default_factory=dict)
    pieces: list[list[Any]] = field(default_factory=list)

    def take(self, name: str | int, column: Any, unit: str = "") -> None:
        """Add a column, or the next piece of one whose number is given."""
        if isinstance(name, int):
            self.pieces[name].append(column)
        else:
            self.names.append(name)
            self.units[name] = unit
            self.columns.append(column)

    def join(self) -> None:
        """Put the pieces of columns together."""
        while self.pieces:
            pieces = self.pieces.pop(0)
            words = any(isinstance(piece, list) for piece in pieces)
            self.columns.append(list(chain(*pieces)) if words else np.concatenate([np.empty(0), *pieces]))


def read(kind: str, what: str, raw: bytes, memory: MemoryLimit) -> Content:
    """Read a file's columns; `kind` is that of `compiled_process`, `what` the file in a sentence.

    Raises
    ------
    MeasurementError
        It is broken, refers to other files, or takes more than the limit.
    """
    child = ChildProcess(READER, kind, str(memory.left), environment=_ALONE, patience=PATIENCE)
    content = Content()
    try:
        child.send(raw)
        child.to.close()
        for said in _columns(child, memory, content):
            if "error" in said:
                raise MeasurementError(f"{what} cannot be read: {one_line_message(said['error'])}")
            if "exceeded" in said:
                raise memory.exceeded()
            content.meta = said["meta"]
            content.join()
            return content
    except MeasurementError:
        raise
    except (OSError, ValueError, KeyError, TypeError):
        pass  # it broke off within a word
    finally:
        child.end()
    raise MeasurementError(f"{what} cannot be read: it is broken")


def _columns(child: ChildProcess, memory: MemoryLimit, content: Content) -> Iterator[dict[str, Any]]:
    """Take in columns; yield the line that is none."""
    while line := child.line():
        said = json.loads(line)
        if "names" in said:
            content.names = said["names"]
            content.pieces = [[] for _ in content.names]
        elif "shape" in said:
            memory.take(8 * math.prod(said["shape"]))
            numbers = np.empty(said["shape"])
            if not child.fill(numbers):
                return
            content.take(said["name"], numbers, said["unit"])
        elif "words" in said:
            memory.check(said["words"])
            text = bytearray(said["words"])
            if not child.fill(text):
                return
            cells = json.loads(text)
            once = {cell: cell for cell in cells}
            memory.take(sum(64 + len(cell) for cell in once) + 8 * len(cells))
            content.take(said["name"], [once[cell] for cell in cells])
        else:
            yield said
            return
