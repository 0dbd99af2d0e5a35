"""A real browser before the real server; `make test-browser` installs what it needs and runs this folder."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from browser_for_tests import Opened

# Plain pytest leaves the folder out: a browser is needed, and minutes.
collect_ignore_glob = [] if os.environ.get("UDD_BROWSER") else ["test_*.py"]


@contextlib.contextmanager
def served(*options: str) -> Iterator[str]:
    """The address of a server that is started for tests."""
    server = subprocess.Popen(
        [sys.executable, "-m", "udd", "app", "--no-browser", "--port", "0", *options],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdout is not None
    try:
        yield server.stdout.readline().strip()
    finally:
        server.terminate()
        server.wait(20)
        server.stdout.close()


@pytest.fixture(scope="session")
def link() -> Iterator[str]:
    """The address of the page."""
    with served() as address:
        yield address


@pytest.fixture(scope="session")
def class_link() -> Iterator[str]:
    """The address of the page of a class."""
    with served("--classroom", "--host", "127.0.0.1") as address:
        yield address


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Debian's chromium."""
    from playwright.sync_api import sync_playwright

    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("no chromium is installed")
    # --no-sandbox: a container's root may have no sandbox, and only our own page is opened.
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def opened(browser: Any, link: str) -> Iterator[Opened]:
    """A page of laptop size; its console must have stayed empty."""
    one = Opened(browser, link)
    yield one
    one.context.close()
    assert one.said == []
