"""Sessions give what a replay gives, also after a restart, a crash, or a while on disk."""

import asyncio
import copy
import json
import threading
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from asking import SERVING, Streamed, ask, documents, left, service

from mapfilter.errors import ConfigError, StoreError
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.orbits import gps_time
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.loop import locate as replay
from mapfilter.positioning.merging import epochs
from mapfilter.serving import sessions as sessions_module
from mapfilter.serving.documents import RequestError
from mapfilter.serving.store import LOCK, SessionStore
from mapfilter.simulation.satellites import ReceptionModel, receive
from mapfilter.tracks.log import make_log

COUNT = 60


async def begin(app, **body):
    answer = await ask(app, "POST", "/sessions", {"seed": 0, **body})
    assert answer.code == 201, answer.body
    assert answer.headers["location"] == f"/sessions/{answer.json['id']}"
    return answer.json["id"]


async def post(app, session, sent):
    answer = await ask(app, "POST", f"/sessions/{session}/epochs", {"epochs": sent})
    assert answer.code == 200, answer.body
    return answer.json["fixes"]


@pytest.fixture(scope="module")
def whole(positioner, cross):
    """The fixes of one session without any interruption."""

    async def run(app):
        return await post(app, await begin(app), documents(COUNT)[0])

    with service(positioner, cross.plan) as made:
        return asyncio.run(run(made.app()))


def test_a_session_gives_what_a_replay_gives(positioner, whole):
    track = replay(documents()[1], positioner, np.random.default_rng(0)).estimate
    assert [one["status"] for one in whole] == list(track.status)[:COUNT]
    for name in ("time_s", "east_m", "north_m", "mass_50m", "protection_m"):
        found = np.array([one[name] for one in whole], dtype=np.float64)
        expected = getattr(track, name)[:COUNT]
        expected = np.where(np.isfinite(expected), expected, np.nan)
        np.testing.assert_array_equal(found, expected)
    assert whole[-1]["number"] == COUNT
    assert {"lat_deg", "lon_deg", "radius_95_m", "unused"} <= whole[-1].keys()
    assert whole[-1]["lat_deg"] == pytest.approx(41.15, abs=0.1)


@pytest.mark.parametrize("cuts", [(1, 2, 40), (30,)])
def test_requests_may_be_cut_anywhere_and_the_service_started_again(
    positioner, cross, whole, tmp_path, cuts
):
    sent, fixes, session = documents(COUNT)[0], [], None
    for first, last in zip((0, *cuts), (*cuts, COUNT), strict=True):
        with service(positioner, cross.plan, tmp_path) as made:

            async def run(app, made, part):
                nonlocal session
                session = session or await begin(app)
                fixes.extend(await post(app, session, part))
                shown = (await ask(app, "GET", f"/sessions/{session}")).json
                assert shown["last"] == fixes[-1]
                assert await made.sessions.save_all() == 1
                assert await made.sessions.save_all() == 0

            asyncio.run(run(made.app(), made, sent[first:last]))
    assert fixes == whole
    assert [path.stat().st_mode & 0o077 for path in tmp_path.iterdir()] == [0, 0]


def test_after_a_crash_a_client_goes_on_from_the_last_saved_epoch(
    positioner, cross, whole, tmp_path
):
    sent = documents(COUNT)[0]
    with service(positioner, cross.plan, tmp_path) as made:

        async def before():
            app = made.app()
            session = await begin(app)
            await post(app, session, sent[:20])
            await made.sessions.save_all()
            await post(app, session, sent[20:40])
            return session

        session = asyncio.run(before())
    with service(positioner, cross.plan, tmp_path) as made:

        async def after():
            app = made.app()
            shown = (await ask(app, "GET", f"/sessions/{session}")).json
            assert (shown["epochs"], shown["time_s"]) == (20, sent[19]["time_s"])
            assert shown["saved_time_s"] == shown["time_s"]
            return await post(app, session, [e for e in sent if e["time_s"] > shown["time_s"]])

        assert asyncio.run(after()) == whole[20:]


def test_states_without_room_are_kept_on_disk(positioner, cross, whole, tmp_path):
    sent = documents(COUNT)[0]
    with service(positioner, cross.plan, tmp_path, state_bytes=1) as made:

        async def run():
            app = made.app()
            session, other = await begin(app), await begin(app)
            fixes = []
            for at in range(0, COUNT, 15):
                fixes += await post(app, session, sent[at : at + 15])
                assert made.sessions.held_bytes > 0
                await made.sessions.make_room()
                assert made.sessions.held_bytes == 0
            assert await post(app, other, sent[:5]) == whole[:5]
            return fixes

        assert asyncio.run(run()) == whole


def test_without_a_folder_no_session_begins_when_memory_is_used_up(positioner, cross):
    with service(positioner, cross.plan, state_bytes=1) as made:

        async def run():
            app = made.app()
            await begin(app)
            return await ask(app, "POST", "/sessions", {})

        answer = asyncio.run(run())
    assert (answer.code, answer.reason) == (503, "outOfMemory")


def test_requests_of_one_session_follow_each_other_and_are_whole_or_not_at_all(
    positioner, cross, whole
):
    sent = documents(COUNT)[0]
    with service(positioner, cross.plan, waiting=2) as made:

        async def run():
            app = made.app()
            session = await begin(app)
            path = f"/sessions/{session}/epochs"
            parts = [sent[:20], sent[20:40], sent[40:]]
            asked = [ask(app, "POST", path, {"epochs": part}) for part in parts]
            first, second, third = await asyncio.gather(*asked)
            assert first.json["fixes"] + second.json["fixes"] == whole[:40]
            assert (third.code, third.reason) == (429, "tooManyRequests")
            wrong = [*sent[40:], {"time_s": 1e6, "radio": [{"role": "x"}]}]
            assert (await ask(app, "POST", path, {"epochs": wrong})).code == 400
            again = await ask(app, "POST", path, {"epochs": sent[30:50]})
            assert (again.code, again.reason) == (409, "outOfOrder")
            assert await post(app, session, sent[40:]) == whole[40:]

        asyncio.run(run())


@pytest.mark.parametrize("at_once", [1, COUNT])
def test_times_in_milliseconds_are_refused(positioner, cross, at_once):
    """Rows came every 1000 s, and positions were claimed up to 273 m off."""
    sent = [{**one, "time_s": 1000 * one["time_s"]} for one in documents(COUNT)[0]]

    async def run(app):
        session, answers = await begin(app), []
        for first in range(0, COUNT, at_once):
            part = {"epochs": sent[first : first + at_once]}
            answers.append(await ask(app, "POST", f"/sessions/{session}/epochs", part))
        shown = (await ask(app, "GET", f"/sessions/{session}")).json
        return answers, shown["epochs"]

    with service(positioner, cross.plan) as made:
        answers, taken = asyncio.run(run(made.app()))
    assert answers[-1].code == 400
    assert "milliseconds for s" in answers[-1].json["error"]["message"]
    assert taken < (30 if at_once == 1 else 1)


@pytest.mark.parametrize("cumulative", [True, False])
def test_steps_in_centimetres_or_since_the_start_are_refused(positioner, cross, cumulative):
    sent, gone_m = copy.deepcopy(documents(COUNT)[0]), 0.0
    for one in sent:
        for row in one.get("motion", []):
            gone_m += 20 * row["step_m"]
            row["step_m"] = gone_m if cumulative else 100 * row["step_m"]

    async def run(app):
        session = await begin(app)
        return await ask(app, "POST", f"/sessions/{session}/epochs", {"epochs": sent})

    with service(positioner, cross.plan) as made:
        answer = asyncio.run(run(made.app()))
    assert answer.code == 400
    assert "metres since the row before" in answer.json["error"]["message"]
    assert "centimetres" in answer.json["error"]["message"]


def test_a_known_start_is_tracked_from_there(positioner, cross, whole):
    place = {name: whole[-1][name] for name in ("lat_deg", "lon_deg")}
    with service(positioner, cross.plan) as made:

        async def run():
            app = made.app()
            session = await begin(app, start={**place, "sd_m": 3.0}, name="a phone")
            return await post(app, session, [{"time_s": 0.0, "radio": [SERVING]}])

        (fix,) = asyncio.run(run())
    assert fix["status"] == "TRACKING"
    off_m = np.hypot(fix["east_m"] - whole[-1]["east_m"], fix["north_m"] - whole[-1]["north_m"])
    assert off_m < 10


def test_sessions_end_when_deleted_or_idle_and_leave_nothing(positioner, cross, tmp_path):
    with service(positioner, cross.plan, tmp_path, sessions=2, idle_s=0.05) as made:

        async def run():
            app = made.app()
            one, other = await begin(app), await begin(app)
            full = await ask(app, "POST", "/sessions", {})
            assert (full.code, full.reason) == (503, "tooManySessions")
            stream = Streamed(app, f"/sessions/{one}/events")
            await stream.begun()
            assert (await ask(app, "DELETE", f"/sessions/{one}")).code == 204
            assert await stream.take(1) == [("end", None, {"reason": "deleted"})]
            await stream.parts.get()
            await stream.task
            listed = (await ask(app, "GET", "/sessions")).json["sessions"]
            assert [found["id"] for found in listed] == [other]
            await asyncio.sleep(0.1)
            assert await made.sessions.end_idle() == 1
            for session in (one, other):
                assert (await ask(app, "GET", f"/sessions/{session}")).code == 404

        asyncio.run(run())
    assert [path.name for path in tmp_path.iterdir()] == [LOCK]


def test_a_session_used_while_another_ends_is_not_idle(positioner, cross, monkeypatch):
    with service(positioner, cross.plan, idle_s=60.0) as made:
        end = made.sessions.end

        async def run():
            app = made.app()
            one, other = await begin(app), await begin(app)

            async def slowly(session, reason):
                await end(session, reason)
                if other in made.sessions.all:
                    await post(app, other, documents(1)[0])

            monkeypatch.setattr(made.sessions, "end", slowly)
            for session in made.sessions.all.values():
                session.used_s -= 100.0
            assert await made.sessions.end_idle() == 1
            assert list(made.sessions.all) == [other]
            assert (await ask(app, "GET", f"/sessions/{one}")).code == 404

        asyncio.run(run())


def test_sessions_of_another_database_are_refused(positioner, cross, tmp_path):
    with service(positioner, cross.plan, tmp_path) as made:
        asyncio.run(begin(made.app()))
    with (
        closing(SessionStore.in_folder(tmp_path, "another")) as store,
        pytest.raises(ConfigError, match="sessions of this database"),
    ):
        store.read_all()


def test_a_session_with_satellites_is_restored(positioner, tmp_path):
    """Its hypotheses carry further rows: clock, height and lasting errors."""
    rng, state, start_utc_s = np.random.default_rng(0), positioner.begin(), 1_700_000_000.0
    log, crs = documents()[1], positioner.area.lattice.crs
    almanac = nominal_gps(gps_time(start_utc_s)[0])
    ranges = receive(log.truth, crs, None, almanac, start_utc_s, ReceptionModel(most=4), rng)
    log = replace(log, pseudoranges=make_log(crs, pseudoranges=ranges).pseudoranges)
    for epoch in epochs(log)[:60]:
        state, _ = positioner.step(state, epoch, rng)
    assert state.belief.state.shape[0] > STATES
    value = {
        "name": "a phone", "seed": 0, "began_utc_s": 0.0, "state": state, "epochs": 60,
        "stated": {}, "rng": rng.bit_generator.state, "time_s": 1.0, "last": "",
    }  # fmt: skip
    session = "0" * 22
    with closing(SessionStore.in_folder(tmp_path, "made")) as store:
        store.write(session, value)
        again = store.read(session)["state"]
    np.testing.assert_array_equal(again.belief.state, state.belief.state)
    gnss, belief = again.sources["gnss"], again.belief
    receiver = gnss.receiver
    assert receiver.biases.names == state.sources["gnss"].receiver.biases.names != ()
    short = replace(belief, kept=belief.kept[:, :1])
    other = replace(receiver.biases, names=(*receiver.biases.names, "G99"))
    edited = [
        replace(state, held=(HeldOtherwise(short, Hold(), 0.0, 0.0),)),
        replace(state, unaided=(HeldOtherwise(short, Hold(), 0.0, 0.0),)),
        replace(state, twin=MirroredTwin(short, 0.0)),
    ]
    for changed in (
        replace(receiver, mean=receiver.mean[:3]),
        replace(receiver, covariance=receiver.covariance[:3]),
        replace(receiver, biases=other),
    ):
        sources = {**state.sources, "gnss": replace(gnss, receiver=changed)}
        edited.append(replace(state, sources=sources))
        beside = AlternativeHypothesis(belief, 0.0, 0.0, sources=sources)
        edited.append(replace(state, alternative=beside))
    with closing(SessionStore.in_folder(tmp_path, "made")) as store:
        for one in edited:
            store.write(session, {**value, "state": one})
            with pytest.raises(StoreError, match="arrays of one length"):
                store.read(session)
        held = (HeldOtherwise(belief, Hold(), 0.0, 0.0),)
        store.write(session, {**value, "state": replace(state, held=held)})
        assert len(store.read(session)["state"].held) == 1


def test_a_folder_belongs_to_one_service_at_a_time(positioner, cross, tmp_path):
    with service(positioner, cross.plan, tmp_path) as made:
        session = asyncio.run(begin(made.app()))
        with pytest.raises(ConfigError, match="one in use"):
            SessionStore.in_folder(tmp_path, "another")
    with closing(SessionStore.in_folder(tmp_path, "made")) as store:
        assert list(store.read_all()[0]) == [session]


def test_a_folder_that_cannot_be_locked_is_refused(tmp_path):
    (tmp_path / LOCK).mkdir()
    with pytest.raises(ConfigError, match="directory"):
        SessionStore.in_folder(tmp_path, "made")


def test_damaged_sessions_are_named_and_the_others_restored(positioner, cross, tmp_path):
    with service(positioner, cross.plan, tmp_path) as made:

        async def run():
            app = made.app()
            return [await begin(app) for _ in range(3)]

        ids = asyncio.run(run())
    cut, changed = (tmp_path / f"{one}.session" for one in ids[:2])
    cut.write_bytes(cut.read_bytes()[:-7])
    changed.write_bytes(changed.read_bytes().replace(b'"seed":0', b'"seed":1'))
    (tmp_path / "..session").write_bytes(b"")
    with closing(SessionStore.in_folder(tmp_path, "made")) as store:
        found, lost = store.read_all()
    assert list(found) == [ids[2]]
    assert len(lost) == 3
    assert sum("cut off or changed" in line for line in lost) == 2


def test_listeners_get_fixes_and_what_they_missed(positioner, cross, whole):
    sent = documents(COUNT)[0]
    with service(positioner, cross.plan, listeners=2) as made:

        async def run():
            app = made.app()
            session = await begin(app)
            path = f"/sessions/{session}/events"
            one = Streamed(app, path)
            await one.begun()
            await post(app, session, sent[:10])
            events = await one.take(10)
            assert [json.loads(number) for _, number, _ in events] == list(range(1, 11))
            assert [fix for *_, fix in events] == whole[:10]
            late = Streamed(app, path, {"last-event-id": "7"})
            assert [fix for *_, fix in await late.take(3)] == whole[7:10]
            third = await ask(app, "GET", path)
            assert (third.code, third.reason) == (429, "tooManyRequests")
            for stream in (one, late):
                stream.gone.set()
                stream.parts = asyncio.Queue()
            await left(made.sessions.all[session])

        asyncio.run(run())


def test_a_listener_that_takes_nothing_is_cut_off_and_holds_nobody_up(positioner, cross, whole):
    sent = documents(COUNT)[0]
    with service(positioner, cross.plan, send_s=0.2) as made:

        async def run():
            app = made.app()
            session = await begin(app)
            slow = Streamed(app, f"/sessions/{session}/events")
            await slow.begun()
            assert await post(app, session, sent) == whole
            await asyncio.wait_for(slow.task, 20)
            assert made.sessions.all[session].channel.listeners == set()

        asyncio.run(run())


def test_a_session_that_could_not_begin_is_not_there(positioner, cross, monkeypatch, capsys):
    def broken(*_):
        raise RuntimeError("inner words")

    monkeypatch.setattr(sessions_module, "first", broken)
    with service(positioner, cross.plan) as made:
        answer = asyncio.run(ask(made.app(), "POST", "/sessions", {}))
        assert (answer.code, made.sessions.all) == (500, {})
    assert "inner words" in capsys.readouterr().err


@pytest.mark.parametrize("slow", ["first", "write"])
def test_a_session_whose_client_went_while_it_began_is_not_there(
    positioner, cross, tmp_path, monkeypatch, slow
):
    where = sessions_module if slow == "first" else SessionStore
    whole = getattr(where, slow)

    begun, go = threading.Event(), threading.Event()

    def slowly(*given):
        begun.set()
        assert go.wait(60)
        return whole(*given)

    monkeypatch.setattr(where, slow, slowly)
    with service(positioner, cross.plan, tmp_path) as made:

        async def run():
            task = asyncio.ensure_future(made.sessions.create({}))
            assert await asyncio.to_thread(begun.wait, 60)
            assert len(made.sessions.all) == 1
            task.cancel()
            go.set()
            with pytest.raises(asyncio.CancelledError):
                await task
            assert made.sessions.all == {}

        asyncio.run(run())
    assert list(tmp_path.glob("*.session")) == []


def test_a_request_that_waited_while_its_session_ended_finds_none(positioner, cross, tmp_path):
    sent = documents(2)[0]
    with service(positioner, cross.plan, tmp_path, state_bytes=1) as made:

        async def run():
            app = made.app()
            path = f"/sessions/{(session := await begin(app))}"
            await made.sessions.make_room()
            held = made.sessions.all[session]
            async with held.lock:
                ended = asyncio.ensure_future(ask(app, "DELETE", path))
                # Found before it ends, and gets the lock after that.
                late = asyncio.ensure_future(made.sessions.post(held, {"epochs": sent}))
                await asyncio.sleep(0.01)
            assert (await ended).code == 204
            with pytest.raises(RequestError) as caught:
                await late
            assert caught.value.code == 404

        asyncio.run(run())


def test_a_damaged_file_is_named_to_the_log_only(positioner, cross, tmp_path, capsys):
    with service(positioner, cross.plan, tmp_path, state_bytes=1) as made:

        async def run():
            app = made.app()
            session = await begin(app)
            await made.sessions.make_room()
            (tmp_path / f"{session}.session").write_bytes(b"x")
            path = f"/sessions/{session}/epochs"
            return await ask(app, "POST", path, {"epochs": documents(1)[0]})

        answer = asyncio.run(run())
    assert (answer.code, answer.reason) == (500, "backendError")
    assert str(tmp_path) not in answer.body.decode()
    assert str(tmp_path) in capsys.readouterr().err


@pytest.mark.parametrize("at", [0, 7])
def test_an_epoch_of_another_clock_is_refused_and_the_session_goes_on(positioner, cross, whole, at):
    sent = documents(COUNT)[0]
    with service(positioner, cross.plan) as made:

        async def run():
            app = made.app()
            session = await begin(app)
            assert await post(app, session, sent[:20]) == whole[:20]
            later = sent[20:40]
            wrong = [*later[:at], {**later[at], "time_s": 1e9}, *later[at + 1 :]]
            answer = await ask(app, "POST", f"/sessions/{session}/epochs", {"epochs": wrong})
            assert (answer.code, answer.reason) == (400, "invalid")
            (fault,) = answer.json["error"]["errors"]
            assert fault["location"] == f"epochs[{at}].time_s"
            before = sent[20 + at - 1]["time_s"]
            assert f"expected at most 86400 s later than {before!r}" in fault["message"]
            assert await post(app, session, sent[20:]) == whole[20:]

        asyncio.run(run())


def test_a_session_may_begin_at_any_time_and_pause_for_hours(positioner, cross):
    sent = [
        {**one, "time_s": 1.7e9 + 40_000.0 * number}
        for number, one in enumerate(documents(COUNT)[0][:3])
    ]
    with service(positioner, cross.plan) as made:

        async def run():
            app = made.app()
            assert len(await post(app, await begin(app), sent)) == 3

        asyncio.run(run())
