"""What every request passes: host, token, rate, body; and the one shape of answers and errors."""

from __future__ import annotations

import asyncio
import math
import sys
import time
import traceback
from collections.abc import Awaitable, Callable
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from mapfilter.errors import MapfilterError
from mapfilter.serving.documents import RequestError
from mapfilter.serving.epoch_rows import MOST_EPOCHS
from mapfilter.serving.events import EventStream, json_bytes
from mapfilter.serving.limits import RateLimit, ServiceLimits, bearer, is_own_host, same_token

KEY = "key"
"""Parameter of the address that may hold the token, as that of geolocation services; the browser's
reader of events, and what it opens by an address, can send no header."""
_KEYED = ("/v1/geolocate", "/events")
PAGES = "/view/"
"""Begin of the addresses of pages."""

SAFE = {"cache-control": "no-store", "x-content-type-options": "nosniff"}

Handler = Callable[[Request], Awaitable[Response | EventStream]]


class Door:
    """What every request passes: host, token, rate; and the shape of errors."""

    def __init__(self, limits: ServiceLimits, token: str, host_names: frozenset[str]) -> None:
        self.limits, self.token, self.host_names = limits, token, host_names
        burst = max(2.0, limits.burst_s * limits.rate_per_s)
        self.rate = RateLimit(limits.rate_per_s, burst, float(MOST_EPOCHS))

    def __call__(self, handler: Handler) -> Callable[[Request], Awaitable[Any]]:
        """Return a handler behind the door."""

        async def answered(request: Request) -> Any:
            try:
                self._check(request)
                request.state.door = self
                return await handler(request)
            except RequestError as error:
                return refused(error)
            except ClientDisconnect:
                return Response(status_code=400)
            except Exception as error:
                # A fault of the service: what it is goes to its log, not to the client.
                if isinstance(error, MapfilterError):
                    sys.stderr.write(f"mapfilter: {error}\n")
                else:
                    traceback.print_exc(file=sys.stderr)
                return refused(RequestError(500, "backendError", "the service failed"))

        return answered

    def charge(self, request: Request, cost: float, again: float = 0.0) -> None:
        """Take from the client's rate; RequestError (429) where that is used up.

        ``again`` is what the same request takes before it comes here once more.
        """
        client = request.client.host if request.client is not None else ""
        wait_s = self.rate.wait_s(client, cost, time.monotonic()) if cost > 0 else 0.0
        if wait_s:
            most = f"{self.limits.rate_per_s:g} a second, or {self.rate.burst:g} at once"
            text = f"more epochs and other requests than {most} (each epoch of a request counts)"
            error = RequestError(429, "rateLimitExceeded", text)
            error.retry_s = wait_s + again / self.limits.rate_per_s
            raise error

    def _check(self, request: Request) -> None:
        self.charge(request, 1.0)
        if not is_own_host(request.headers.get("host", ""), self.host_names):
            text = "asked by a name that is not this machine's; see --host-name"
            raise RequestError(421, "wrongHost", text)
        if self.token:
            given, path = bearer(request.headers), request.url.path
            if given is None and (path.endswith(_KEYED) or path.startswith(PAGES)):
                given = request.query_params.get(KEY)
            if not same_token(given, self.token):
                expected = "a token, as Authorization: Bearer TOKEN"
                raise RequestError(401, "keyInvalid", f"expected {expected}")


async def read_body(request: Request, limits: ServiceLimits) -> bytes:
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


def json_answer(value: Any, code: int = 200, headers: dict[str, str] | None = None) -> Response:
    """Return an answer in JSON."""
    held = SAFE | (headers or {})
    return Response(json_bytes(value), code, held, "application/json")


def refused(error: RequestError) -> Response:
    """Return the answer to a request that is refused."""
    headers = {}
    if error.code == 401:
        headers["www-authenticate"] = "Bearer"
    if error.code in (413, 408):
        # The rest of the body is not read.
        headers["connection"] = "close"
    if error.retry_s:
        headers["retry-after"] = str(max(1, math.ceil(error.retry_s - 1e-6)))
    return json_answer(error.document, error.code, headers)


async def no_route(request: Request, error: Exception) -> Response:
    """Return the answer to a request for which there is no route."""
    code = error.status_code if isinstance(error, HTTPException) else 500
    other = f"expected another method for this path, found {request.method[:20]}"
    words = {404: ("notFound", "there is no such path"), 405: ("methodNotAllowed", other)}
    reason, text = words.get(code, ("badRequest", "bad request"))
    return refused(RequestError(code, reason, text))
