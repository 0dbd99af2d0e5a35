"""XML of programs whose files are not read: which program, and how its data can be had."""

from __future__ import annotations

import re
from dataclasses import dataclass

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from .table import Table

#: The first element of a file, after the declaration and comments.
_FIRST = re.compile(rb"<\s*([A-Za-z_][\w.:-]*)")


@dataclass(frozen=True)
class OtherXml:
    """Files of one program, by their suffix or by a word in the name of their first element."""

    suffix: str
    word: bytes
    what: str
    help: str

    def is_so(self, head: bytes, suffix: str) -> bool:
        """Return True if a file with these first bytes is of this kind."""
        name = _first_element(head)
        if self is REST:
            return name not in (b"", b"object") and suffix != ".trk"
        return bool(name) and (suffix == self.suffix or (bool(self.word) and self.word in name))

    def read(self, raw: bytes, _given: list[str] | None, _memory: MemoryLimit) -> list[Table]:
        """Refuse the file, and say what it is."""
        name = _first_element(raw[:4096]).decode("ascii", "replace")[:40]
        raise MeasurementError(f"this is {self.what.format(name)}, which is not read: {self.help}")


def _first_element(head: bytes) -> bytes:
    """Return the name of the first element in lower case; empty if the text is no XML."""
    # In UTF-16 every letter has a zero.
    plain = head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    first = _FIRST.search(re.sub(rb"<!--.*?-->", b"", plain, flags=re.DOTALL))
    return first[1].lower() if first and plain.startswith(b"<") else b""


REST = OtherXml("", b"", "XML of another program than Tracker (<{}>)", "export its table as CSV or text")
KINDS = (
    OtherXml(
        ".labx", b"cassy", "a project of CASSY Lab", "copy its table as text, or export it as text (.txt)"
    ),
    OtherXml(
        ".phyphox", b"phyphox", "an experiment of phyphox", "open it in phyphox and export the data as CSV"
    ),
    OtherXml(".cmbl", b"", "a project of Logger Pro", "export its data as CSV"),
    REST,
)
