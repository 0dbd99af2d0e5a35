"""The lines of a text, a block at a time: the text as a whole is never split up in memory."""

from __future__ import annotations

import re
from collections.abc import Iterator

from udd._util.input_files import MemoryLimit, in_bytes
from udd.errors import MeasurementError

_BLOCK = 1 << 18  # bytes that are split up at a time
_LONGEST = 1 << 20  # bytes of a line
_NO_TEXT = "this is not a text table"


class Lines:
    """The lines of a text table that are neither empty nor comments (``#``), and their numbers from 1.

    Excel's line ``sep=;`` above all others is none of them; `mark` is what it says.

    Parameters
    ----------
    raw : bytes
        UTF-8, Latin-1, or UTF-16 with a byte order mark.
    memory : MemoryLimit
        Counts what it takes.
    """

    def __init__(self, raw: bytes, memory: MemoryLimit) -> None:
        if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):  # "Unicode text" of Excel
            memory.take(4 * len(raw))
            try:
                raw = raw.decode("utf-16").encode()
            except UnicodeError:
                raise MeasurementError(_NO_TEXT) from None
        elif b"\0" in raw[:4096]:
            raise MeasurementError(_NO_TEXT)
        self._raw = raw.removeprefix(b"\xef\xbb\xbf")
        self._encoding = "utf-8" if _is_utf8(self._raw) else "latin-1"
        self._first = 0  # number of the first line of the table
        self.mark = ""
        self.comments: list[str] = []
        for numbers, lines in self._blocks():
            for number, line in zip(numbers, lines, strict=True):
                text = line.strip()
                if text.startswith("#"):
                    if "=" in text or text.lower().startswith("#multi:"):
                        memory.take(64 + len(text))
                        self.comments.append(text)
                elif text and not self._first:
                    if re.fullmatch("sep=.", text):
                        self.mark = text[-1]
                    else:
                        self._first = number

    def blocks(self) -> Iterator[tuple[list[int], list[str]]]:
        """Yield the numbers of lines, and these lines, a block at a time."""
        for numbers, lines in self._blocks():
            picked = [
                k
                for k, line in enumerate(lines)
                if numbers[k] >= self._first and (text := line.lstrip()) and not text.startswith("#")
            ]
            if picked:
                yield [numbers[k] for k in picked], [lines[k] for k in picked]

    def __iter__(self) -> Iterator[str]:
        for _, lines in self.blocks():
            yield from lines

    def _blocks(self) -> Iterator[tuple[range, list[str]]]:
        start, number = 0, 1
        while start < len(self._raw):
            end = self._end_of_block(start, number)
            lines = self._raw[start:end].decode(self._encoding).splitlines()
            if len(max(lines, key=len, default="")) > _LONGEST:
                raise _too_long(number)
            yield range(number, number + len(lines)), lines
            start, number = end, number + len(lines)

    def _end_of_block(self, start: int, number: int) -> int:
        """Return the end of a line that is not the last of the block's bytes."""
        raw = self._raw
        for size in (_BLOCK, _LONGEST):
            stop = start + size
            if stop >= len(raw):
                return len(raw)
            end = raw.rfind(b"\n", start, stop) + 1
            if not end:
                end = raw.rfind(b"\r", start, stop) + 1
                end += raw[end : end + 1] == b"\n" if end else 0
            if end:
                return end
        raise _too_long(number)


def _is_utf8(raw: bytes) -> bool:
    start = 0
    while start < len(raw):
        end = start + _BLOCK
        while end < len(raw) and raw[end] & 0xC0 == 0x80 and end < start + _BLOCK + 4:
            end += 1  # not within a character
        try:
            raw[start:end].decode()
        except UnicodeDecodeError:
            return False
        start = end
    return True


def _too_long(number: int) -> MeasurementError:
    return MeasurementError(f"line {number} is longer than {in_bytes(_LONGEST)}: {_NO_TEXT}")
