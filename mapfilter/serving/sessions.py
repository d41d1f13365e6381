"""Sessions: one filter state for each device, in memory and, where there is a folder, saved.

The filter, and with it the map of the area, is shared by all sessions. A session's state is the
frozen state of the filter and its random generator. A request of several epochs counts as a whole
or not at all.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from math import nan
from typing import Any, TypeVar

import numpy as np

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import project
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.serving.documents import RequestError, check_keys, number, text, whole
from mapfilter.serving.epoch_rows import read_epochs
from mapfilter.serving.events import Channel, fix_document, json_bytes
from mapfilter.serving.limits import ServiceLimits
from mapfilter.serving.store import SessionStore
from mapfilter.tracks.identify import PlanNames

ResultT = TypeVar("ResultT")

_SEED_BITS = 63
_EMPTY_STATE_BYTES = 20_000
_ROOM = 0.9
"""Share of the memory that is left in use when there was too little."""


@dataclass(frozen=True, slots=True)
class Progress:
    """All that a session needs to go on; frozen, so that it can be saved while others come.

    Parameters
    ----------
    state : BayesState
        Of the filter.
    rng : mapping
        State of the random generator.
    epochs : int
        Epochs so far.
    time_s : float
        Time of the last one; NaN before the first.
    last : bytes
        The last fix as JSON; empty before the first.
    """

    state: BayesState
    rng: Mapping[str, Any]
    epochs: int = 0
    time_s: float = nan
    last: bytes = b""

    @property
    def state_bytes(self) -> int:
        """Memory of the state, but for some kilobytes."""
        beliefs = [self.state.belief]
        if self.state.alternative is not None:
            beliefs.append(self.state.alternative.belief)
        arrays = [getattr(b, name) for b in beliefs for name in _ARRAYS if hasattr(b, name)]
        return _EMPTY_STATE_BYTES + sum(int(one.nbytes) for one in arrays)


_ARRAYS = ("state", "log_weight", "kept")


@dataclass(eq=False, slots=True)
class Session:
    """One device.

    Parameters
    ----------
    id : str
        128 random bits; who knows it may use the session.
    name : str
        As the client calls it; may be empty.
    progress : Progress or None
        None while it is on disk only.
    saved_epochs : int
        Epochs that are on disk; -1 for nothing.
    """

    id: str
    name: str
    seed: int
    began_utc_s: float
    progress: Progress | None
    epochs: int = 0
    time_s: float = nan
    last: bytes = b""
    saved_epochs: int = -1
    saved_time_s: float = nan
    used_s: float = field(default_factory=time.monotonic)
    bytes: int = 0
    waiting: int = 0
    ended: bool = False
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    channel: Channel = field(default_factory=Channel)

    def take(self, progress: Progress) -> None:
        """Replace what is known by what is new."""
        self.progress, self.epochs, self.time_s = progress, progress.epochs, progress.time_s
        self.last, self.bytes = progress.last, progress.state_bytes


class Sessions:
    """All sessions of a service; its methods are called in the event loop.

    Parameters
    ----------
    positioner : BayesPositioner
        The filter over the area.
    names : PlanNames
        Gives cells the ids of the database.
    store : SessionStore or None
        Where sessions are saved.
    workers : int
        Threads that run steps.
    """

    def __init__(
        self,
        positioner: BayesPositioner,
        names: PlanNames,
        limits: ServiceLimits,
        store: SessionStore | None = None,
        workers: int = 1,
    ) -> None:
        self.positioner, self.names, self.limits, self.store = positioner, names, limits, store
        self.all: dict[str, Session] = {}
        self.room = asyncio.Lock()
        self.pool = ThreadPoolExecutor(workers, thread_name_prefix="step")
        self.saver = ThreadPoolExecutor(1, thread_name_prefix="save")

    @property
    def held_bytes(self) -> int:
        """Memory of all states."""
        return sum(one.bytes for one in self.all.values() if one.progress is not None)

    def find(self, session_id: str) -> Session:
        """Return a session; RequestError (404) where there is none."""
        found = self.all.get(session_id)
        if found is None:
            raise RequestError(404, "notFound", "there is no such session, or it has ended")
        return found

    async def create(self, document: Mapping[str, Any]) -> Session:
        """Begin a session, at an unknown place or a known start.

        Raises
        ------
        RequestError
            Faults (400), or there are as many sessions as there may be (503).
        """
        name, seed, start = _wanted(document, self.positioner.crs)
        if len(self.all) >= self.limits.sessions:
            most = f"{self.limits.sessions} sessions are open, the most there may be"
            raise RequestError(503, "tooManySessions", most)
        if self.store is None and self.held_bytes >= self.limits.state_bytes:
            raise RequestError(503, "outOfMemory", "no memory is left for another session")
        seed = secrets.randbits(_SEED_BITS) if seed is None else seed
        session = Session(secrets.token_urlsafe(16), name, seed, time.time(), None)
        # Counted before the first await, so that no two requests take the last place.
        self.all[session.id] = session
        async with session.lock:
            try:
                session.take(await self._run(partial(_first, self.positioner, seed, start)))
                await self._save(session)
            except BaseException:
                session.ended = True
                self.all.pop(session.id, None)
                if self.store is not None:
                    # After a write that was begun: it goes on where this was cancelled.
                    self.saver.submit(self.store.remove, session.id)
                raise
        return session

    async def post(self, session: Session, document: Mapping[str, Any]) -> list[bytes]:
        """Process epochs; return the fixes as JSON.

        Raises
        ------
        RequestError
            Faults (400), epochs that are not later than the last one (409), or too many requests
            that wait (429).
        """
        if session.waiting >= self.limits.waiting:
            text = f"{session.waiting} requests of this session wait already"
            raise RequestError(429, "tooManyRequests", text)
        session.waiting += 1
        try:
            async with session.lock:
                _refuse_ended(session)
                session.used_s = time.monotonic()
                before = await self._loaded(session)
                if self.held_bytes > self.limits.state_bytes:
                    await self.make_room()
                step = partial(_stepped, self.positioner, self.names, before, document)
                # Shielded: a client that hangs up does not leave a half-done session.
                after, fixes = await asyncio.shield(self._run(step))
                _refuse_ended(session)
                session.take(after)
                session.used_s = time.monotonic()
                session.channel.publish(enumerate(fixes, before.epochs + 1))
                return fixes
        finally:
            session.waiting -= 1

    async def end(self, session: Session, reason: str) -> None:
        """End a session, and remove what was saved of it."""
        session.ended = True
        self.all.pop(session.id, None)
        session.channel.end(reason)
        if self.store is not None:
            async with session.lock:
                await self._in(self.saver, partial(self.store.remove, session.id))

    async def end_idle(self) -> int:
        """End sessions that nobody has used for long; return how many."""
        least_s = time.monotonic() - self.limits.idle_s
        idle = [s for s in self.all.values() if s.used_s < least_s and not s.channel.listeners]
        for one in idle:
            await self.end(one, "idle")
        return len(idle)

    async def save_all(self) -> int:
        """Save what is new; return the number of sessions saved."""
        found = [s for s in self.all.values() if s.epochs != s.saved_epochs]
        for one in found:
            await self._save(one)
        return len(found) if self.store is not None else 0

    async def make_room(self) -> None:
        """Keep states on disk only, those used least recently first, until the rest has room."""
        if self.store is None:
            return
        async with self.room:
            if self.held_bytes <= self.limits.state_bytes:
                return
            enough = int(_ROOM * self.limits.state_bytes)
            for one in sorted(self.all.values(), key=lambda session: session.used_s):
                if self.held_bytes <= enough:
                    return
                # One that is in use is left alone: waiting for it could wait for this.
                if one.progress is not None and not one.lock.locked():
                    async with one.lock:
                        await self._save(one)
                        if one.saved_epochs == one.epochs:
                            one.progress = None

    def restore(self, found: Mapping[str, Mapping[str, Any]]) -> None:
        """Take saved sessions, whose states stay on disk until they are used."""
        for session_id, saved in found.items():
            self.all[session_id] = Session(
                session_id,
                saved["name"],
                saved["seed"],
                saved["began_utc_s"],
                None,
                saved["epochs"],
                saved["time_s"],
                saved["last"].encode(),
                saved["epochs"],
                saved["time_s"],
            )

    async def _loaded(self, session: Session) -> Progress:
        if session.progress is None:
            assert self.store is not None
            saved = await self._in(self.saver, partial(self.store.read, session.id))
            state, rng, epochs = saved["state"], saved["rng"], saved["epochs"]
            last = saved["last"].encode()
            session.take(Progress(state, rng, epochs, saved["time_s"], last))
        assert session.progress is not None
        return session.progress

    async def _save(self, session: Session) -> None:
        progress = session.progress
        if self.store is None or progress is None or progress.epochs == session.saved_epochs:
            return
        value = {
            "name": session.name,
            "seed": session.seed,
            "began_utc_s": session.began_utc_s,
            "state": progress.state,
            "rng": dict(progress.rng),
            "epochs": progress.epochs,
            "time_s": progress.time_s,
            "last": progress.last.decode(),
        }
        await self._in(self.saver, partial(self.store.write, session.id, value))
        session.saved_epochs, session.saved_time_s = progress.epochs, progress.time_s
        if session.ended:
            await self._in(self.saver, partial(self.store.remove, session.id))

    async def _run(self, work: Callable[[], ResultT]) -> ResultT:
        return await self._in(self.pool, work)

    async def _in(self, pool: ThreadPoolExecutor, work: Callable[[], ResultT]) -> ResultT:
        return await asyncio.get_running_loop().run_in_executor(pool, work)

    def close(self) -> None:
        """End the threads, after what they are doing."""
        self.pool.shutdown()
        self.saver.shutdown()


def _refuse_ended(session: Session) -> None:
    if session.ended:
        raise RequestError(404, "notFound", "the session has ended meanwhile")


def _first(
    positioner: BayesPositioner, seed: int, start: tuple[float, float, float] | None
) -> Progress:
    rng = np.random.default_rng(seed)
    state = positioner.begin() if start is None else positioner.begin_at(*start, rng)
    return Progress(state, rng.bit_generator.state)


def _stepped(
    positioner: BayesPositioner, names: PlanNames, before: Progress, document: Mapping[str, Any]
) -> tuple[Progress, list[bytes]]:
    """Return the progress after a request's epochs, and their fixes."""
    epochs = read_epochs(document, names, before.time_s)
    rng = np.random.default_rng()
    rng.bit_generator.state = before.rng
    state, fixes = before.state, []
    for number_, epoch in enumerate(epochs, before.epochs + 1):
        state, output = positioner.step(state, epoch, rng)
        fixes.append(json_bytes(fix_document(output, number_, positioner.crs)))
    count, time_s = before.epochs + len(epochs), epochs[-1].time_s
    return Progress(state, rng.bit_generator.state, count, time_s, fixes[-1]), fixes


def _wanted(
    document: Mapping[str, Any], crs: str
) -> tuple[str, int | None, tuple[float, float, float] | None]:
    """Return name, seed and start (east, north, deviation) of a new session."""
    faults = Faults()
    check_keys(document, ("name", "seed", "start"), "body", faults)
    name, seed, start = "", None, None
    if document.get("name") is not None:
        name = text(document["name"], "name", "1..128 printable characters", faults) or ""
    if document.get("seed") is not None:
        most = 2**_SEED_BITS - 1
        seed = whole(document["seed"], "seed", f"a whole number in 0..{most}", faults, 0, most)
    given = document.get("start")
    if given is not None and not isinstance(given, dict):
        faults.add("start", "an object with lat_deg, lon_deg and sd_m", "something else")
    elif given is not None:
        ranges = {"lat_deg": 90.0, "lon_deg": 180.0, "sd_m": 1e5}
        check_keys(given, tuple(ranges), "start", faults)
        found = [
            number(given.get(key), f"start.{key}", f"a number up to {most:g}", faults, low, most)
            for key, most in ranges.items()
            for low in (0.0 if key == "sd_m" else -most,)
        ]
        if not faults.found:
            lat_deg, lon_deg, sd_m = (float(one) for one in found if one is not None)
            east_m, north_m = project(crs, lon_deg, lat_deg)
            if not (np.isfinite(east_m) and np.isfinite(north_m)):
                faults.add("start", f"a place that {crs} covers", "one beyond it")
            start = float(east_m), float(north_m), sd_m
    if faults.found:
        raise RequestError.of(InputError(tuple(faults.found)))
    return name, seed, start
