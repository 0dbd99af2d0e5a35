"""The package as a whole: its names, its weight on import, its one version."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.version import Version

import udd

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", udd.__all__)
def test_every_public_name_resolves(name: str) -> None:
    assert getattr(udd, name) is not None
    assert name in dir(udd)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_thing"):
        udd.no_such_thing  # noqa: B018


def test_the_version_is_that_of_the_package() -> None:
    assert udd.__version__ == version("udd")


def test_import_stays_light() -> None:
    # In a process of its own: here the other tests have imported everything already.
    code = "import sys, udd; print(*{name.partition('.')[0] for name in sys.modules})"
    loaded = set(subprocess.check_output([sys.executable, "-c", code], text=True).split())
    assert "udd" in loaded
    heavy = {"av", "cv2", "matplotlib", "numpy", "pandas", "pyarrow", "scipy", "xarray"}
    assert loaded & heavy == set()


def test_one_version_everywhere() -> None:
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())["package"]["version"]
    citation = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert citation is not None
    assert citation[1] == cargo
    # Cargo and Python write a development version differently.
    assert Version(version("udd")) == Version(cargo)
