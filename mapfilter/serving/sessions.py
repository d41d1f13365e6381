"""Sessions: one filter state for each device, in memory and, where there is a folder, saved.

The map of the area is shared by all sessions, and a filter by those whose logs state the same
(:mod:`mapfilter.serving.filters`). A session's state is the
frozen state of the filter and its random generator. A request of several epochs counts as a whole
or not at all.
"""

from __future__ import annotations

import asyncio
import secrets
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from mapfilter.radio.plan_names import PlanNames
from mapfilter.serving.documents import RequestError
from mapfilter.serving.filters import SessionFilter, SessionFilters
from mapfilter.serving.limits import ServiceLimits
from mapfilter.serving.saved_session import restored_progress, restored_session, saved_value
from mapfilter.serving.session import Progress, Session
from mapfilter.serving.steps import SEED_BITS, Stepped, first, shown_or, stepped, wanted
from mapfilter.serving.store import SessionStore

ResultT = TypeVar("ResultT")

_ROOM = 0.9
"""Share of the memory that is left in use when there was too little."""


class Sessions:
    """All sessions of a service; its methods are called in the event loop.

    Parameters
    ----------
    filters : SessionFilters
        Over the area.
    names : PlanNames
        Gives cells the ids of the database.
    store : SessionStore or None
        Where sessions are saved.
    workers : int
        Threads that run steps.
    """

    def __init__(
        self,
        filters: SessionFilters,
        names: PlanNames,
        limits: ServiceLimits,
        store: SessionStore | None = None,
        workers: int = 1,
    ) -> None:
        self.filters, self.names, self.limits, self.store = filters, names, limits, store
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
        asked = wanted(document, self.filters.usual.positioner.area.lattice)
        if len(self.all) >= self.limits.sessions:
            most = f"{self.limits.sessions} sessions are open, the most there may be"
            raise RequestError(503, "tooManySessions", most)
        if self.store is None and self.held_bytes >= self.limits.state_bytes:
            raise RequestError(503, "outOfMemory", "no memory is left for another session")
        seed = secrets.randbits(SEED_BITS) if asked.seed is None else asked.seed
        session = Session(
            secrets.token_urlsafe(16), asked.name, seed, time.time(), None, stated=asked.stated
        )
        # Counted before the first await, so that no two requests take the last place.
        self.all[session.id] = session
        async with session.lock:
            try:
                filter_ = await self.filter_of(session)
                begin = partial(first, filter_.positioner, seed, asked.start)
                session.take(await self._run(begin))
                await self._save(session)
            except BaseException:
                session.ended = True
                self.all.pop(session.id, None)
                if self.store is not None:
                    # After a write that was begun: it goes on where this was cancelled.
                    self.saver.submit(self.store.remove, session.id)
                raise
        return session

    async def filter_of(self, session: Session) -> SessionFilter:
        """Return the filter of a session, which may have to be made first."""
        if session.stated == self.filters.usual.stated:
            return self.filters.usual
        return await self._run(partial(self.filters.of, session.stated))

    async def post(self, session: Session, document: Mapping[str, Any]) -> Stepped:
        """Process epochs; return what they make, with the fixes as JSON.

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
                channel = session.channel
                watched = channel.is_watched(time.monotonic())
                filter_ = await self.filter_of(session)
                step = partial(stepped, filter_, self.names, before, document, watched=watched)
                # Shielded: a client that hangs up does not leave a half-done session.
                after = await asyncio.shield(self._run(step))
                _refuse_ended(session)
                session.take(after.progress)
                _tell(session, after.fault)
                session.used_s = time.monotonic()
                channel.publish(before.epochs + 1, after.fixes, after.details, after.belief)
                return after
        finally:
            session.waiting -= 1

    async def watch(self, session: Session) -> None:
        """Prepare a session for a page: its present belief, which no epoch has brought yet.

        Raises
        ------
        RequestError
            As many sessions are watched as may be (429), or it has ended (404).
        """
        now_s = time.monotonic()
        if not session.channel.is_watched(now_s):
            watched = sum(one.channel.is_watched(now_s) for one in self.all.values())
            if watched >= self.limits.watched:
                text = f"{watched} sessions are watched already, the most there may be"
                raise RequestError(429, "tooManyRequests", text)
        # Counted before the first await, so that no two requests take the last place.
        session.channel.expect(now_s)
        async with session.lock:
            _refuse_ended(session)
            progress = await self._loaded(session)
            faults = [""]
            watcher = (await self.filter_of(session)).watcher
            belief = partial(watcher.belief, progress.state, progress.epochs)
            session.channel.show(await self._run(partial(shown_or, b"", belief, faults)))
            _tell(session, faults[-1])

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
        ended = 0
        for one in list(self.all.values()):
            # Asked of each when its turn comes: it may have been used while others were ended.
            if self._is_idle(one):
                await self.end(one, "idle")
                ended += 1
        return ended

    def _is_idle(self, session: Session) -> bool:
        idle_s = time.monotonic() - session.used_s
        unused = idle_s > self.limits.idle_s and not session.waiting
        return unused and not session.channel.listeners and not session.ended

    def forget_details(self) -> None:
        """Drop what pages were shown of sessions that nobody watches any more."""
        now_s = time.monotonic()
        for one in self.all.values():
            one.channel.forget_details(now_s)

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
            self.all[session_id] = restored_session(session_id, saved)

    async def _loaded(self, session: Session) -> Progress:
        if session.progress is None:
            assert self.store is not None
            saved = await self._in(self.saver, partial(self.store.read, session.id))
            session.take(restored_progress(saved))
        assert session.progress is not None
        return session.progress

    async def _save(self, session: Session) -> None:
        progress = session.progress
        if self.store is None or progress is None or progress.epochs == session.saved_epochs:
            return
        value = saved_value(session, progress)
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


def _tell(session: Session, fault: str) -> None:
    """Report a fault in what a page shows, once for each session: it may come with each epoch."""
    if fault and not session.fault_told:
        session.fault_told = True
        sys.stderr.write(fault)


def _refuse_ended(session: Session) -> None:
    if session.ended:
        raise RequestError(404, "notFound", "the session has ended meanwhile")
