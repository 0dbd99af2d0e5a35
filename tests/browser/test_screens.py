"""Every screen at each size: nothing sticks out, and axe-core finds nothing to fault."""

from __future__ import annotations

from typing import Any

import pytest

import udd
from browser_for_tests import SIZES, Opened, until

axe = pytest.importorskip("axe_playwright_python.sync_playwright")


#: The buttons that lead to each screen; tabs are in the address.
CLICKS = {
    **dict.fromkeys(("section", "diagram", "energy", "series", "what"), ()),
    "film": ("#to-film",),
    "table": ("#to-film",),
    "keys": ("#help",),
    "open": ("#open",),
    "tour": ("#tour-begin",),
    "projector": ("#projector",),
    "dark": ("#dark", "#projector"),
}


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("screen", CLICKS)
def test_a_screen(browser: Any, link: str, size: str, screen: str) -> None:
    if size == "phone" and screen in ("keys", "projector", "dark"):
        pytest.skip("a phone has no keys and no projector")
    one = Opened(browser, link, size)
    page = one.go(f"#model=disk&W=0.03&state=0,0.001,0.04,0&tab={screen}" if not CLICKS[screen] else "")
    for button in CLICKS[screen]:
        page.click(button)
    if screen == "table":
        page.set_input_files("#file", udd.examples.path("driven.csv"))
        until(page, "!document.getElementById('columns').hidden")
    for box in page.query_selector_all("#panel details"):
        box.evaluate("(d) => (d.open = true)")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    result = axe.Axe().run(page)
    assert result.violations_count == 0, result.generate_report()
    one.context.close()
    assert one.said == []
