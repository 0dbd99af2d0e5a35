"""Options of the command line for the arguments of the package's functions."""

from __future__ import annotations

import re

#: Options of a table that is read, by the argument of `udd.read_measurement` that each one sets.
OPTIONS = {
    "columns": "--columns",
    "inputs": "--inputs",
    "rate": "--sampling",
    "repeated": "--repeated",
    "part": "--part",
    "limit": "--limit",
}

# A word of a sentence. An effect's parameter with such a name, as in "--effect x:rate=1", stays unchanged.
_NAME = f"(?<![^\\s(])({'|'.join(OPTIONS)})"
_ONE_COLUMN = re.compile(rf"{_NAME}=\{{'(\w+)': \.\.\.\}}")
_TEXT = re.compile(rf'{_NAME}="([^"]*)"')
_PLAIN = re.compile(r"[\w=.,-]*$")
_WORD = re.compile(rf"{_NAME}=(\w+)")
_BARE = re.compile(r"(?<![^\s(])rate=(?!\S)")
_REFUSED = "is for files|must be a positive number of samples|must be a whole number from|must look like"
_SUBJECT = re.compile(rf"{_NAME}(?= (?:{_REFUSED}) )")
_START = re.compile(r"state0=\{([^}]*)\}")


def in_options(message: str) -> str:
    """Replace Python's arguments in a message by options of the command line.

    Examples
    --------
    >>> in_options('repeats the time (repeated="first" keeps the first of such rows)')
    'repeats the time (--repeated first keeps the first of such rows)'
    >>> in_options("say how many a second, rate=")
    'say how many a second, --sampling HZ'
    >>> in_options("which of them is it, columns={'theta': ...}?")
    'which of them is it, --columns theta=...?'
    >>> in_options('try columns="theta=Winkel in Grad"')
    'try --columns "theta=Winkel in Grad"'
    >>> in_options("say where the motion starts, state0={'v': ...}")
    'say where the motion starts, "state0": {"v": ...} in the file of --model'
    """
    message = _ONE_COLUMN.sub(lambda m: f"{OPTIONS[m[1]]} {m[2]}=...", message)
    # A shell needs the quotation marks around blanks and brackets.
    message = _TEXT.sub(
        lambda m: f"{OPTIONS[m[1]]} " + (m[2] if _PLAIN.match(m[2]) else f'"{m[2]}"'), message
    )
    message = _WORD.sub(lambda m: f"{OPTIONS[m[1]]} {m[2]}", message)
    message = _BARE.sub(f"{OPTIONS['rate']} HZ", message)
    message = _SUBJECT.sub(lambda m: OPTIONS[m[1]], message)
    return _START.sub(lambda m: '"state0": {' + m[1].replace("'", '"') + "} in the file of --model", message)
