"""Places of the example files, and copies of them in a folder of the user's."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

from udd._util.atomic_files import made_folder, write_whole
from udd.errors import UddError

FOLDER = Path(__file__).parent
#: The files of each example.
NAMES: dict[str, tuple[str, ...]] = {
    "disk": ("disk.csv",),
    "pendulum": ("pendulum.csv",),
    "phone": ("phone.csv",),
    "driven": ("driven.csv", "driven.json"),
}
_SHIPPED = tuple(file for files in NAMES.values() for file in files)


def path(name: str) -> Path:
    """Return the path of an example file.

    Parameters
    ----------
    name : str
        ``"disk.csv"``, ``"pendulum.csv"``, ``"phone.csv"``, ``"driven.csv"`` or ``"driven.json"``.

    Returns
    -------
    Path

    Raises
    ------
    UddError
        No example has that name.

    See Also
    --------
    udd.examples.write : copies an example into a folder.
    udd.read_measurement : reads a table.

    Examples
    --------
    >>> import udd
    >>> udd.read_measurement(udd.examples.path("pendulum.csv")).kind
    'pendulum'
    """
    if name not in _SHIPPED:
        raise _unknown(name, _SHIPPED)
    return FOLDER / name


def write(name: str, folder: str | os.PathLike[str] = ".") -> list[Path]:
    """Write the files of an example into a folder; files that are there already stay.

    Parameters
    ----------
    name : str
        A key of `NAMES`, or ``"all"``: these, and the films, records and settings that the commands of the
        documentation use.
    folder : path
        By default the working folder.

    Returns
    -------
    list of Path
        The files, those that were there before too.

    Raises
    ------
    UddError
        No example has that name, or the folder cannot be written to.

    See Also
    --------
    udd.examples.path : path of a single file.

    Examples
    --------
    >>> import tempfile, udd
    >>> [file.name for file in udd.examples.write("driven", tempfile.mkdtemp())]
    ['driven.csv', 'driven.json']
    """
    names = (*NAMES, "all")
    if name not in names:
        raise _unknown(name, names)
    target = made_folder(folder)
    files = _SHIPPED if name == "all" else NAMES[name]
    made = [_copied(FOLDER / file, target / file) for file in files]
    if name == "all":
        from .more import write_more

        made += write_more(target)
    return made


def _copied(source: Path, target: Path) -> Path:
    if not target.exists():
        write_whole(target, source.read_bytes())
    return target


def _unknown(name: str, known: tuple[str, ...]) -> UddError:
    matches = difflib.get_close_matches(str(name), known, 1)
    meant = f"; did you mean {matches[0]}?" if matches else ""
    return UddError(f"no example is called {name!r:.60}{meant} (there are {', '.join(known)})")
