"""The page of a session: what it is allowed, what it gets, and what it costs others."""

import asyncio
import gzip
import json
import time

import numpy as np
import pytest
from asking import JSON, Streamed, ask, documents, left, service

from mapfilter.serving import steps
from mapfilter.serving.events import KEPT_FIXES, Channel
from mapfilter.serving.live_page import LivePage
from mapfilter.viewing.arrays import unpacked
from mapfilter.viewing.bundle import database_bundle

COUNT = 40
TOKEN = "t" * 32


@pytest.fixture(scope="module")
def bundle(cross, positioner):
    return database_bundle("Made cross", cross, positioner)


@pytest.fixture
def made(positioner, cross, bundle):
    """Return a function that makes a service with pages."""

    def of(**options):
        found = service(positioner, cross.plan, **options)
        held = found.__enter__()
        held_open.append(found)
        object.__setattr__(held, "page", LivePage(lambda: bundle))
        return held

    held_open = []
    yield of
    for one in held_open:
        one.__exit__(None, None, None)


async def begin(app, headers=None):
    return (await ask(app, "POST", "/sessions", {"seed": 0}, headers)).json["id"]


async def post(app, session, sent):
    answer = await ask(app, "POST", f"/sessions/{session}/epochs", {"epochs": sent})
    assert answer.code == 200, answer.body
    return answer.json["fixes"]


def test_the_page_loads_its_own_files_and_nothing_inline(made):
    app = made().app()

    async def run():
        session = await begin(app)
        page = await ask(app, "GET", f"/view/{session}")
        files = [await ask(app, "GET", f"/view/{name}") for name in ("page.js", "page.css")]
        gone = await ask(app, "GET", "/view/none")
        return page, files, gone, await ask(app, "GET", "/view/")

    page, files, gone, listed = asyncio.run(run())
    policy = page.headers["content-security-policy"]
    assert "unsafe" not in policy
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    html = page.body.decode()
    assert html.count("<script") == 1
    assert '<script src="page.js"></script>' in html
    assert "<style" not in html
    assert "onclick" not in html
    assert [one.headers["content-type"] for one in files] == [
        "text/javascript; charset=utf-8",
        "text/css; charset=utf-8",
    ]
    assert gone.code == 404
    assert listed.body == page.body


def test_the_map_is_made_once_and_is_that_of_the_database(made, bundle, cross):
    calls = []

    def make():
        calls.append(1)
        return bundle

    held = made()
    held.page.make_map = make
    app = held.app()

    async def run():
        return await asyncio.gather(*[ask(app, "GET", "/view/map") for _ in range(4)])

    answers = asyncio.run(run())
    assert len(calls) == 1
    found = json.loads(gzip.decompress(answers[-1].body))
    assert found["kind"] == "live"
    assert [cell["id"] for cell in found["cells"]] == list(cross.plan.ids)
    assert found["why"]["weight"] > 0
    assert {"lost", "search"} <= found["thresholds"].keys()


def test_pages_take_the_token_in_their_address_and_hand_it_on(made):
    app = made(token=TOKEN).app()
    known = {**JSON, "authorization": f"Bearer {TOKEN}"}

    async def run():
        session = await begin(app, known)
        for path in ("/view/", f"/view/{session}", "/view/page.js", "/view/page.css", "/view/map"):
            assert (await ask(app, "GET", path)).code == 401
            assert (await ask(app, "GET", path, query=b"key=wrong")).code == 401
            found = await ask(app, "GET", path, query=f"key={TOKEN}".encode())
            assert found.code == 200
        refused = await ask(app, "GET", f"/sessions/{session}", query=f"key={TOKEN}".encode())
        assert refused.code == 401
        return await ask(app, "GET", f"/view/{session}", query=f"key={TOKEN}".encode())

    page = asyncio.run(run()).body.decode()
    assert f'src="page.js?key={TOKEN}"' in page
    assert f'href="page.css?key={TOKEN}"' in page


def test_a_page_by_a_strangers_name_is_refused(made):
    app = made().app()
    strange = {**JSON, "host": "evil.example"}
    assert asyncio.run(ask(app, "GET", "/view/", headers=strange)).code == 421


def test_a_watched_session_gives_the_same_fixes_with_details_and_beliefs(made):
    sent = documents(COUNT)[0]
    held = made()

    async def run():
        app = held.app()
        session, other = await begin(app), await begin(app)
        page = Streamed(app, f"/sessions/{session}/events", query=b"detail=1")
        plain = Streamed(app, f"/sessions/{session}/events")
        await page.begun()
        await plain.begun()
        for one in sent[:COUNT]:
            await post(app, session, [one])
        alone = await post(app, other, sent)
        return alone, await page.take(2 * COUNT - 1), await plain.take(COUNT)

    alone, events, plain = asyncio.run(run())
    assert [fix for *_, fix in plain] == alone
    fixes = [fix for name, _, fix in events if name == "fix"]
    beliefs = [one for name, _, one in events if name == "belief"]
    details = [fix.pop("detail") for fix in fixes]
    assert fixes == alone[: len(fixes)]
    assert len(beliefs) > COUNT // 2
    assert unpacked(beliefs[-1]["mass"]).max() == 255
    rows = [row for one in details for row in one["readings"]]
    assert {row["use"] for row in rows} >= {"used"}
    assert any(row["predicted_dbm"] is not None for row in rows)
    explained = [one["explained"] for one in details if one["explained"]]
    assert {row["term"] for one in explained for row in one["rows"]} >= {"streets", "serving"}


def test_a_page_that_comes_back_misses_nothing_that_is_kept(made):
    sent = documents(COUNT)[0]
    held = made()

    async def run():
        app = held.app()
        session = await begin(app)
        path = f"/sessions/{session}/events"
        page = Streamed(app, path, query=b"detail=1")
        await page.begun()
        await post(app, session, sent[:5])
        assert [n for name, n, _ in await page.take(6) if name == "fix"] == list("12345")
        page.gone.set()
        page.parts = asyncio.Queue()
        await left(held.sessions.all[session])
        # Cut off: details are made for a while all the same.
        await post(app, session, sent[5:8])
        by_header = Streamed(app, path, {"last-event-id": "5"}, query=b"detail=1&after=2")
        by_address = Streamed(app, path, query=b"detail=1&after=6")
        found = await by_header.take(4)
        later = await by_address.take(3)
        return found, later

    found, later = asyncio.run(run())
    assert [number for name, number, _ in found] == ["6", "7", "8", None]
    assert all("detail" in fix for name, _, fix in found if name == "fix")
    assert [number for _, number, _ in later] == ["7", "8", None]
    assert found[-1][0] == later[-1][0] == "belief"


def test_nothing_is_described_where_nobody_watches(made, monkeypatch):
    sent = documents(4)[0]
    held = made()
    monkeypatch.setattr(type(held.sessions.filters.usual.watcher), "detail", None)

    async def run():
        app = held.app()
        session = await begin(app)
        plain = Streamed(app, f"/sessions/{session}/events")
        await plain.begun()
        await post(app, session, sent)
        return await plain.take(4)

    assert all("detail" not in fix for *_, fix in asyncio.run(run()))


def test_a_fault_in_what_pages_show_costs_the_device_nothing(made, monkeypatch, capsys):
    def failing(*_):
        raise ValueError("a fault of the page")

    monkeypatch.setattr(steps.Watcher, "detail", failing)
    monkeypatch.setattr(steps.Watcher, "belief", failing)
    held = made()
    sent = documents(4)[0]

    async def run():
        app = held.app()
        session = await begin(app)
        plain = await post(app, session, sent[:2])
        held.sessions.all[session].channel.expect(time.monotonic())
        watched = await post(app, session, sent[2:])
        return plain + watched, held.sessions.all[session].channel.kept[-1].detailed

    fixes, detailed = asyncio.run(run())
    assert [one["number"] for one in fixes] == [1, 2, 3, 4]
    assert json.loads(detailed)["detail"] == {}
    # Once, though it comes with each epoch.
    assert capsys.readouterr().err.count("ValueError: a fault of the page") == 1


def test_so_many_sessions_may_be_watched_and_no_more(made):
    held = made(watched=1)

    async def run():
        app = held.app()
        one, other = await begin(app), await begin(app)
        first = Streamed(app, f"/sessions/{one}/events", query=b"detail=1")
        await first.begun()
        full = await ask(app, "GET", f"/sessions/{other}/events", query=b"detail=1")
        assert (full.code, full.reason) == (429, "tooManyRequests")
        plain = Streamed(app, f"/sessions/{other}/events")
        await plain.begun()
        assert len(held.sessions.all[other].channel.listeners) == 1
        assert first.task.done() is False
        plain.gone.set()

    asyncio.run(run())


def test_the_last_place_to_watch_is_given_once(made):
    """Pages that open at the same time are counted before their beliefs are made."""
    held = made(watched=1)

    async def run():
        app = held.app()
        ids = [await begin(app) for _ in range(3)]
        streams = [Streamed(app, f"/sessions/{one}/events", query=b"detail=1") for one in ids]
        for stream in streams:
            await stream.begun()
        return [len(held.sessions.all[one].channel.listeners) for one in ids], streams

    found, _ = asyncio.run(run())
    assert sum(found) == 1


@pytest.mark.parametrize("query", ["detail=2", "detail=true", "after=x", "after=-1", "after=1.5"])
def test_what_a_listener_asks_for_in_vain_is_refused(made, query):
    held, name = made(), query.partition("=")[0]

    async def run():
        app = held.app()
        session = await begin(app)
        path = f"/sessions/{session}/events"
        refused = await asyncio.wait_for(ask(app, "GET", path, query=query.encode()), 10)
        return refused, held.sessions.all[session].channel.listeners

    refused, listeners = asyncio.run(run())
    assert refused.code == 400
    assert refused.json["error"]["errors"][0]["location"] == name
    assert not listeners


def test_a_full_session_is_refused_before_its_belief_is_made(made):
    held = made(listeners=1)

    async def run():
        app = held.app()
        session = await begin(app)
        first = Streamed(app, f"/sessions/{session}/events")
        await first.begun()
        answer = await ask(app, "GET", f"/sessions/{session}/events", query=b"detail=1")
        now_s = time.monotonic()
        return answer.code, held.sessions.all[session].channel.is_watched(now_s), first

    code, watched, _ = asyncio.run(run())
    assert (code, watched) == (429, False)


def test_details_are_dropped_once_nobody_has_watched_for_a_while():
    channel = Channel()
    page = channel.listen(0, detail=True)
    channel.publish(1, [b'{"a":1}'], [b'{"rows":[]}'], b'{"number":1}')
    plain = channel.listen(0)
    channel.leave(page, 100.0)
    channel.forget_details(101.0)
    assert channel.described
    assert b"rows" in channel.kept[0].detailed
    channel.forget_details(200.0)
    assert [(one.number, one.detailed) for one in channel.kept] == [(1, b'{"a":1}')]
    assert (channel.belief, channel.described) == (b"", False)
    assert channel.listeners == {plain}


def test_a_request_of_many_epochs_reaches_a_listener_whole():
    """As many fixes as a request may have fit into the queue, beside those that were kept."""
    channel = Channel()
    channel.publish(1, [b"{}"] * KEPT_FIXES, [])
    listener = channel.listen(0)
    channel.publish(KEPT_FIXES + 1, [b"{}"] * 300, [])
    assert listener.open
    assert listener.waiting.qsize() == KEPT_FIXES + 300


def test_contributions_of_the_last_epochs_of_a_long_request_only(positioner, made):
    held = made()
    sent = documents(steps._MOST_WATCHED + 6)[0]
    before = steps.first(positioner, 0, None)
    names, usual = held.sessions.names, held.sessions.filters.usual
    plain = steps.stepped(usual, names, before, {"epochs": sent})
    rich = steps.stepped(usual, names, before, {"epochs": sent}, watched=True)
    assert rich.fixes == plain.fixes
    assert rich.progress.rng == plain.progress.rng
    assert (plain.details, plain.belief) == ([], b"")
    explained = [json.loads(one)["explained"] for one in rich.details]
    assert explained[:6] == [None] * 6
    assert any(explained)
    np.testing.assert_equal(json.loads(rich.belief)["number"], len(sent))


def test_a_restored_session_shows_its_last_fix_at_once(positioner, cross, tmp_path):
    sent = documents(6)[0]

    async def save(held):
        app = held.app()
        session = await begin(app)
        await post(app, session, sent)
        await held.sessions.save_all()
        return session

    with service(positioner, cross.plan, tmp_path) as held:
        session = asyncio.run(save(held))

    async def watch(held):
        page = Streamed(held.app(), f"/sessions/{session}/events", query=b"detail=1")
        return await page.take(2)

    began_s = time.monotonic()
    with service(positioner, cross.plan, tmp_path) as held:
        fix, belief = asyncio.run(watch(held))
    assert (fix[0], fix[1], belief[0]) == ("fix", "6", "belief")
    assert belief[2]["number"] == 6
    assert time.monotonic() - began_s < 20


def test_a_session_that_ends_while_its_belief_is_made_has_no_stream(made):
    held = made()

    async def run():
        app = held.app()
        session = await begin(app)
        watch = held.sessions.watch

        async def slow(one):
            await watch(one)
            await held.sessions.end(one, "deleted")

        held.sessions.watch = slow
        return await ask(app, "GET", f"/sessions/{session}/events", query=b"detail=1")

    assert asyncio.run(run()).code == 404
