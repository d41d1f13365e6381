"""The routes of the service: what comes in is checked here once, and answered in one shape."""

from __future__ import annotations

import asyncio
import math
import sys
import time
import traceback
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Route

from mapfilter._io import VERSION
from mapfilter.errors import MapfilterError
from mapfilter.serving.documents import RequestError, one_fault, read_object
from mapfilter.serving.epoch_rows import MOST_EPOCHS
from mapfilter.serving.events import EventStream, json_bytes
from mapfilter.serving.geolocate import Geolocator
from mapfilter.serving.limits import RateLimit, ServiceLimits, bearer, is_own_host, same_token
from mapfilter.serving.sessions import Session, Sessions

_KEY = "key"
"""Parameter of the address that may hold the token, as that of geolocation services; the browser's
reader of events can send no header."""
_KEYED = ("/v1/geolocate", "/events")
_SAFE = {"cache-control": "no-store", "x-content-type-options": "nosniff"}

Handler = Callable[[Request], Awaitable[Response | EventStream]]


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
    """

    sessions: Sessions
    geolocator: Geolocator | None
    limits: ServiceLimits
    token: str = ""
    host_names: frozenset[str] = frozenset()

    def app(self) -> Starlette:
        """Return the ASGI application."""
        door = _Door(self)
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
        return Starlette(routes=routes, exception_handlers={HTTPException: _no_route})

    async def _index(self, request: Request) -> Response:
        del request
        found = {
            "service": "mapfilter",
            "version": VERSION,
            "crs": self.sessions.positioner.crs,
            "sessions": len(self.sessions.all),
            "geolocate": self.geolocator is not None,
        }
        return _json(found)

    async def _list(self, request: Request) -> Response:
        del request
        return _json({"sessions": [_shown(one) for one in self.sessions.all.values()]})

    async def _create(self, request: Request) -> Response:
        session = await self.sessions.create(await self._document(request))
        place = {"location": f"/sessions/{session.id}"}
        return _json({**_shown(session), "seed": session.seed}, 201, place)

    async def _show(self, request: Request) -> Response:
        session = self._session(request)
        return _with_fixes(_shown(session), [session.last] if session.last else [], "last")

    async def _delete(self, request: Request) -> Response:
        await self.sessions.end(self._session(request), "deleted")
        return Response(status_code=204, headers=_SAFE)

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
        fixes = await self.sessions.post(session, document)
        return _with_fixes(_shown(session), fixes, "fixes")

    async def _events(self, request: Request) -> EventStream:
        session = self._session(request)
        if len(session.channel.listeners) >= self.limits.listeners:
            text = f"{self.limits.listeners} streams of this session are open already"
            raise RequestError(429, "tooManyRequests", text)
        last = request.headers.get("last-event-id", "")
        after = int(last) if last.isascii() and last.isdigit() and len(last) < 16 else 0
        listener = session.channel.listen(after)
        return EventStream(session.channel, listener, self.limits.send_s)

    async def _geolocate(self, request: Request) -> Response:
        document = await self._document(request)
        if self.geolocator is None:
            raise RequestError(404, "notFound", "the database has no cells")
        work = self.geolocator.answer
        loop = asyncio.get_running_loop()
        return _json(await loop.run_in_executor(self.sessions.pool, work, document))

    def _session(self, request: Request) -> Session:
        return self.sessions.find(request.path_params["id"])

    async def _document(self, request: Request) -> dict[str, Any]:
        return read_object(await _body(request, self.limits))


class _Door:
    """What every request passes: host, token, rate; and the shape of errors."""

    def __init__(self, service: Service) -> None:
        limits = service.limits
        self.service = service
        burst = max(2.0, limits.burst_s * limits.rate_per_s)
        self.rate = RateLimit(limits.rate_per_s, burst, float(MOST_EPOCHS))

    def __call__(self, handler: Handler) -> Callable[[Request], Awaitable[Any]]:
        async def answered(request: Request) -> Any:
            try:
                self._check(request)
                request.state.door = self
                return await handler(request)
            except RequestError as error:
                return _refused(error)
            except ClientDisconnect:
                return Response(status_code=400)
            except Exception as error:
                # A fault of the service: what it is goes to its log, not to the client.
                if isinstance(error, MapfilterError):
                    sys.stderr.write(f"mapfilter: {error}\n")
                else:
                    traceback.print_exc(file=sys.stderr)
                return _refused(RequestError(500, "backendError", "the service failed"))

        return answered

    def charge(self, request: Request, cost: float, again: float = 0.0) -> None:
        """Take from the client's rate; RequestError (429) where that is used up.

        ``again`` is what the same request takes before it comes here once more.
        """
        client = request.client.host if request.client is not None else ""
        wait_s = self.rate.wait_s(client, cost, time.monotonic()) if cost > 0 else 0.0
        if wait_s:
            per_s = f"{self.service.limits.rate_per_s:g} a second"
            error = RequestError(429, "rateLimitExceeded", f"more requests than {per_s}")
            error.retry_s = wait_s + again / self.service.limits.rate_per_s
            raise error

    def _check(self, request: Request) -> None:
        service = self.service
        self.charge(request, 1.0)
        if not is_own_host(request.headers.get("host", ""), service.host_names):
            text = "asked by a name that is not this machine's; see --host-name"
            raise RequestError(421, "wrongHost", text)
        if service.token:
            given = bearer(request.headers)
            if given is None and request.url.path.endswith(_KEYED):
                given = request.query_params.get(_KEY)
            if not same_token(given, service.token):
                expected = "a token, as Authorization: Bearer TOKEN"
                raise RequestError(401, "keyInvalid", f"expected {expected}")


async def _body(request: Request, limits: ServiceLimits) -> bytes:
    """Read a body within limits of size and time, and only as JSON.

    Pages of strangers can post other types from a browser without being asked for permission.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        text = "expected Content-Type: application/json"
        raise RequestError(415, "unsupportedType", text)
    if request.headers.get("content-encoding", "identity").lower() != "identity":
        raise RequestError(415, "unsupportedEncoding", "expected a body without Content-Encoding")
    most = limits.body_bytes
    length = request.headers.get("content-length", "")
    too_large = RequestError(413, "tooLarge", f"expected a body of at most {most} bytes")
    if length.isdigit() and (len(length) > 15 or int(length) > most):
        raise too_large
    data = bytearray()
    try:
        async with asyncio.timeout(limits.receive_s):
            async for chunk in request.stream():
                data += chunk
                if len(data) > most:
                    raise too_large
    except TimeoutError:
        text = f"the body did not come within {limits.receive_s:g} s"
        raise RequestError(408, "timeout", text) from None
    return bytes(data)


def _shown(session: Session) -> dict[str, Any]:
    """Return what clients need to know of a session, besides its fixes."""
    return {
        "id": session.id,
        "name": session.name,
        "began_utc_s": session.began_utc_s,
        "epochs": session.epochs,
        "time_s": session.time_s if math.isfinite(session.time_s) else None,
        "saved_time_s": session.saved_time_s if math.isfinite(session.saved_time_s) else None,
    }


def _json(value: Any, code: int = 200, headers: dict[str, str] | None = None) -> Response:
    held = _SAFE | (headers or {})
    return Response(json_bytes(value), code, held, "application/json")


def _with_fixes(value: dict[str, Any], fixes: list[bytes], name: str) -> Response:
    """Return an object with fixes that are JSON already."""
    joined = b",".join(fixes)
    if name == "fixes":
        joined = b"[" + joined + b"]"
    data = json_bytes(value)[:-1] + b',"' + name.encode() + b'":' + (joined or b"null") + b"}"
    return Response(data, 200, _SAFE, "application/json")


def _refused(error: RequestError) -> Response:
    headers = {}
    if error.code == 401:
        headers["www-authenticate"] = "Bearer"
    if error.code in (413, 408):
        # The rest of the body is not read.
        headers["connection"] = "close"
    if error.retry_s:
        headers["retry-after"] = str(max(1, math.ceil(error.retry_s - 1e-6)))
    return _json(error.document, error.code, headers)


async def _no_route(request: Request, error: Exception) -> Response:
    del request
    code = error.status_code if isinstance(error, HTTPException) else 500
    words = {404: ("notFound", "there is nothing here"), 405: ("methodNotAllowed", "not this way")}
    reason, text = words.get(code, ("badRequest", "bad request"))
    return _refused(RequestError(code, reason, text))
