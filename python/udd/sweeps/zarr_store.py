"""A sweep in a Zarr group: template, writing, resuming."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

from .chunks import (
    Grid,
    Part,
    attributes,
    compute,
    coordinate_attributes,
    fill_of,
    part_of,
    spec_attributes,
    variables_of,
)
from .spec import SweepSpec

if TYPE_CHECKING:
    import xarray as xr
    import zarr

_HASH = "spec_sha256"


@dataclass(frozen=True)
class Target:
    """Destination of a chunk; it travels to the worker."""

    arrays: dict[str, zarr.Array[Any]]
    done: zarr.Array[Any]
    region: tuple[slice, ...]
    place: tuple[int, ...]


def compute_and_write(part: Part, threads: int, target: Target) -> None:
    """Compute a chunk, write it to the store, and only then its flag.

    A process that is killed on the way leaves no flag, so that the chunk is computed again. Every Zarr
    chunk belongs to one chunk of the work, and a local store puts each into place whole.
    """
    for name, values in compute(part, threads).items():
        target.arrays[name][target.region] = values
    target.done[target.place] = True


class SweepStore:
    """A Zarr group with the template of a sweep, which the workers fill."""

    work = staticmethod(compute_and_write)
    remedy = "the same call goes on from here"

    def __init__(
        self, store: str | os.PathLike[str] | zarr.Group, spec: SweepSpec, grid: Grid, threads: int
    ) -> None:
        import zarr

        self._spec, self._grid, self._threads = spec, grid, threads
        self.where = f"the group {store.name}" if isinstance(store, zarr.Group) else os.fspath(store)
        with _locked(store), self.writing():
            self._group = _opened(store, spec, self.where)
            if "done" not in self._group:  # made last
                _make_template(self._group, spec, grid)
        self._arrays = {
            v.name: _array(self._group, v.name, (*grid.shape, *(n for _, n in v.dimensions)))
            for v in variables_of(spec)
        }
        self._done = _array(self._group, "done", grid.counts)
        self._reached = False
        root = getattr(self._group.store, "root", None)
        self._folder = root / self._group.path if isinstance(root, Path) else None
        self._use = None if self._folder is None else _in_use(self._folder)

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Say where writing failed.

        Raises
        ------
        UddError
            The store cannot be written, as on a full disk, or another process makes it at the same time.
        """
        import zarr

        try:
            yield
        except (zarr.errors.ContainsGroupError, zarr.errors.ContainsArrayError):
            raise UddError(
                f"{self.where} is being made by another process: call again when it is there"
            ) from None
        except (OSError, zarr.errors.BaseZarrError) as error:
            said = getattr(error, "strerror", None) or str(error)
            raise UddError(f"{self.where} cannot be used for a sweep: {said}") from None

    def arguments(self, chunk: int) -> tuple[Any, ...]:
        """Return the arguments of `work`."""
        place = self._grid.place(chunk)
        target = Target(self._arrays, self._done, self._grid.region(chunk), place)
        return part_of(self._spec, self._grid, chunk), self._threads, target

    def keep(self, chunk: int, _nothing: None) -> None:
        """Accept a chunk that the worker has written; check the store at the first one."""
        if not self._reached and not self._done[self._grid.place(chunk)]:
            raise UddError(
                "the workers do not write to the store that was given: it must be one that they reach"
            )
        self._reached = True

    def done(self) -> NDArray[np.bool_]:
        """Return the mask of finished chunks."""
        return np.asarray(self._done[...], dtype=bool).ravel()

    def tidy(self) -> None:
        """Remove the temporary files of killed writers, unless another sweep uses the store."""
        if self._folder is not None and self._use is not None and _only_user(self._use):
            for path in self._folder.rglob("*.partial"):
                path.unlink(missing_ok=True)

    def close(self) -> None:
        """Let other sweeps tidy the store."""
        if self._use is not None:
            os.close(self._use)
            self._use = None

    def dataset(self) -> xr.Dataset:
        """Return the stored arrays, which are read when they are accessed."""
        import xarray as xr

        store_data: xr.Dataset = xr.open_zarr(
            self._group.store,
            group=self._group.path or None,
            consolidated=False,
            chunks=None,
            decode_cf=False,
            drop_variables=["done"],
        )
        return store_data


@contextlib.contextmanager
def _locked(store: str | os.PathLike[str] | zarr.Group) -> Iterator[None]:
    """Let other processes wait that would make the same store, on systems that can lock a folder."""
    import zarr

    with contextlib.ExitStack() as stack:
        if not isinstance(store, zarr.Group):
            with contextlib.suppress(ImportError, OSError):
                import fcntl

                place = Path(store)
                place.mkdir(parents=True, exist_ok=True)
                folder = os.open(place, os.O_RDONLY)
                stack.callback(os.close, folder)
                fcntl.flock(folder, fcntl.LOCK_EX)
        yield


def _in_use(folder: Path) -> int | None:
    """Return an open file whose shared lock says that a sweep uses the store, if the system has locks."""
    try:
        import fcntl

        place = os.open(folder / "done" / "zarr.json", os.O_RDONLY)  # written once
    except (ImportError, OSError):
        return None
    try:
        fcntl.flock(place, fcntl.LOCK_SH)
    except OSError:
        os.close(place)
        return None
    return place


def _only_user(place: int) -> bool:
    """Return True if no other process holds the lock of `_in_use`."""
    import fcntl

    try:
        fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _opened(store: str | os.PathLike[str] | zarr.Group, spec: SweepSpec, where: str) -> zarr.Group:
    """Return the group of this sweep, and make it if it is absent."""
    import zarr

    if isinstance(store, zarr.Group):
        group = store
        if group.metadata.zarr_format != 3:
            raise UddError(f"{where} is of Zarr format {group.metadata.zarr_format}; a sweep needs format 3")
        if _HASH not in group.attrs and not any(True for _ in group.members()):
            group.update_attributes(spec_attributes(spec))
    else:
        place = Path(where).absolute()
        names = [path.name for path in place.iterdir()] if place.exists() else []
        if "zarr.json" in names:
            group = zarr.open_group(zarr.storage.LocalStore(place), mode="r+", zarr_format=3)
        elif all(name.endswith(".partial") for name in names):
            new = zarr.storage.LocalStore(place)
            group = zarr.create_group(new, zarr_format=3, attributes=spec_attributes(spec))
        else:
            raise UddError(f"{where} holds other things already: a sweep needs a new or an empty folder")
    stored_hash = group.attrs.get(_HASH)
    if stored_hash is None:
        raise UddError(f"{where} holds other data already: a sweep needs a place of its own")
    if stored_hash != spec.sha256:
        raise UddError(
            f"{where} holds another sweep ({str(stored_hash)[:12]}, not {spec.sha256[:12]}): "
            "take another place, or the spec that it was begun with"
        )
    return group


def _make_template(group: zarr.Group, spec: SweepSpec, grid: Grid) -> None:
    """Make all arrays with their fill values; the flags last, so that they mark a complete template."""
    from zarr.codecs import ZstdCodec

    names = tuple(spec.over)

    def make(name: str, **more: Any) -> zarr.Array[Any]:
        # Said in full, so that no setting of the user's changes the bytes.
        codecs: dict[str, Any] = {"compressors": (ZstdCodec(level=3),), "filters": (), "serializer": "auto"}
        return group.create_array(name, overwrite=True, **codecs, **more)

    for name, values in spec.axes.items():
        coordinate = make(
            name,
            shape=values.shape,
            chunks=values.shape,
            dtype="float64",
            fill_value=float("nan"),
            dimension_names=(name,),
            attributes=coordinate_attributes(spec, name),
        )
        coordinate[:] = values
    for variable in variables_of(spec):
        lengths = tuple(n for _, n in variable.dimensions)
        make(
            variable.name,
            shape=(*grid.shape, *lengths),
            chunks=(*grid.box, *lengths),
            dtype=variable.dtype,
            fill_value=fill_of(variable),
            dimension_names=(*names, *(name for name, _ in variable.dimensions)),
            attributes=attributes(variable),
        )
    make(
        "done",
        shape=grid.counts,
        chunks=(1,) * len(names),
        dtype="bool",
        fill_value=False,
        dimension_names=tuple(f"chunk of {name}" for name in names),
        attributes={"long_name": "whether the chunk is finished"},
    )


def _array(group: zarr.Group, name: str, shape: tuple[int, ...]) -> zarr.Array[Any]:
    import zarr

    array = group.get(name)
    if isinstance(array, zarr.Array) and array.shape != tuple(shape):
        raise UddError(f"the store's array {name!r} has shape {array.shape}, not {tuple(shape)}")
    if not isinstance(array, zarr.Array):
        raise UddError(f"the store's array {name!r} is missing: something has changed it")
    return array
