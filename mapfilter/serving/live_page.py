"""The page of a session: files of the replay's page, and the map under it, made once."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import Any
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import Response

from mapfilter.serving.door import KEY, SAFE
from mapfilter.serving.sessions import Sessions
from mapfilter.viewing.page import compressed, live_html, script_text, style_text

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    **SAFE,
    "content-security-policy": _POLICY,
    "cross-origin-resource-policy": "same-origin",
    "referrer-policy": "no-referrer",
}

Handler = Callable[[Request], Awaitable[Response]]


class LivePage:
    """Answers a browser that shows sessions.

    Parameters
    ----------
    make_map : callable
        Returns the bundle of the database; it is asked once, when the first page is opened.
    """

    def __init__(self, make_map: Callable[[], Mapping[str, Any]]) -> None:
        self.make_map = make_map
        self.script, self.style = script_text().encode(), style_text().encode()
        self.map = b""
        self.making = asyncio.Lock()

    def routes(self, sessions: Sessions) -> list[tuple[str, Handler]]:
        """Return the files of the page, each with its handler; the page of a session last."""
        return [
            ("", self._list),
            ("page.js", self._script),
            ("page.css", self._style),
            ("map", self._map),
            ("{id}", partial(self._session, sessions)),
        ]

    async def _list(self, request: Request) -> Response:
        return _html(request)

    async def _session(self, sessions: Sessions, request: Request) -> Response:
        sessions.find(request.path_params["id"])
        return _html(request)

    async def _script(self, request: Request) -> Response:
        del request
        return Response(self.script, 200, _HEADERS, "text/javascript")

    async def _style(self, request: Request) -> Response:
        del request
        return Response(self.style, 200, _HEADERS, "text/css")

    async def _map(self, request: Request) -> Response:
        """Answer the database's bundle as gzip, which the page unpacks as that of a file."""
        del request
        async with self.making:
            if not self.map:
                # Beside the threads of the steps, for which devices wait.
                self.map = await asyncio.to_thread(self._made)
        return Response(self.map, 200, _HEADERS, "application/gzip")

    def _made(self) -> bytes:
        return compressed(self.make_map())


def _html(request: Request) -> Response:
    """Answer the page; what it loads is asked with the token that it was asked with."""
    key = request.query_params.get(KEY)
    query = "?" + urlencode({KEY: key}) if key else ""
    return Response(live_html(query), 200, _HEADERS, "text/html")
