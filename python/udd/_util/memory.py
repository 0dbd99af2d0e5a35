"""Memory is asked for before it is taken: a process that takes more than there is ends without a word."""

from __future__ import annotations

from math import prod

from udd import _core

_MOST = 10**300  # as a float


def require_memory(what: str, *counts: float, itemsize: int = 8) -> None:
    """Refuse an array that does not fit into free memory.

    Parameters
    ----------
    what : str
        The content in the plural, for the message: ``"10 runs"``.
    *counts : int or float
        Its shape. A count that is not rounded yet may be infinite.
    itemsize : int
        Bytes of an element, with those of intermediate results.

    Raises
    ------
    MemoryError
        There is no room for it.

    Examples
    --------
    >>> from udd._util.memory import require_memory
    >>> require_memory("3 states", 3, 4)
    """
    _core.require_memory(what, float(min(prod(min(count, _MOST) for count in counts) * itemsize, _MOST)))
