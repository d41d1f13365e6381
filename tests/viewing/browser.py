"""Debian's Chromium by Playwright, with the network cut; a plain reason where it is missing."""

import shutil
import time
from contextlib import contextmanager

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")

HURRY = """const later = window.setTimeout;
window.setTimeout = (task, wait_ms, ...given) => later(task, wait_ms / %g, ...given);"""


def executable():
    """Path of the browser; skips the test where there is none."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed")
    return found


@contextmanager
def opened():
    """A browser that is closed afterwards."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no browser tests: the package playwright is not installed"
    )
    path = executable()
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        try:
            yield browser
        finally:
            browser.close()


class Watched:
    """A page that remembers what must not happen: requests, errors, messages of the console.

    It is a file, with the network cut; or an address of the service ``own``, the only one it may
    ask. What the page wants to do later it does so many times sooner as ``hurry`` says.
    """

    def __init__(
        self, browser, file, *, at="", width=1280, height=860, scheme="light", own="", hurry=1
    ):
        self.own = (f"{own}/", "blob:", "data:") if own else ("file:", "blob:", "data:")
        self.context = browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme=scheme,
            offline=not own,
            accept_downloads=True,
            reduced_motion="reduce",
        )
        if hurry != 1:
            self.context.add_init_script(HURRY % hurry)
        self.page = self.context.new_page()
        self.faults, self.requests = [], []
        self.page.on("console", lambda one: self.faults.append(f"{one.type}: {one.text}"))
        self.page.on("pageerror", lambda one: self.faults.append(str(one)))
        self.page.on("dialog", lambda one: (self.faults.append("dialog"), one.dismiss()))
        self.page.on("request", lambda one: self.requests.append(one.url))
        self.page.goto(file if own else file.as_uri() + at)
        self.page.wait_for_selector("html[data-ready=true]")
        self.settle()

    def settle(self):
        """Wait until the page has drawn what changed."""
        self.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )

    def until(self, expression, timeout_s=30.0):
        """Wait until an expression of the page is true; its policy forbids Playwright's own way."""
        end = time.monotonic() + timeout_s
        while not self.page.evaluate(expression):
            assert time.monotonic() < end, expression
            self.settle()

    def press(self, key):
        self.page.keyboard.press(key)
        self.settle()

    def state(self, key):
        return self.page.evaluate(f"MF.page.store.state.{key}")

    def close(self):
        self.context.close()
        elsewhere = [url for url in self.requests if not url.startswith(self.own)]
        assert elsewhere == []
        assert self.faults == []
