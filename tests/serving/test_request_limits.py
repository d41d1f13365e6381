"""Who may ask, how much, and how often."""

import asyncio
import gzip
from types import SimpleNamespace

import pytest
from asked_service import answer_of
from asking import JSON, ask, service

from mapfilter.serving import door as door_module
from mapfilter.serving.limits import RateLimit

TOKEN = "0123456789abcdef"


@pytest.fixture(scope="module")
def made(positioner, cross, locate):
    with service(positioner, cross.plan, locate=locate, body_bytes=20_000, receive_s=0.2) as one:
        yield one


def test_bodies_are_limited_in_size_type_and_time(made):
    large = b" " * 20_001
    answer = answer_of(made, "POST", "/sessions", large)
    assert (answer.code, answer.headers["connection"]) == (413, "close")
    announced = {**JSON, "content-length": "9" * 30}
    assert answer_of(made, "POST", "/sessions", b"{}", announced).code == 413
    parts = [b" " * 7000, b" " * 7000, b" " * 7000]
    assert answer_of(made, "POST", "/sessions", parts).code == 413
    packed = {**JSON, "content-encoding": "gzip"}
    bomb = gzip.compress(b" " * 10_000_000)
    assert answer_of(made, "POST", "/sessions", bomb, packed).reason == "unsupportedEncoding"
    plain = {**JSON, "content-type": "text/plain"}
    assert answer_of(made, "POST", "/sessions", b"{}", plain).code == 415
    never = answer_of(made, "POST", "/sessions", [b"{", b" ", None])
    assert (never.code, never.reason) == (408, "timeout")


def test_tokens_are_asked_for(positioner, cross, locate):
    with service(positioner, cross.plan, locate=locate, token=TOKEN) as made:
        for given in (
            {},
            {"authorization": f"Bearer {TOKEN}x"},
            {"authorization": f"Basic {TOKEN}"},
        ):
            answer = answer_of(made, "GET", "/sessions", headers={**JSON, **given})
            assert (answer.code, answer.reason) == (401, "keyInvalid")
            assert TOKEN not in answer.body.decode()
        held = {**JSON, "authorization": f"Bearer {TOKEN}"}
        assert answer_of(made, "GET", "/sessions", headers=held).code == 200
        query = f"key={TOKEN}".encode()
        assert answer_of(made, "GET", "/sessions", query=query).code == 401
        body = {"cellTowers": [{"cellId": 1}]}
        assert answer_of(made, "POST", "/v1/geolocate", body, query=query).code == 404
        assert answer_of(made, "POST", "/v1/geolocate", body).code == 401


@pytest.mark.parametrize(
    ("host", "code"),
    [("localhost:8765", 200), ("127.0.0.1", 200), ("[::1]:1", 200), ("box.lan", 200),
     ("evil.example", 421), ("", 421), ("127.0.0.1.evil.example", 421)],
)  # fmt: skip
def test_pages_of_strangers_cannot_ask_by_a_name_of_theirs(positioner, cross, host, code):
    with service(positioner, cross.plan, names=["box.lan"]) as made:
        assert answer_of(made, "GET", "/", headers={"host": host}).code == code


def test_requests_and_epochs_are_limited_by_rate(positioner, cross):
    with service(positioner, cross.plan, rate_per_s=0.5, burst_s=20.0) as made:

        async def run():
            app = made.app()
            session = (await ask(app, "POST", "/sessions", {})).json["id"]
            path = f"/sessions/{session}/epochs"
            many = [{"time_s": i} for i in range(9)]
            assert (await ask(app, "POST", path, {"epochs": many[:5]})).code == 200
            answer = await ask(app, "POST", path, {"epochs": many[5:]})
            assert answer.code == 200
            answer = await ask(app, "GET", "/")
            assert (answer.code, answer.reason) == (429, "rateLimitExceeded")
            assert answer.json["error"]["message"] == (
                "more epochs and other requests than 0.5 a second, or 10 at once (each epoch of a "
                "request counts)"
            )
            assert int(answer.headers["retry-after"]) >= 1

        asyncio.run(run())


def clock_of(monkeypatch):
    """The door's clock, as a list of one time in seconds."""
    now_s = [0.0]
    monkeypatch.setattr(door_module, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    return now_s


def test_the_largest_request_is_done_at_a_low_rate(positioner, cross, monkeypatch):
    now_s = clock_of(monkeypatch)
    with service(positioner, cross.plan, rate_per_s=50.0) as made:

        async def run():
            app = made.app()
            path = f"/sessions/{(await ask(app, 'POST', '/sessions', {})).json['id']}/epochs"
            now_s[0] += 100.0
            many = [{"time_s": i} for i in range(300)]
            answer = await ask(app, "POST", path, {"epochs": many})
            assert answer.code == 200, answer.body
            assert (await ask(app, "POST", path, {"epochs": many})).code == 429

        asyncio.run(run())


@pytest.mark.parametrize("rate_per_s", [0.1, 0.5])
def test_who_waits_as_long_as_told_is_let_in(positioner, cross, monkeypatch, rate_per_s):
    now_s = clock_of(monkeypatch)
    with service(positioner, cross.plan, rate_per_s=rate_per_s, burst_s=20.0) as made:

        async def run():
            app = made.app()
            path = f"/sessions/{(await ask(app, 'POST', '/sessions', {})).json['id']}/epochs"
            codes = []
            for _ in range(5):
                # With a fault, so that only the limit is tried.
                answer = await ask(app, "POST", path, {"epochs": [0] * 30})
                codes.append(answer.code)
                now_s[0] += float(answer.headers.get("retry-after", 0.0))
            assert codes == [429, 400, 429, 429, 400]

        asyncio.run(run())


def test_a_request_of_too_many_epochs_locks_nobody_out(positioner, cross, monkeypatch):
    clock_of(monkeypatch)
    with service(positioner, cross.plan, rate_per_s=50.0) as made:

        async def run():
            app = made.app()
            path = f"/sessions/{(await ask(app, 'POST', '/sessions', {})).json['id']}/epochs"
            answer = await ask(app, "POST", path, {"epochs": [0] * 300_000})
            assert (answer.code, answer.reason) == (400, "invalid")
            assert (await ask(app, "GET", "/")).code == 200

        asyncio.run(run())


def test_no_debt_grows_beyond_its_bound():
    limit = RateLimit(per_s=1.0, burst=10.0, most_debt=30.0)
    assert limit.wait_s("a", 1e6, now_s=0.0) == 0.0
    assert limit.wait_s("a", 1.0, now_s=0.0) == 31.0
