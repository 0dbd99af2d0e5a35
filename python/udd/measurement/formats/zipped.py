"""Archives of tables, as phyphox exports them: one CSV file for each sensor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePosixPath

from udd._util.input_files import MemoryLimit
from udd._util.numpy_files import opened_zip
from udd.errors import MeasurementError

from . import text, tracker_project
from .numpy_arrays import one_line_message
from .table import Table

_TEXT = {".csv", ".txt", ".tsv", ".dat"}


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read each table of an archive but those about the phone (``meta/``); a Tracker project (.trz), too."""
    try:
        with opened_zip(raw, memory) as archive:
            inside = [info for info in archive.infolist() if not info.is_dir()]
            names = [info.filename for info in inside]
            if any(name.startswith("xl/") for name in names):
                raise MeasurementError("this is an Excel workbook: save its sheet as CSV")
            if {"mimetype", "content.xml"} <= set(names):
                raise MeasurementError("this is a spreadsheet (OpenDocument): save its sheet as CSV")
            wanted = [info for info in inside if _wanted(PurePosixPath(info.filename))]
            # zipfile reads no more of an entry than the size that it states.
            memory.take(sum(info.file_size for info in wanted))
            contents = {info.filename: archive.read(info) for info in wanted}
    except MeasurementError:
        raise
    except Exception as error:  # BadZipFile, zlib.error, a password, an unknown method ...
        raise MeasurementError(f"the archive cannot be read: {one_line_message(error)}") from None
    if not contents:
        raise MeasurementError(
            f"the archive holds no table (.csv): found {', '.join(names[:8]) or 'nothing'}"
        )
    tables: list[Table] = []
    refused = ""
    for name, content in contents.items():
        path = PurePosixPath(name)
        one = tracker_project if path.suffix.lower() == ".trk" else text
        try:
            tables += [replace(table, name=path.stem) for table in one.read(content, given, memory)]
        except MeasurementError as error:
            refused = refused or f"{name} in the archive: {error}"
    if not tables:
        raise MeasurementError(refused)
    return tables


def _wanted(path: PurePosixPath) -> bool:
    if path.parts[0] in ("meta", "__MACOSX") or path.name.startswith("."):
        return False
    return path.suffix.lower() in _TEXT | {".trk"}
