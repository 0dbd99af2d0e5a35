"""Uploads: into a private folder, within the limits."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path

from udd.errors import UddError
from udd.measurement.formats import is_table

from . import limits


class TooLarge(UddError):
    """More was sent than is taken."""


def private_folder(parent: Path) -> Path:
    """Make a folder that only this user can read."""
    return Path(tempfile.mkdtemp(dir=parent))


async def text(chunks: AsyncIterator[bytes]) -> str:
    """Read a request's body as text, up to the length of a message.

    Raises
    ------
    TooLarge
        More bytes than `limits.MESSAGE`.
    UddError
        The sender stopped halfway.
    """
    body = bytearray()
    async for chunk in _in_time(chunks):
        body += chunk
        if len(body) > limits.MESSAGE:
            raise TooLarge(f"The request is larger than {limits.MESSAGE >> 10} kB.")
    return body.decode("utf-8", "replace")


async def _in_time(chunks: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    while True:
        try:
            yield await asyncio.wait_for(anext(chunks), limits.PAUSE)
        except StopAsyncIteration:
            return
        except TimeoutError:
            raise UddError("The request stopped halfway.") from None


async def receive(chunks: AsyncIterator[bytes], folder: Path) -> Path:
    """Write what comes to a file in the folder; its name is not the sender's.

    Raises
    ------
    TooLarge
        More bytes than `limits.UPLOAD`; the folder is gone then.
    UddError
        Nothing came, or the sender stopped halfway.
    """
    target, size = folder / "upload", 0
    try:
        with target.open("wb") as file:
            async for chunk in _in_time(chunks):
                size += len(chunk)
                if size > limits.UPLOAD:
                    raise TooLarge(f"The file is larger than {limits.UPLOAD >> 20} MB.")
                file.write(chunk)
        if not size:
            raise UddError("The file is empty.")
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return _named(target)


def _named(file: Path) -> Path:
    """Rename the file by the ending that fits its content."""
    with file.open("rb") as opened:
        start = opened.read(4096)
    table = ".parquet" if start.startswith(b"PAR1") else ".csv"
    return file.rename(file.with_suffix(table if is_table(start) else ".film"))
