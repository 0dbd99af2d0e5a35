"""The page in a real browser: frames per second, and the delay from a slider to the frame that shows it.

Usage: python benches/python/page.py [SECONDS]
"""

from __future__ import annotations

import shutil
import subprocess
import sys

import numpy as np
from playwright.sync_api import sync_playwright

COUNT = """(seconds) => new Promise((done) => {
  const first = udd.stats.frames, begin = performance.now(), times = [];
  let last = begin;
  const tick = (now) => {
    times.push(now - last);
    last = now;
    if (now - begin < 1000 * seconds) requestAnimationFrame(tick);
    else done([udd.stats.frames - first, (now - begin) / 1000, times.slice(1)]);
  };
  requestAnimationFrame(tick);
})"""
SLIDE = """(k) => {
  const slider = document.querySelector("#drive input[type=range]");
  slider.value = 0.02 + 0.0005 * (k % 40);
  slider.dispatchEvent(new Event("input"));
}"""


def main(seconds: float) -> None:
    """Print the figures."""
    server = subprocess.Popen(
        [sys.executable, "-m", "udd", "app", "--no-browser", "--port", "0"], stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    link = server.stdout.readline().strip()
    try:
        with sync_playwright() as playwright:
            path = shutil.which("chromium") or shutil.which("google-chrome")
            browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(link)
            page.wait_for_timeout(3000)
            for what in ("one disk", "two disks"):
                page.evaluate("udd.stats.ahead = Infinity")
                frames, took, times = page.evaluate(COUNT, seconds)
                ahead = page.evaluate("udd.stats.ahead")
                print(
                    f"{what}: {frames / took:.1f} frames/s over {took:.1f} s, p95 between frames "
                    f"{np.percentile(times, 95):.1f} ms, at least {ahead:.1f} pieces ahead"
                )
                page.evaluate("document.getElementById('twin').click()")
            page.evaluate("udd.stats.delays.length = 0")
            for k in range(100):
                page.evaluate(SLIDE, k)
                page.wait_for_timeout(60)
            delays = page.evaluate("udd.stats.delays")
            q = np.percentile(delays, [50, 95])
            print(f"slider to frame: median {q[0]:.1f} ms, p95 {q[1]:.1f} ms, of {len(delays)} moves")
            browser.close()
    finally:
        server.terminate()
        server.wait(20)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 5.0)
