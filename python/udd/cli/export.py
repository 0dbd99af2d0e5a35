"""A labelled result as files: NetCDF, Zarr, or a picture."""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd._util.atomic_files import require_writable
from udd.errors import UddError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Endings of a labelled result's own files, and of pictures.
DATA = (".nc", ".zarr")
PICTURES = (".png", ".svg", ".pdf")
#: Endings of pages, and of tables as text.
PAGES = (".html", ".htm")
TABLES = (".csv", ".txt")


class OutputFile(argparse.Action):
    """The name of a file to write; one that cannot be written is refused before the work.

    So is one whose ending promises another kind of file than `endings`, where these are given.
    """

    def __init__(self, *args: Any, endings: tuple[str, ...] = (), **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.endings = endings

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Check it and keep it."""
        require_writable(values)
        if self.endings:
            check_ending(values, self.endings)
        setattr(namespace, self.dest, values)


def check_ending(path: Path, endings: tuple[str, ...]) -> None:
    """Refuse a name that promises another kind of file."""
    if path.suffix.lower() not in endings:
        raise UddError(f"{path}: the name must end in {' or '.join(endings)}")


def add_out(parser: argparse.ArgumentParser, data: tuple[str, ...] = DATA) -> None:
    """Add the option for the output file."""
    kinds = ", ".join((*data, *PICTURES))
    parser.add_argument(
        "--out",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help=f"file to write, by its ending: {kinds}; repeatable",
    )


def checked(paths: list[Path], data: tuple[str, ...] = DATA) -> None:
    """Refuse what cannot be written, before the work."""
    for path in paths:
        if path.suffix not in (*data, *PICTURES):
            raise UddError(f"{path}: the name must end in {', '.join((*data, *PICTURES))}")
        if path.suffix != ".zarr":
            require_writable(path)
        elif not path.parent.is_dir():
            raise UddError(f"{path}: there is no folder {path.parent}")
        if path.suffix == ".zarr":
            import zarr  # noqa: F401 - a missing package is named now, not after the work
        if path.suffix == ".zarr" and path.exists():
            raise UddError(f"{path} exists already: Zarr needs a new folder")


def save(paths: list[Path], result: xr.Dataset, draw: Callable[[Axes], object]) -> None:
    """Write what is asked for; a file is there whole or not at all."""
    from udd._util.atomic_files import write_whole

    for path in paths:
        if path.suffix == ".nc":
            write_whole(path, bytes(result.to_netcdf(engine="scipy", format="NETCDF3_64BIT")))
        elif path.suffix == ".zarr":
            _zarr(path, result)
        else:
            save_picture(path, draw)


def save_picture(path: Path, draw: Callable[[Axes], object], size: tuple[float, float] = (7.2, 4.4)) -> None:
    """Write a picture of one pair of axes, of the kind that the name's ending says."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    draw(figure.add_subplot())
    save_figure(path, figure)


def save_figure(path: Path, figure: Figure) -> None:
    """Write a figure, of the kind that the name's ending says."""
    from udd._util.atomic_files import write_whole

    picture = BytesIO()
    figure.savefig(picture, format=path.suffix[1:], dpi=150)
    write_whole(path, picture.getvalue())


def _zarr(path: Path, result: xr.Dataset) -> None:
    try:
        folder = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
    except OSError as error:
        raise UddError(f"{path} cannot be written: {error.strerror}") from None
    try:
        # Zarr 3 has no arrays of strings of one length.
        words = {
            name: result[name].astype(object) for name in result.coords if result[name].dtype.kind == "U"
        }
        result.assign_coords(words).to_zarr(folder / "made", zarr_format=3, consolidated=False)
        os.replace(folder / "made", path)
    except OSError as error:
        raise UddError(f"{path} cannot be written: {error.strerror or error}") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)
