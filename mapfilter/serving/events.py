"""Fixes as JSON, and streams of them as server-sent events."""

from __future__ import annotations

import asyncio
import json
import time
from collections import deque
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Any, NamedTuple

from starlette.types import Receive, Scope, Send

from mapfilter.geodesy import unproject
from mapfilter.positioning.step_output import StepOutput

KEPT_FIXES = 120
"""Fixes that a session keeps for listeners that come back."""

_WAITING = 512
"""More than the kept fixes and those of one request together."""

_WATCHED_S = 30.0
"""Time for which a page that is to come, or was cut off and may come back, misses no details."""

_QUIET_S = 15.0
_RETRY_MS = 2000
_HEADERS = [
    (b"content-type", b"text/event-stream; charset=utf-8"),
    (b"cache-control", b"no-store"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-accel-buffering", b"no"),
]


def fix_document(output: StepOutput, number: int, crs: str) -> dict[str, Any]:
    """Return a fix with the names of the columns of an estimate; what is not known is None.

    Parameters
    ----------
    number : int
        Of the epoch in its session, from 1.
    crs : str
        Of the positions.
    """
    fix = output.fix
    lon_deg, lat_deg = unproject(crs, fix.east_m, fix.north_m)
    located = isfinite(fix.east_m)
    runner, evidence = (None, None, None), (None, None)
    if output.evidence is not None:
        runner, evidence = output.evidence[:3], output.evidence[3:]  # type: ignore[assignment]
    radii = fix.radii_m.tolist()
    numbers = {
        "lat_deg": float(lat_deg) if located else None,
        "lon_deg": float(lon_deg) if located else None,
        "east_m": fix.east_m,
        "north_m": fix.north_m,
        "radius_50_m": radii[0],
        "radius_67_m": radii[1],
        "radius_95_m": radii[2],
        "radius_99_m": fix.radius_99_m,
        "protection_m": fix.protection_m,
        "mass_50m": fix.mass_50m,
        "way_probability": fix.way_probability,
        "runner_up_east_m": runner[0],
        "runner_up_north_m": runner[1],
        "runner_up_mass": runner[2],
        "entropy_bits": evidence[0],
        "log_evidence": evidence[1],
    }
    return {
        "number": number,
        "time_s": fix.time_s,
        "status": fix.status.value,
        "reason": fix.reason.value,
        "hypotheses": int(fix.hypotheses),
        "way_id": int(fix.way_id),
        **{name: _finite(value) for name, value in numbers.items()},
        "unused": [
            {"kind": one.kind, "what": one.what, "reason": one.reason.value}
            for one in output.unused
        ],
    }


def json_bytes(value: Any) -> bytes:
    """Return a value as JSON on one line."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and isfinite(value) else None


def event(name: str, number: int | None, data: bytes) -> bytes:
    r"""Return one server-sent event; the data is JSON, which has no line breaks.

    Examples
    --------
    >>> event("fix", 3, b"{}")
    b'id: 3\nevent: fix\ndata: {}\n\n'
    """
    head = f"id: {number}\n" if number is not None else ""
    return f"{head}event: {name}\ndata: ".encode() + data + b"\n\n"


@dataclass(eq=False, slots=True)
class Listener:
    """One stream of events of a session; a slow one loses its stream, never the service memory.

    Parameters
    ----------
    detail : bool
        Whether its fixes come with what a page shows, and beliefs beside them.
    """

    detail: bool = False
    waiting: asyncio.Queue[bytes | None] = field(
        default_factory=lambda: asyncio.Queue(maxsize=_WAITING)
    )
    open: bool = True

    def send(self, data: bytes) -> None:
        """Add an event; a listener that is too far behind is closed."""
        if not self.open:
            return
        if self.waiting.full():
            self.close()
        else:
            self.waiting.put_nowait(data)

    def close(self, last: bytes | None = None) -> None:
        """End the stream, after what waits; of a full one the waiting events are dropped."""
        if not self.open:
            return
        self.open = False
        if self.waiting.maxsize - self.waiting.qsize() < 2:
            while not self.waiting.empty():
                self.waiting.get_nowait()
        if last is not None:
            self.waiting.put_nowait(last)
        self.waiting.put_nowait(None)


class KeptFix(NamedTuple):
    """A fix, and the same with its details where somebody watched."""

    number: int
    fix: bytes
    detailed: bytes

    def event(self, detail: bool) -> bytes:
        """Return the event for a listener."""
        return event("fix", self.number, self.detailed if detail else self.fix)


@dataclass(eq=False, slots=True)
class Channel:
    """The listeners of a session, and its last fixes for those that come back.

    Parameters
    ----------
    belief : bytes
        The last one while somebody watches, as JSON.
    watched_until_s : float
        Time of the monotonic clock until which details are made although nobody is there.
    described : bool
        Whether details or a belief are kept.
    """

    kept: deque[KeptFix] = field(default_factory=lambda: deque(maxlen=KEPT_FIXES))
    listeners: set[Listener] = field(default_factory=set)
    belief: bytes = b""
    watched_until_s: float = -inf
    described: bool = False

    def is_watched(self, now_s: float) -> bool:
        """Return whether steps are to be described in detail."""
        return now_s < self.watched_until_s or any(one.detail for one in self.listeners)

    def expect(self, now_s: float) -> None:
        """Make details for a while, for a page that is to come."""
        self.watched_until_s = now_s + _WATCHED_S

    def forget_details(self, now_s: float) -> None:
        """Keep fixes alone once nobody watches: details take a hundred times their memory."""
        if self.described and not self.is_watched(now_s):
            bare = (KeptFix(one.number, one.fix, one.fix) for one in self.kept)
            self.kept = deque(bare, maxlen=KEPT_FIXES)
            self.belief, self.described = b"", False

    def keep(self, number: int, fix: bytes, detail: bytes = b"") -> KeptFix:
        """Keep a fix for listeners to come."""
        self.described = self.described or bool(detail)
        detailed = fix[:-1] + b',"detail":' + detail + b"}" if detail else fix
        self.kept.append(KeptFix(number, fix, detailed))
        return self.kept[-1]

    def publish(
        self, first: int, fixes: list[bytes], details: list[bytes], belief: bytes = b""
    ) -> None:
        """Send fixes, the first one with its number, to all listeners; the belief to pages.

        Parameters
        ----------
        details : list of bytes
            One for each fix, or none at all.
        """
        for index, fix in enumerate(fixes):
            kept = self.keep(first + index, fix, details[index] if details else b"")
            # One object for all that wait for it.
            both = kept.event(False), kept.event(True)
            for one in self.listeners:
                one.send(both[one.detail])
        self.show(belief)
        if belief:
            data = event("belief", None, belief)
            for one in self.listeners:
                if one.detail:
                    one.send(data)

    def show(self, belief: bytes) -> None:
        """Keep the last belief for pages to come."""
        self.belief, self.described = belief, self.described or bool(belief)

    def listen(self, after: int, detail: bool = False) -> Listener:
        """Add a listener, which first gets the kept fixes with larger numbers."""
        listener = Listener(detail)
        for one in self.kept:
            if one.number > after:
                listener.send(one.event(detail))
        if detail and self.belief:
            listener.send(event("belief", None, self.belief))
        self.listeners.add(listener)
        return listener

    def leave(self, listener: Listener, now_s: float) -> None:
        """Take a listener away; a page may come back."""
        listener.close()
        self.listeners.discard(listener)
        if listener.detail:
            self.expect(now_s)

    def end(self, reason: str) -> None:
        """Tell all listeners that there will be no more fixes, and why."""
        for one in self.listeners:
            one.close(event("end", None, json_bytes({"reason": reason})))


@dataclass(eq=False, slots=True)
class EventStream:
    """The answer that sends a listener's events until it is closed or the client is gone.

    A client that takes nothing for ``send_s`` is cut off; it may come back with the number of the
    last event that it got (``Last-Event-ID``).
    """

    channel: Channel
    listener: Listener
    send_s: float

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send events; ends without an error whichever side ends first."""
        del scope
        gone = asyncio.ensure_future(_disconnected(receive))
        try:
            await send({"type": "http.response.start", "status": 200, "headers": _HEADERS})
            data: bytes | None = f"retry: {_RETRY_MS}\n\n".encode()
            while data is not None and not gone.done():
                message = {"type": "http.response.body", "body": data, "more_body": True}
                async with asyncio.timeout(self.send_s):
                    await send(message)
                data = await self._next(gone)
            await send({"type": "http.response.body", "body": b"", "more_body": False})
        except (TimeoutError, OSError):
            return
        finally:
            gone.cancel()
            self.channel.leave(self.listener, time.monotonic())

    async def _next(self, gone: asyncio.Future[None]) -> bytes | None:
        """Return the next event, a comment after a quiet while, None at the end."""
        waiting = asyncio.ensure_future(self.listener.waiting.get())
        either: set[asyncio.Future[Any]] = {waiting, gone}
        await asyncio.wait(either, timeout=_QUIET_S, return_when=asyncio.FIRST_COMPLETED)
        if waiting.done():
            return waiting.result()
        waiting.cancel()
        return None if gone.done() else b": quiet\n\n"


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
