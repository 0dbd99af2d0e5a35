"""A page in a browser, with what its console said."""

from __future__ import annotations

import time
from typing import Any

SIZES = {"laptop": (1280, 720), "tablet": (820, 1180), "phone": (390, 844)}


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
