"""The server: listens, saves now and then, and ends in order."""

from __future__ import annotations

import asyncio
import contextlib
import resource
import signal
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from mapfilter.errors import ConfigError, MapfilterError, fail
from mapfilter.serving.app import Service
from mapfilter.serving.limits import is_local
from mapfilter.serving.sessions import Sessions

_HEADERS_S = 15.0
_KEEP_ALIVE_S = 65
_GRACE_S = 10
_MORE_CONNECTIONS = 200
_HEADER_BYTES = 16 << 10
_TICK_S = 1.0
_BACKLOG = 1024


@dataclass(frozen=True, slots=True)
class Stopped:
    """How a service ended.

    Parameters
    ----------
    signal_name : str
        Of the signal that ended it.
    sessions : int
        Sessions that were open.
    saved : bool
        Whether all of them are on disk.
    """

    signal_name: str
    sessions: int
    saved: bool


def listen(host: str, port: int, token: str) -> socket.socket:
    """Return a socket that is bound; port 0 takes a free one.

    Raises
    ------
    ConfigError
        The address cannot be taken, or can be reached from other machines and there is no token.
    """
    if not is_local(host) and not token:
        hint = "others on the network could use the service: give a token, or leave out --host"
        raise fail(ConfigError, "--host", "a token for other hosts than 127.0.0.1", host, hint)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # With the protocol named, answers are sent at once (TCP_NODELAY).
    made = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((host, port))
        made.listen(_BACKLOG)
    except (OSError, OverflowError, UnicodeError) as error:
        made.close()
        got = getattr(error, "strerror", None) or error
        raise fail(ConfigError, "--host, --port", f"to listen on {host}:{port}", got) from error
    return made


def run(
    service: Service,
    made: socket.socket,
    *,
    save_every_s: float = 10.0,
    ready: Callable[[], None] = lambda: None,
    warn: Callable[[str], None] = lambda _: None,
) -> Stopped:
    """Serve until a signal asks to end; then finish what was begun, and save.

    Parameters
    ----------
    made : socket
        Bound, from :func:`listen`.
    save_every_s : float
        Time between saving what is new.
    ready : callable
        Called when requests are answered.
    warn : callable
        Gets a line where something could not be saved; the service goes on.
    """
    sessions, limits = service.sessions, service.limits
    _allow_files(2 * limits.sessions + _MORE_CONNECTIONS)
    config = uvicorn.Config(
        service.app(),
        http=_Protocol,
        ws="none",
        lifespan="off",
        loop="asyncio",
        log_config=None,
        log_level="critical",
        access_log=False,
        proxy_headers=False,
        server_header=False,
        timeout_keep_alive=_KEEP_ALIVE_S,
        timeout_graceful_shutdown=_GRACE_S,
        limit_concurrency=2 * limits.sessions + _MORE_CONNECTIONS,
        h11_max_incomplete_event_size=_HEADER_BYTES,
    )
    server = _Server(config, sessions, save_every_s, ready, warn)
    try:
        return asyncio.run(server.run_to_end(made))
    finally:
        sessions.close()


class _Server(uvicorn.Server):
    """A server that ends streams first, and signals of which are not raised again."""

    def __init__(
        self,
        config: uvicorn.Config,
        sessions: Sessions,
        save_every_s: float,
        ready: Callable[[], None],
        warn: Callable[[str], None],
    ) -> None:
        super().__init__(config)
        self.sessions, self.save_every_s = sessions, save_every_s
        self.ready, self.warn = ready, warn
        self.signal_name = ""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take signals by the event loop; they end the service, not the process."""
        loop = asyncio.get_running_loop()
        for one in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(one, self._stop, one)
        try:
            yield
        finally:
            for one in (signal.SIGINT, signal.SIGTERM):
                loop.remove_signal_handler(one)

    def _stop(self, one: signal.Signals) -> None:
        self.force_exit = self.should_exit
        self.signal_name = self.signal_name or one.name
        self.should_exit = True

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and say so."""
        await super().startup(sockets)
        self.ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End all streams, so that their connections can close; then the others."""
        for one in self.sessions.all.values():
            one.channel.end("stopped")
        await super().shutdown(sockets)

    async def run_to_end(self, made: socket.socket) -> Stopped:
        """Serve, then save."""
        chores = asyncio.create_task(self._chores())
        try:
            await self.serve([made])
        finally:
            chores.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await chores
        await self._saved()
        unsaved = [s for s in self.sessions.all.values() if s.epochs != s.saved_epochs]
        return Stopped(self.signal_name, len(self.sessions.all), not unsaved)

    async def _chores(self) -> None:
        """Save what is new, end idle sessions, and keep memory within its limit."""
        next_s = self.save_every_s
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        while True:
            await asyncio.sleep(min(_TICK_S, self.save_every_s))
            self.sessions.forget_details()
            try:
                await self.sessions.end_idle()
                await self.sessions.make_room()
            except MapfilterError as error:
                self.warn(str(error))
            if loop.time() - began_s >= next_s:
                await self._saved()
                next_s = loop.time() - began_s + self.save_every_s

    async def _saved(self) -> None:
        try:
            await self.sessions.save_all()
        except MapfilterError as error:
            self.warn(f"{error}\nsessions are not saved; the service goes on")


class _Protocol(H11Protocol):
    """Connections that send no request for long, or do not take what they asked for, are cut."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self.closing_ticks = 0
        self.loop.call_later(_HEADERS_S, self._look)

    def _look(self) -> None:
        if self not in self.connections:
            return
        if self.transport.is_closing():
            # A client that takes nothing keeps its connection half closed for ever.
            self.closing_ticks += 1
            if self.closing_ticks > 1:
                self.transport.abort()
                return
        elif self._is_half_sent():
            self.transport.abort()
            return
        self.loop.call_later(_HEADERS_S, self._look)

    def _is_half_sent(self) -> bool:
        """Whether no request has come whole since the connection was made, or the last answer."""
        idle = self.cycle is None or self.cycle.response_complete
        return idle and self.timeout_keep_alive_task is None


def _allow_files(count: int) -> None:
    """Let the process have as many connections, where the system allows it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = count + 100
    if hard != resource.RLIM_INFINITY:
        wanted = min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
