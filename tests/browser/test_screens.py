"""Every screen at both sizes: nothing sticks out, and axe-core finds nothing to fault."""

from __future__ import annotations

from typing import Any

import pytest

from browser_for_tests import SIZES, Opened

axe = pytest.importorskip("axe_playwright_python.sync_playwright")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("screen", ["section", "diagram", "energy", "series", "film", "keys", "projector"])
def test_a_screen(browser: Any, link: str, size: str, screen: str) -> None:
    one = Opened(browser, link, size)
    page = one.go(f"#model=disk&W=0.03&state=0,0.001,0.04,0&tab={screen}" if len(screen) > 5 else "")
    if screen == "film":
        page.click("#to-film")
    elif screen == "keys":
        page.click("#help")
    elif screen == "projector":
        page.click("#projector")
    for box in page.query_selector_all("#panel details"):
        box.evaluate("(d) => (d.open = true)")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    one.context.close()
    assert one.said == []
