"""Asking a service in this process, without a socket; and a small service over a made cross."""

import asyncio
import contextlib
import json
import time
from dataclasses import dataclass

from positioning.cross_world import walk_log

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.merging import epochs
from mapfilter.radio.plan_names import PlanNames
from mapfilter.serving.app import Service
from mapfilter.serving.filters import SessionFilters
from mapfilter.serving.limits import ServiceLimits
from mapfilter.serving.sessions import Sessions
from mapfilter.serving.store import SessionStore

JSON = {"content-type": "application/json", "host": "localhost"}
SMALL = BayesFilter(max_particles=1500, min_search_particles=800, min_particles=300)
SERVING = {"role": "serving", "cell": "W", "level_dbm": -70.0}


@dataclass
class Answer:
    code: int
    headers: dict
    body: bytes

    @property
    def json(self):
        return json.loads(self.body)

    @property
    def reason(self):
        return self.json["error"]["errors"][0]["reason"]


def request(method, path, body=b"", headers=None, query=b""):
    """The scope of a request, and its client's messages; after a part None nothing more comes."""
    body = body if isinstance(body, bytes | list) else json.dumps(body).encode()
    parts = body if isinstance(body, list) else [body]
    held = JSON if headers is None else headers
    scope = {
        "type": "http",
        "method": method,
        "path": path,
        "raw_path": path.encode(),
        "query_string": query,
        "headers": [(k.lower().encode(), v.encode()) for k, v in held.items()],
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
        "scheme": "http",
        "http_version": "1.1",
        "root_path": "",
    }
    ends = [False] * (len(parts) - 1) + [True]
    both = [(part, end) for part, end in zip(parts, ends, strict=True) if part is not None]
    more = [{"type": "http.request", "body": part, "more_body": not end} for part, end in both]
    return scope, more


async def ask(app, method, path, body=b"", headers=None, query=b""):
    """Return the answer to one request."""
    scope, messages = request(method, path, body, headers, query)
    sent = []

    async def receive():
        if not messages:
            await asyncio.sleep(3600)
        return messages.pop(0)

    async def send(message):
        sent.append(message)

    await app(scope, receive, send)
    start = sent[0]
    named = {k.decode(): v.decode() for k, v in start["headers"]}
    return Answer(start["status"], named, b"".join(m.get("body", b"") for m in sent[1:]))


class Streamed:
    """A client of a stream of events; it takes a part when it is asked to."""

    def __init__(self, app, path, headers=None, query=b""):
        self.gone, self.parts = asyncio.Event(), asyncio.Queue(maxsize=1)
        self.answered = asyncio.Event()
        scope, messages = request("GET", path, headers={**JSON, **(headers or {})}, query=query)

        async def receive():
            if messages:
                return messages.pop(0)
            await self.gone.wait()
            return {"type": "http.disconnect"}

        async def send(message):
            self.answered.set()
            await self.parts.put(message)

        self.task = asyncio.ensure_future(app(scope, receive, send))

    async def begun(self):
        """Wait until the service has answered: it listens from then on."""
        await asyncio.wait_for(self.answered.wait(), 60)

    async def take(self, count):
        """Return the next events with data, as (name, number, document)."""
        found = []
        while len(found) < count:
            part = await asyncio.wait_for(self.parts.get(), 60)
            lines = part.get("body", b"").decode().splitlines()
            held = dict(line.split(": ", 1) for line in lines if line and line[0] != ":")
            if "data" in held:
                found.append((held["event"], held.get("id"), json.loads(held["data"])))
        return found


async def left(session):
    """Wait until nobody listens to a session."""
    until_s = time.monotonic() + 60
    while session.channel.listeners:
        assert time.monotonic() < until_s
        await asyncio.sleep(0.01)


@contextlib.contextmanager
def service(positioner, plan, folder=None, locate=None, token="", names=(), **limits):
    """A service, with its sessions saved in a folder or nowhere."""
    held = ServiceLimits(**({"rate_per_s": 1e5} | limits))
    store = SessionStore.in_folder(folder, "made") if folder is not None else None

    def make(fitted):
        return positioner if fitted == SMALL else fitted.over_area(positioner.area)

    filters = SessionFilters(SMALL, make, plan)
    sessions = Sessions(filters, PlanNames(plan), held, store)
    with contextlib.ExitStack() as stack:
        if store is not None:
            stack.enter_context(contextlib.closing(store))
        stack.enter_context(contextlib.closing(sessions))
        if store is not None:
            found, lost = store.read_all()
            assert not lost
            sessions.restore(found)
        yield Service(sessions, locate, held, token, frozenset(names))


def documents(count=None):
    """The epochs of the walk on the cross, as a client sends them; the log, and its epochs."""
    log = walk_log()
    radio = log.radio.iloc[1:].assign(level_dbm=-70.0)
    log = walk_log(radio=radio)
    sent = []
    for epoch in epochs(log)[:count]:
        one = {"time_s": epoch.time_s}
        one["motion"] = [{"step_m": m.step_m, "heading_rad": m.heading_rad} for m in epoch.motion]
        one["radio"] = [
            {"role": r.role, "cell": r.cell, "level_dbm": r.level_dbm} for r in epoch.radio
        ]
        sent.append(one)
    return sent, log
