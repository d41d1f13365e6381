"""The live page in a browser, over a service that gets epochs while the page is open."""

import asyncio
import json
import socket
import threading
import time
import urllib.request
from contextlib import contextmanager

import pytest
import uvicorn
from asking import documents, service
from viewing.browser import Watched, opened

from mapfilter.serving.live_page import LivePage
from mapfilter.viewing.bundle import database_bundle

HOSTILE = "<img src=x onerror=alert(1)>"
SENT = documents(60)[0]


@pytest.fixture(scope="module")
def browser():
    with opened() as found:
        yield found


class Running:
    """A service behind a socket, in a thread of this process."""

    def __init__(self, held):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{self.socket.getsockname()[1]}"
        self.server = uvicorn.Server(uvicorn.Config(held.app(), log_config=None, lifespan="off"))
        self.held, self.loop = held, asyncio.new_event_loop()
        serving = self.server.serve(sockets=[self.socket])
        self.thread = threading.Thread(
            target=self.loop.run_until_complete, args=(serving,), daemon=True
        )
        self.thread.start()

    def ask(self, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(self.address + path, data, headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)

    def post(self, session, sent):
        self.ask(f"/sessions/{session}/epochs", {"epochs": sent})

    def cut(self, session):
        """Cut all streams of a session, as a network would."""

        def close():
            for one in self.held.sessions.all[session].channel.listeners:
                one.close()

        self.loop.call_soon_threadsafe(close)

    def end(self):
        self.server.should_exit = self.server.force_exit = True
        self.thread.join(20)
        self.loop.close()


@contextmanager
def running(positioner, cross, **options):
    bundle = database_bundle("Made cross", cross, positioner)
    with service(positioner, cross.plan, **options) as held:
        object.__setattr__(held, "page", LivePage(lambda: bundle))
        made = Running(held)
        try:
            yield made
        finally:
            for session in held.sessions.all:
                made.cut(session)
            made.end()


def test_fixes_appear_while_they_come(browser, positioner, cross):
    with running(positioner, cross) as made:
        session = made.ask("/sessions", {"seed": 0, "name": HOSTILE})["id"]
        view = Watched(browser, f"{made.address}/view/{session}", own=made.address)
        assert view.page.inner_text("#title") == HOSTILE
        assert view.page.inner_text("#status") == "waiting"
        view.until("MF.page.live.state === 'live'")
        for number, one in enumerate(SENT[:30], 1):
            made.post(session, [one])
            view.until(f"MF.page.live.run.count === {number}", 10)
        view.until("MF.page.store.state.time === MF.page.end")
        run = "MF.page.live.run"
        assert view.page.evaluate(f"{run}.frameAt({run}.count - 1)") >= 0
        view.until("document.querySelector('#status').textContent !== 'waiting'")
        assert view.page.evaluate(f"{run}.readingsOf(29).length") > 0
        # The charts have grown to the last epoch.
        view.until("document.querySelectorAll('.chart canvas').length >= 2")
        # Looking back holds the page there while fixes come in; "Follow" goes on.
        view.page.evaluate("MF.page.seek(MF.page.start + 3)")
        view.settle()
        assert view.page.get_attribute("#follow", "aria-pressed") == "false"
        made.post(session, SENT[30:40])
        view.until(f"{run}.count === 40")
        view.settle()
        assert view.state("time") == view.page.evaluate("MF.page.start + 3")
        view.page.click("#follow")
        view.until("MF.page.store.state.time === MF.page.end")
        # A click on the map asks why the position is not there.
        box = view.page.locator(".sheet").bounding_box()
        view.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        view.settle()
        assert view.page.inner_text(".why .verdict").startswith("Taken by itself")
        assert view.page.locator("img").count() == 0
        made.ask("/sessions")
        view.close()


def test_after_a_cut_the_page_gets_what_it_missed(browser, positioner, cross):
    with running(positioner, cross) as made:
        session = made.ask("/sessions", {"seed": 0})["id"]
        view = Watched(browser, f"{made.address}/view/{session}", own=made.address)
        view.until("MF.page.live.state === 'live'")
        made.post(session, SENT[:10])
        view.until("MF.page.live.run.count === 10")
        made.cut(session)
        view.until("MF.page.live.state === 'reconnecting'")
        made.post(session, SENT[10:25])
        assert view.page.evaluate("MF.page.live.run.count") == 10
        view.until("MF.page.live.run.count === 25", 30)
        numbers = view.page.evaluate("MF.page.live.run.epochs.number")
        assert numbers == list(range(1, 26))
        assert view.page.evaluate("MF.page.live.run.missed") == 0
        view.close()


def test_a_page_that_is_refused_says_why_and_comes_in_when_there_is_room(
    browser, positioner, cross
):
    with running(positioner, cross, listeners=1) as made:
        session = made.ask("/sessions", {"seed": 0})["id"]
        address = f"{made.address}/view/{session}"
        first = Watched(browser, address, own=made.address)
        first.until("MF.page.live.state === 'live'")
        second = Watched(browser, address, own=made.address, hurry=20)
        second.until("MF.page.live.state.startsWith('refused: 1 streams')")
        second.page.wait_for_selector("#link:has-text('refused')")
        first.close()
        second.until("MF.page.live.state === 'live'", 60)
        made.post(session, SENT[:5])
        second.until("MF.page.live.run.count === 5")
        # The browser itself reports the refusals.
        second.faults = [one for one in second.faults if "429" not in one]
        second.close()


def test_sent_again_after_a_crash_counts_once(browser, positioner, cross):
    with running(positioner, cross) as made:
        session = made.ask("/sessions", {"seed": 0})["id"]
        view = Watched(browser, f"{made.address}/view/{session}", own=made.address)
        made.post(session, SENT[:10])
        view.until("MF.page.live.run.count === 10")
        found = view.page.evaluate(
            """() => {
              const { run } = MF.page.live;
              const fix = (number, time_s) => ({ number, time_s, status: "TRACKING", reason: "used",
                east_m: 1, north_m: 1, runner_up_east_m: null, unused: [] });
              run.push(fix(7, 70)); run.push(fix(8, 80)); run.push(fix(12, 120));
              return [run.epochs.number, run.readings.first.raw.length, run.missed, run.count];
            }"""
        )
        assert found == [[1, 2, 3, 4, 5, 6, 7, 8, 12], 10, 3, 9]
        view.close()


def test_old_epochs_go_when_there_are_many(browser, positioner, cross):
    with running(positioner, cross) as made:
        session = made.ask("/sessions", {"seed": 0})["id"]
        view = Watched(browser, f"{made.address}/view/{session}", own=made.address)
        began_s = time.monotonic()
        found = view.page.evaluate(
            """() => {
              const bundle = MF.page.bundle;
              const run = MF.makeLiveRun(bundle, "many");
              const row = { cell: 0, role: "serving", name: "W", level_dbm: -70, use: "used" };
              const detail = { readings: [row] };
              for (let i = 1; i <= 20010; i += 1) {
                run.push({ number: i, time_s: i, status: "TRACKING", reason: "used", east_m: 1,
                  north_m: 1, runner_up_east_m: null, unused: [], detail });
              }
              const { first, cell } = run.readings;
              return [run.count, run.start, run.end, first.raw.length, cell.raw.length,
                run.readingsOf(5).length];
            }"""
        )
        assert found == [15010, 5001, 20010, 15011, 15010, 1]
        assert time.monotonic() - began_s < 60
        view.close()


def test_the_list_of_sessions_leads_to_their_pages(browser, positioner, cross):
    with running(positioner, cross) as made:
        made.ask("/sessions", {"seed": 0, "name": "phone 1"})
        view = Watched(browser, f"{made.address}/view/", own=made.address, width=390)
        view.page.click("text=phone 1")
        view.page.wait_for_selector("html[data-ready=true] #follow")
        assert view.page.inner_text("#title") == "phone 1"
        assert view.page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
        view.close()


def test_a_session_that_has_ended_says_so(browser, positioner, cross):
    with running(positioner, cross) as made:
        session = made.ask("/sessions", {"seed": 0})["id"]
        view = Watched(browser, f"{made.address}/view/{session}", own=made.address)
        view.until("MF.page.live.state === 'live'")
        request = urllib.request.Request(f"{made.address}/sessions/{session}", method="DELETE")
        urllib.request.urlopen(request, timeout=20).close()
        view.until("document.querySelector('#link').textContent === 'ended: deleted'")
        view.close()
