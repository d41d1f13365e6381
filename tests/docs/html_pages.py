"""Check built pages: links inside them, and in a browser whether any is wider than its screen.

``python -m tests.docs.html_pages docs/_build/html [--api]`` prints what is wrong and ends with 1;
without Chromium it says so and checks the links alone.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from functools import partial
from html import unescape
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import unquote, urlsplit

WIDTHS_PX = (1280, 390)
BROWSERS = ("chromium", "chromium-browser", "google-chrome")

# Opens each page in a frame of each width, one after another, and lists what sticks out.
HARNESS = """<!doctype html><meta charset="utf-8"><title>measuring</title>
<pre id="found"></pre><script>
const pages = PAGES, widths = WIDTHS, found = [];
async function measure(page, width) {
  const frame = document.createElement("iframe");
  frame.style.cssText = `width:${width}px;height:900px;border:0`;
  const loaded = new Promise(done => { frame.onload = done; });
  frame.src = page;
  document.body.append(frame);
  await loaded;
  const inside = frame.contentDocument, root = inside.documentElement;
  if (root.scrollWidth > root.clientWidth + 1) {
    const style = e => frame.contentWindow.getComputedStyle(e);
    const held = e => {
      for (let p = e.parentElement; p && p !== inside.body; p = p.parentElement)
        if (/auto|scroll|hidden/.test(style(p).overflowX)) return true;
      return false;
    };
    const wide = [...inside.body.querySelectorAll("article *, main *")]
      .filter(e => e.getBoundingClientRect().right > root.clientWidth + 1 && !held(e)).slice(0, 3)
      .map(e => `${e.tagName.toLowerCase()}.${e.className}: ${e.textContent.trim().slice(0, 50)}`);
    found.push({page, width, scroll: root.scrollWidth, wide});
  }
  frame.remove();
}
(async () => {
  for (const page of pages) for (const width of widths) await measure(page, width);
  document.getElementById("found").textContent = JSON.stringify(found);
  document.title = "measured";
})();
</script>"""


class _Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: set[str] = set()
        self.links: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id" or (tag == "a" and name == "name"):
                self.targets.add(value or "")
            elif name in ("href", "src") and value:
                self.links.add(value)


def broken_links(root: Path) -> list[str]:
    """Return the links of built pages to files or places in them that are not there."""
    pages = {path: _Page(path.read_text(encoding="utf-8")) for path in sorted(root.rglob("*.html"))}
    broken = []
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or link.startswith(("#top", "javascript:")):
                continue
            target = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
            place = unquote(parts.fragment)
            if not target.exists():
                broken.append(f"{path.relative_to(root)}: {link}")
            elif place and target in pages and place not in pages[target].targets:
                broken.append(f"{path.relative_to(root)}: {link} (no such place)")
    return broken


def overflowing(root: Path, browser: str, pages: list[str]) -> list[dict[str, object]]:
    """Return the pages that are wider than a screen, with what sticks out of them."""
    handler = partial(_Quiet, directory=str(root))
    with (
        ThreadingHTTPServer(("127.0.0.1", 0), handler) as server,
        tempfile.TemporaryDirectory() as home,
    ):
        _Quiet.harness = HARNESS.replace("PAGES", json.dumps(pages)).replace(
            "WIDTHS", json.dumps(WIDTHS_PX)
        )
        Thread(target=server.serve_forever, daemon=True).start()
        command = [
            browser, "--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={home}",
            "--virtual-time-budget=600000", "--window-size=1400,1000", "--dump-dom",
            f"http://127.0.0.1:{server.server_port}/harness",
        ]  # fmt: skip
        shown = subprocess.run(command, capture_output=True, text=True, timeout=900, check=True)
        server.shutdown()
    found = re.search(r'<pre id="found">(.*?)</pre>', shown.stdout, re.DOTALL)
    if found is None or "<title>measured</title>" not in shown.stdout:
        raise RuntimeError(f"the browser measured nothing: {shown.stderr[-500:]}")
    return json.loads(unescape(found[1]))


class _Quiet(SimpleHTTPRequestHandler):
    harness = ""

    def do_GET(self) -> None:
        if self.path != "/harness":
            super().do_GET()
            return
        body = self.harness.encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Print nothing."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root", type=Path)
    parser.add_argument("--api", action="store_true", help="measure the pages of modules, too")
    given = parser.parse_args()
    root = given.root.resolve()
    wrong = broken_links(root)
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        sys.stderr.write("no Chromium found: widths were not measured\n")
    else:
        names = sorted(path.relative_to(root).as_posix() for path in root.rglob("*.html"))
        pages = [name for name in names if given.api or not name.startswith("api/")]
        wrong += [json.dumps(one, ensure_ascii=False) for one in overflowing(root, browser, pages)]
    sys.stdout.write("".join(f"{line}\n" for line in wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
