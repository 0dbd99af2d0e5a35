"""A real browser before the real server; `make test-browser` installs what it needs and runs this folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

# Plain pytest leaves the folder out: a browser is needed, and minutes.
collect_ignore_glob = [] if os.environ.get("UDD_BROWSER") else ["test_*.py"]

SIZES = {"laptop": (1280, 720), "tablet": (820, 1180)}


@pytest.fixture(scope="session")
def link() -> Iterator[str]:
    """The address of a server of its own."""
    server = subprocess.Popen(
        [sys.executable, "-m", "udd", "app", "--no-browser", "--port", "0"],
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


def until(page: Any, condition: str, seconds: float = 60.0) -> None:
    """Wait for a condition in JavaScript.

    Playwright's own way evaluates text within the page, which its policy forbids.
    """
    end = time.monotonic() + seconds
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"{condition} did not come about"
        page.wait_for_timeout(20)


class Opened:
    """A page with what its console said."""

    def __init__(self, browser: Any, link: str, size: str = "laptop", **options: Any) -> None:
        width, height = SIZES[size]
        self.context = browser.new_context(viewport={"width": width, "height": height}, **options)
        self.page = self.context.new_page()
        self.page.set_default_timeout(60_000)
        self.said: list[str] = []
        self.page.on("console", lambda m: self.said.append(f"{m.type}: {m.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))
        self.link = link

    def go(self, fragment: str = "") -> Any:
        """Open the page, wait until it has drawn."""
        self.page.goto(self.link + fragment)
        until(self.page, "globalThis.udd?.stats.frames > 3")
        return self.page


@pytest.fixture
def opened(browser: Any, link: str) -> Iterator[Opened]:
    """A page of laptop size; its console must have stayed empty."""
    one = Opened(browser, link)
    yield one
    one.context.close()
    assert one.said == []
