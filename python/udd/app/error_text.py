"""Error messages as sentences for the page."""

from __future__ import annotations

import functools
import inspect
import re


def sentence(error: object) -> str:
    """Return what is wrong with a capital and a full stop, without advice to callers from Python."""
    text = _python_advice().sub("", " ".join(str(error).split()))
    text = re.sub(r"give pivot=\(u, v\)( in pixels)?", "click the contact", text)
    text = re.sub(r" \((layout|region)\)", "", text)
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")


@functools.cache
def _python_advice() -> re.Pattern[str]:
    """Match a bracket, clause or example that names an argument of `udd.read_measurement`."""
    from udd.measurement import read_measurement

    arguments = list(inspect.signature(read_measurement).parameters)[1:-1]
    name = rf"\b(?:{'|'.join(arguments)})="
    return re.compile(rf" \([^()]*{name}[^()]*\)|; [^;]*?{name}[^;]*$|, for example {name}.*$")
