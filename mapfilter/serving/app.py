"""The routes of the service: what comes in is checked here once, and answered in one shape."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from mapfilter._inputs import shown
from mapfilter._io import program_version
from mapfilter.serving.documents import RequestError, one_fault, read_object
from mapfilter.serving.door import PAGES, SAFE, Door, json_answer, no_route, read_body
from mapfilter.serving.epoch_rows import MOST_EPOCHS
from mapfilter.serving.events import EventStream, json_bytes
from mapfilter.serving.filters import LOG, statement_document
from mapfilter.serving.geolocate import Geolocator
from mapfilter.serving.limits import ServiceLimits
from mapfilter.serving.live_page import LivePage
from mapfilter.serving.session import Session
from mapfilter.serving.sessions import Sessions

_DETAIL, _AFTER = "detail", "after"
_MOST_DIGITS = 15


@dataclass(frozen=True, eq=False)
class Service:
    """All that answers requests.

    Parameters
    ----------
    sessions : Sessions
        Of the devices.
    geolocator : Geolocator or None
        Locates single reports; None where the database has no cells.
    limits : ServiceLimits
        Of requests.
    token : str
        Without it requests are refused; empty for none.
    host_names : frozenset of str
        Names of this machine by which it may be asked, besides addresses and localhost.
    page : LivePage or None
        Shows sessions; None for a service without pages.
    """

    sessions: Sessions
    geolocator: Geolocator | None
    limits: ServiceLimits
    token: str = ""
    host_names: frozenset[str] = frozenset()
    page: LivePage | None = None

    def app(self) -> Starlette:
        """Return the ASGI application."""
        door = Door(self.limits, self.token, self.host_names)
        routes = [
            Route("/", door(self._index), methods=["GET"]),
            Route("/sessions", door(self._list), methods=["GET"]),
            Route("/sessions", door(self._create), methods=["POST"]),
            Route("/sessions/{id}", door(self._show), methods=["GET"]),
            Route("/sessions/{id}", door(self._delete), methods=["DELETE"]),
            Route("/sessions/{id}/epochs", door(self._post), methods=["POST"]),
            Route("/sessions/{id}/events", door(self._events), methods=["GET"]),
            Route("/v1/geolocate", door(self._geolocate), methods=["POST"]),
        ]
        if self.page is not None:
            files = self.page.routes(self.sessions)
            routes += [Route(PAGES + name, door(one), methods=["GET"]) for name, one in files]
        return Starlette(routes=routes, exception_handlers={HTTPException: no_route})

    async def _index(self, request: Request) -> Response:
        del request
        found = {
            "service": "mapfilter",
            "version": program_version(),
            "crs": self.sessions.filters.usual.positioner.crs,
            "sessions": len(self.sessions.all),
            "geolocate": self.geolocator is not None,
        }
        return json_answer(found)

    async def _list(self, request: Request) -> Response:
        del request
        return json_answer({"sessions": [_shown(one) for one in self.sessions.all.values()]})

    async def _create(self, request: Request) -> Response:
        session = await self.sessions.create(await self._document(request))
        place = {"location": f"/sessions/{session.id}"}
        notes = (await self.sessions.filter_of(session)).notes
        found = {**_shown(session), "seed": session.seed, "notes": list(notes)}
        return json_answer(found, 201, place)

    async def _show(self, request: Request) -> Response:
        session = self._session(request)
        return _with_fixes(_shown(session), [session.last] if session.last else [], "last")

    async def _delete(self, request: Request) -> Response:
        await self.sessions.end(self._session(request), "deleted")
        return Response(status_code=204, headers=SAFE)

    async def _post(self, request: Request) -> Response:
        session = self._session(request)
        document = await self._document(request)
        epochs = document.get("epochs")
        if isinstance(epochs, list):
            # Before they are charged: what is never done must not use up the client's rate.
            if len(epochs) > MOST_EPOCHS:
                most = f"at most {MOST_EPOCHS} entries"
                raise one_fault("epochs", most, len(epochs), "several requests")
            request.state.door.charge(request, len(epochs) - 1, again=1.0)
        found = await self.sessions.post(session, document)
        value = {**_shown(session), "notes": list(found.notes)}
        return _with_fixes(value, found.fixes, "fixes")

    async def _events(self, request: Request) -> EventStream:
        detail, after = _asked_of(request)
        session = self._listened(request)
        if detail:
            await self.sessions.watch(session)
            # From here on nothing is awaited: neither session nor number of listeners changes.
            session = self._listened(request)
        # What a browser sends by itself when it comes back counts for more than the address.
        last = request.headers.get("last-event-id", "")
        listener = session.channel.listen(int(last) if _is_number(last) else after, detail)
        return EventStream(session.channel, listener, self.limits.send_s)

    def _listened(self, request: Request) -> Session:
        """Return a session that may have one more listener."""
        session = self._session(request)
        if len(session.channel.listeners) >= self.limits.listeners:
            text = f"{self.limits.listeners} streams of this session are open already"
            raise RequestError(429, "tooManyRequests", text)
        return session

    async def _geolocate(self, request: Request) -> Response:
        document = await self._document(request)
        if self.geolocator is None:
            raise RequestError(404, "notFound", "the database has no cells")
        work = self.geolocator.answer
        loop = asyncio.get_running_loop()
        return json_answer(await loop.run_in_executor(self.sessions.pool, work, document))

    def _session(self, request: Request) -> Session:
        return self.sessions.find(request.path_params["id"])

    async def _document(self, request: Request) -> dict[str, Any]:
        return read_object(await read_body(request, self.limits))


def _asked_of(request: Request) -> tuple[bool, int]:
    """Return whether a listener asks for details, and after which fix."""
    detail = request.query_params.get(_DETAIL, "0")
    if detail not in ("0", "1"):
        raise one_fault(_DETAIL, "0 or 1", shown(detail))
    after = request.query_params.get(_AFTER, "0")
    if not _is_number(after):
        raise one_fault(_AFTER, "the number of a fix, or 0", shown(after))
    return detail == "1", int(after)


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS


def _shown(session: Session) -> dict[str, Any]:
    """Return what clients need to know of a session, besides its fixes."""
    return {
        "id": session.id,
        "name": session.name,
        "began_utc_s": session.began_utc_s,
        LOG: statement_document(session.stated),
        "epochs": session.epochs,
        "time_s": session.time_s if math.isfinite(session.time_s) else None,
        "saved_time_s": session.saved_time_s if math.isfinite(session.saved_time_s) else None,
    }


def _with_fixes(value: dict[str, Any], fixes: list[bytes], name: str) -> Response:
    """Return an object with fixes that are JSON already."""
    joined = b",".join(fixes)
    if name == "fixes":
        joined = b"[" + joined + b"]"
    data = json_bytes(value)[:-1] + b',"' + name.encode() + b'":' + (joined or b"null") + b"}"
    return Response(data, 200, SAFE, "application/json")
