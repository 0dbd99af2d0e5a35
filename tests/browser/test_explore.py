"""The page as its readers use it: it moves, is dragged, linked, exported."""

from __future__ import annotations

import http.client
import json
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from browser_for_tests import Opened, until
from udd.app.spec import start_of
from udd.simulation.trajectory import integrated

FRAMES = """(count) => new Promise((done) => {
  const next = () => (count-- > 0 ? requestAnimationFrame(next) : done());
  next();
})"""
ROWS = """(count) => {
  const record = udd.player.records[0], states = udd.about(udd.home.model.kind).states.length;
  const bits = [];
  for (let k = 0; k < count; k++) bits.push(...new BigUint64Array(record.row(k).slice(0, states).buffer));
  return {home: udd.home, bits: bits.map(String)};
}"""


def shown(page: Any, count: int) -> tuple[dict[str, Any], np.ndarray]:
    """Return the page's run, and its first states to the bit."""
    until(page, f"udd.player.records[0].count >= {count}")
    said = page.evaluate(ROWS, count)
    bits = np.array([int(b) for b in said["bits"]], dtype=np.uint64)
    return said["home"], bits.view(np.float64).reshape(count, -1)


def simulated(home: dict[str, Any], count: int) -> np.ndarray:
    start = start_of(home)
    per = 64 if home["model"]["kind"] == "dle" else 240
    # Longer than the page's own calls: the last step of a call is cut to its end.
    run = integrated(start.model, np.arange(30_000) / per, list(start.state))
    return run.state[:count]


def test_it_moves_at_once(opened: Opened) -> None:
    page = opened.go()
    until(page, "udd.player.at > 60")
    first = page.locator("#numbers").text_content()
    page.evaluate(FRAMES, 30)  # half a second, where the machine has time for all of them
    assert page.locator("#numbers").text_content() != first
    assert page.evaluate("udd.player.ahead") >= 3  # pieces


def test_a_link_reproduces_the_run_to_the_bit(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.03&state=0,0.001,0.04,0")
    until(page, "udd.player.at > 100")
    page.evaluate("udd.change({W: 0.0312})")  # goes on from the state that is shown
    until(page, "location.hash.includes('W=0.0312')")
    home, states = shown(page, 480)
    np.testing.assert_array_equal(states, simulated(home, 480))
    link = page.evaluate("location.hash")
    page.goto("about:blank")
    again, same = shown(opened.go(link), 480)
    assert again == home
    np.testing.assert_array_equal(same, states)


@pytest.mark.parametrize(
    "fragment",
    [
        "#model=dle&w=3.7&B=0.2&state=1.9235384061671346,1.9235384061671346,-3.2",
        "#model=disk&W=0.042&effect=relaxation:b=6.002118,momentum=constraint&edge=ignore&state=2,0.02,-0.02,0",
    ],
)
def test_a_link_is_what_simulate_computes(opened: Opened, fragment: str) -> None:
    home, states = shown(opened.go(fragment), 480)
    np.testing.assert_array_equal(states, simulated(home, 480))


def test_what_is_exported_is_what_is_shown(opened: Opened, tmp_path: Path) -> None:
    page = opened.go()
    _, states = shown(page, 240)
    page.click("#export summary")
    with page.expect_download() as csv:
        page.click("#export-exact")
    lines = [line for line in Path(csv.value.path()).read_text().splitlines() if line[0] != "#"]
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    np.testing.assert_array_equal(table[:240, 1:], states)
    page.click("#export summary")
    with page.expect_download() as picture:
        page.click("#export-png")
    content = Path(picture.value.path()).read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(content[16:20], "big") > 1.9 * page.locator("#stage").bounding_box()["width"]
    said = page.evaluate("udd.describe()")
    assert said.startswith("W = 3 cm/s, R = 8 cm, g = 9.81 m/s², ")
    assert "start Ω = 0 rad/s, Y = 0.1 cm, Z = 4 cm, β = 0 rad, at " in said
    code = page.evaluate("import('/static/address.js').then((m) => m.python(udd.home, udd.catalogue))")
    made: dict[str, Any] = {}
    exec(code, made)
    np.testing.assert_array_equal(made["state"][:240], states)


def test_the_disk_is_dragged(opened: Opened) -> None:
    page = opened.go()
    box = page.locator("#disk").bounding_box()
    unit, last = page.evaluate("[udd.disk.unit, udd.last]")
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.click("#play")
    unit, last = page.evaluate("[udd.disk.unit, udd.last]")
    page.mouse.move(middle[0] + last["y"] * unit, middle[1] - last["z"] * unit)
    page.mouse.down()
    page.mouse.move(middle[0] + 0.03 * unit, middle[1] - 0.02 * unit, steps=5)
    page.mouse.up()
    state = page.evaluate("udd.home.state")
    assert state[0] == 0
    assert state[1:3] == pytest.approx([0.03, 0.02], abs=2 / unit)  # a pixel or two
    home, states = shown(page, 240)
    np.testing.assert_array_equal(states, simulated(home, 240))


def test_presets_begin_and_the_ejected_one_says_so(opened: Opened) -> None:
    page = opened.go()
    keys = page.eval_on_selector_all("#preset option", "(all) => all.map((o) => o.value).filter(Boolean)")
    assert {"rotating", "bistable", "ejected", "fig12a"} <= set(keys)
    for key in keys:
        page.select_option("#preset", key)
        until(page, "!udd.player.fresh && udd.player.at > 5")
    page.select_option("#preset", "ejected")
    page.select_option("#speed", "8")
    page.wait_for_selector("#over:not([hidden])")
    assert "left the wheels after" in page.locator("#over-text").text_content()
    page.click("#again")
    page.wait_for_selector("#over", state="hidden")


def test_the_drive_goes_on_from_where_the_disk_is(opened: Opened) -> None:
    page = opened.go()
    until(page, "udd.player.at > 120")
    page.locator("#p-W").fill("0.05")
    state = page.evaluate("udd.home.state")
    assert state[1:3] != [0.001, 0.04]
    home, states = shown(page, 120)
    assert home["model"]["W"] == 0.05
    np.testing.assert_array_equal(states, simulated(home, 120))


def test_the_keyboard_does_everything(opened: Opened) -> None:
    page = opened.go()
    page.locator("h1").click()
    page.keyboard.press(" ")
    assert page.evaluate("udd.player.playing") is False
    before = page.evaluate("udd.player.at")
    page.keyboard.press(".")
    until(page, f"udd.player.at > {before}")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("udd.home.model.W") == 0.0301
    page.keyboard.press("2")
    assert page.locator("#pane-diagram").is_visible()
    page.keyboard.press("ArrowRight")  # the drive's, still
    assert page.locator("#pane-diagram").is_visible()
    assert page.evaluate("udd.home.model.W") == 0.0302
    page.keyboard.press("d")
    assert page.locator("#twin").is_checked()
    page.keyboard.press("p")
    assert page.locator("#projector").get_attribute("aria-pressed") == "true"
    page.keyboard.press("?")
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    page.keyboard.press("f")
    assert page.locator("#film").is_visible()
    page.keyboard.press("e")
    page.locator("#disk").focus()
    y = page.evaluate("udd.last.y")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("udd.home.state[1]") > y


def test_keys_go_on_after_a_slider_and_a_preset_were_touched(opened: Opened) -> None:
    page = opened.go()
    page.locator("input[type=range]").first.click()
    page.keyboard.press("2")
    assert page.locator("#pane-diagram").is_visible()
    page.locator("#preset").click()
    page.locator("#preset").select_option("rotating")
    page.keyboard.press("3")
    assert page.locator("#pane-energy").is_visible()


def test_the_diagram_is_jumped_onto_and_zoomed(opened: Opened) -> None:
    page = opened.go("#model=dle&w=3.9&B=0&state=1,1,0.01&tab=diagram")
    # The first stages have 20 drives only, and a click goes to the nearest of them.
    until(page, "udd.diagram.found && udd.diagram.exponents && !udd.diagram.working")
    x, y = page.evaluate("[udd.diagram.axes.x(6.2), udd.diagram.axes.y(5)]")
    page.locator("#diagram").click(position={"x": x, "y": y})
    w, state = page.evaluate("[udd.home.model.w, udd.home.state]")
    assert w == pytest.approx(6.2, abs=0.15)
    assert abs(state[2]) < 1e-9  # on the section
    box = page.locator("#diagram").bounding_box()
    page.mouse.move(box["x"] + x - 60, box["y"] + 30)
    page.mouse.down()
    page.mouse.move(box["x"] + x + 60, box["y"] + 30, steps=4)
    page.mouse.up()
    until(page, "udd.diagram.found?.drive.at(-1) < 8")
    page.click("#whole")
    until(page, "udd.diagram.found?.drive.at(-1) > 11")


def test_a_dropped_connection_is_resumed(opened: Opened) -> None:
    page = opened.go()
    page.evaluate("udd.link.socket.close()")
    at = page.evaluate("udd.player.at")
    until(page, f"udd.player.at > {at} + 1200")  # beyond what was ahead
    home, states = shown(page, 1200)
    np.testing.assert_array_equal(states, simulated(home, 1200))


def test_two_tabs_do_not_disturb_each_other(opened: Opened, browser: Any, link: str) -> None:
    page = opened.go()
    other = Opened(browser, link)
    second = other.go("#model=dle&w=1&B=0&state=1,1,0.01")
    for one in (page, second):
        home, states = shown(one, 480)
        np.testing.assert_array_equal(states, simulated(home, 480))
    other.context.close()
    assert other.said == []


def test_reduced_motion_is_respected(browser: Any, link: str) -> None:
    one = Opened(browser, link, reduced_motion="reduce")
    page = one.go()
    page.wait_for_timeout(300)
    assert page.evaluate("[udd.player.playing, udd.player.at]") == [False, 0]
    one.context.close()
    assert one.said == []


def test_others_are_kept_out(opened: Opened, link: str) -> None:
    address = urlsplit(link)
    for host, path, expected in (
        (address.netloc, f"/?{address.query}", 200),
        ("evil.example", f"/?{address.query}", 403),
        (address.netloc, "/?token=x", 403),
    ):
        connection = http.client.HTTPConnection(address.hostname or "", address.port or 0)
        connection.request("GET", path, headers={"Host": host})
        assert connection.getresponse().status == expected
        connection.close()
    # A page of another origin, in the same browser, with the token even.
    page = opened.page
    page.goto("about:blank")
    socket = f"ws://{address.netloc}/api/socket?{address.query}"
    script = """(url) => new Promise((told) => {
      const socket = new WebSocket(url);
      socket.onopen = () => told("open");
      socket.onclose = () => told("closed");
    })"""
    assert page.evaluate(script, socket) == "closed"
    opened.said.clear()  # the browser says that it was refused


def test_two_pages_of_json(opened: Opened) -> None:
    """The catalogue the page was given is the server's."""
    from udd.app.presets import catalogue

    page = opened.go()
    offered = json.loads(json.dumps(catalogue()))
    assert page.evaluate("udd.catalogue") == {**offered, "classroom": False}
