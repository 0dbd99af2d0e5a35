from __future__ import annotations

from pathlib import Path

import matplotlib
import pytest

matplotlib.use("Agg")  # no test opens a window


@pytest.fixture(scope="session")
def shared() -> Path:
    """Recordings and films beside the repository; no part of the product, so absent on most machines."""
    path = Path(__file__).resolve().parents[2] / "shared"
    if not path.is_dir():
        pytest.skip("needs ../shared (recordings beside the repository), which is absent here")
    return path
