"""Sweeps."""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.progress import progress_bar
from udd.errors import IncompleteWarning, ModelError, interrupted, outside

from .chunks import grid_of
from .executors import ChunksLost, Executor, here, spread
from .memory_store import Memory
from .spec import SweepSpec
from .zarr_store import SweepStore

if TYPE_CHECKING:
    import xarray as xr
    import zarr


@checked_arguments
def sweep(
    spec: SweepSpec,
    executor: Executor | None = None,
    store: str | os.PathLike[str] | zarr.Group | None = None,
    *,
    progress: bool | Callable[[str], object] | None = None,
    partial: bool = False,
) -> xr.Dataset:
    """Compute a quantity over a grid of parameters and initial states, chunk by chunk.

    Parameters
    ----------
    spec : SweepSpec
        The quantity, and the values to compute it at.
    executor : object with ``submit``, optional
        Executor of the work: a `concurrent.futures` executor of threads or of processes, Dask's
        ``Client.get_executor()``. By default this process, chunk after chunk, on all cores.
    store : path or zarr.Group, optional
        Store to which the result is written, chunk by chunk. The workers must reach it. A sweep that
        stopped goes on from there. Without one the result stays in memory.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.
    partial : bool
        After Ctrl-C return what there is, with a warning, instead of raising it with the exception.

    Returns
    -------
    xarray.Dataset
        The quantity's arrays over the axes of the sweep, with units, and the array ``outcome``. The spec is
        among the attributes. With a store it is read when it is looked at.

    Raises
    ------
    UddError
        The store holds another sweep or other things, or cannot be written.

    Interrupted
        On Ctrl-C, with the dataset as its ``partial``: what is not finished is NaN with the outcome -1,
        "not_run". The store keeps what is finished.

    Warns
    -----
    IncompleteWarning
        Where a chunk's workers died again and again: what is finished is returned. After Ctrl-C, where a
        partial result was asked for.

    See Also
    --------
    udd.SweepSpec : the quantities and their options.
    udd.lyapunov : exponents of an array of drives.
    udd.plot.exponents : draw exponents over a parameter.

    Notes
    -----
    The values do not depend on the executor, the store, the chunks or the number of threads, to the last
    bit. A chunk is a pure function of its part of the spec. It is written to its own region of the store,
    which no other chunk shares, and then its flag in the array ``done``. So a sweep that is killed at any
    moment and run again gives the same files.

    A trajectory that fails is no error: it has an outcome other than "finished", and NaN.

    A worker of an executor takes one core, so there should be as many as cores.

    Examples
    --------
    >>> import numpy as np
    >>> import udd
    >>> spec = udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": np.linspace(0.5, 2, 4)}, options={"tol": 0.02})
    >>> exponents = udd.sweep(spec)
    >>> exponents["value"].sizes["w"], bool((exponents["standard_error"] <= 0.02).all())
    (4, True)

    Two axes, in threads, into a store; the second call finds all done.

    >>> import tempfile
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> over = {"W": [0.03, 0.039], "Z": np.linspace(-0.06, 0.06, 4)}
    >>> spec = udd.SweepSpec("outcome", udd.Disk(0.039), over, [0, 1e-3, 0, 0], {"t": 10.0}, chunk=4)
    >>> with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as threads:
    ...     first = udd.sweep(spec, threads, store=f"{folder}/disk.zarr").load()
    ...     again = udd.sweep(spec, store=f"{folder}/disk.zarr").load()
    >>> first.identical(again), dict(first.sizes)
    (True, {'W': 2, 'Z': 4})
    """
    if not isinstance(spec, SweepSpec):
        raise ModelError(f"a sweep needs a udd.SweepSpec, not {spec!r}")
    if executor is not None and not hasattr(executor, "submit"):
        raise ModelError(f"an executor needs a method submit, which {executor!r} lacks")
    grid = grid_of(spec)
    # An executor has a worker for every core; alone, this process has them all.
    threads = 0 if executor is None else 1
    result = Memory(spec, grid, threads) if store is None else SweepStore(store, spec, grid, threads)
    with contextlib.closing(result):
        done = result.done()
        sizes = [prod(part.stop - part.start for part in grid.region(chunk)) for chunk in range(len(grid))]
        why, stopped = "some of the workers do not reach the store", False
        with progress_bar(sum(sizes), "run", progress, title="sweep", initial=int(done @ sizes)) as bar:

            def keep(chunk: int, arrays: Any) -> None:
                result.keep(chunk, arrays)
                bar.update(sizes[chunk])

            chunks = np.flatnonzero(~done).tolist()
            try:
                with result.writing():
                    if executor is None:
                        here(result.work, chunks, result.arguments, keep)
                    else:
                        spread(executor, result.work, chunks, result.arguments, keep)
            except KeyboardInterrupt:
                why, stopped = "stopped by Ctrl-C", True
            except ChunksLost as error:
                why = str(error)
        missing = int((~result.done()).sum())
        if missing:
            message = f"{missing} of {len(grid)} chunks are not finished: {why}; {result.remedy}"
            if stopped:
                interrupted(result.dataset, message, partial)
            else:
                warnings.warn(IncompleteWarning(message), stacklevel=outside())
        else:
            result.tidy()
        return result.dataset()
