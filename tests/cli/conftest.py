"""The folder with the examples, in which the documentation's commands run."""

from __future__ import annotations

from pathlib import Path

import pytest

from udd.examples import write


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("examples")
    assert all(file.is_file() for file in write("all", made))
    return made
