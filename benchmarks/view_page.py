"""Measure a page of ``replay --html`` or ``view`` in Debian's Chromium with the network cut.

Usage: python benchmarks/view_page.py PAGE.html [SECONDS]

Prints the size, the time until the page is ready, frames per second while it plays, and the time
that the page's own drawing takes per frame, which does not depend on the display.
"""

import shutil
import sys
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

FRAMES = """(ms) => new Promise((done) => {
  let frames = 0;
  const from = performance.now();
  MF.stats.frames = 0;
  MF.stats.draw_ms = 0;
  const next = (now) => {
    frames += 1;
    if (now - from < ms) requestAnimationFrame(next);
    else done([(1000 * frames) / (now - from), MF.stats.draw_ms / Math.max(MF.stats.frames, 1)]);
  };
  requestAnimationFrame(next);
})"""
SQUARES = """Math.max(0, ...MF.page.runs.filter((run) => run.belief).map((run) => {
  const first = run.belief.first.raw;
  return first.reduce((most, at, i) => Math.max(most, i ? at - first[i - 1] : 0), 0);
}))"""


def main(path: Path, seconds: float) -> None:
    """Open the page and print what was measured."""
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("no browser: chromium is not installed")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_context(offline=True, viewport={"width": 1280, "height": 860}).new_page()
        before = time.perf_counter()
        page.goto(path.resolve().as_uri())
        page.wait_for_selector("html[data-ready=true]", timeout=120_000)
        opened_s = time.perf_counter() - before
        print(f"size: {path.stat().st_size / 1e6:.2f} MB")
        own_s = page.evaluate("MF.ready") / 1e3
        print(f"ready: {opened_s:.2f} s, of which the page itself {own_s:.2f} s")
        if page.evaluate("MF.page.runs.length"):
            print(f"squares of the largest frame: {page.evaluate(SQUARES)}")
            page.evaluate("MF.page.play(true)")
            rate, draw_ms = page.evaluate(FRAMES, 1000 * seconds)
            print(f"frames: {rate:.1f} a second over {seconds:g} s; drawing {draw_ms:.2f} ms each")
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 5.0)
