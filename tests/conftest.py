from __future__ import annotations

import os
import signal
from pathlib import Path

import matplotlib
import pytest

matplotlib.use("Agg")  # no test opens a window
# Threads of BLAS spin while they wait: beside another process, small systems took six times the processor
# time. The processes of `pytest -n`, and those that tests start, inherit this.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# A shell that starts the tests in the background has them ignore Ctrl-C, which some tests press.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def _cache_folder(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Set the folder of `cached_on_disk`: one for all processes of the run."""
    base = tmp_path_factory.getbasetemp()
    os.environ["UDD_TEST_CACHE"] = str(base.parent if "PYTEST_XDIST_WORKER" in os.environ else base)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Recordings and films beside the repository; no part of the product, so absent on most machines."""
    path = Path(__file__).resolve().parents[2] / "shared"
    if not path.is_dir():
        pytest.skip("needs ../shared (recordings beside the repository), which is absent here")
    return path


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with the examples, in which the commands of the documentation run."""
    from udd.examples import write

    made = tmp_path_factory.mktemp("examples")
    assert all(file.is_file() for file in write("all", made))
    return made
