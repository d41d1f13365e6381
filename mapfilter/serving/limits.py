"""Limits of a service: requests a second, hosts that it answers to, and its token."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field

_MOST_CLIENTS = 10_000


@dataclass(frozen=True, slots=True)
class ServiceLimits:
    """Limits of a service.

    Parameters
    ----------
    sessions : int
        Sessions at a time.
    idle_s : float
        Time after the last request of a session at which it ends.
    state_bytes : int
        Memory for states. Beyond it those that were used least recently are kept on disk where
        there is a folder for them; otherwise no further session begins.
    body_bytes : int
        Largest body of a request.
    rate_per_s : float
        Requests a second of one client address; each further epoch of a request counts as one.
    burst_s : float
        A client that was silent may use up so many seconds of its rate at once.
    receive_s, send_s : float
        Time in which a client has to send a request, or to take a part of an answer.
    waiting : int
        Requests of a session that may wait for the one before.
    listeners : int
        Streams of events of a session.
    watched : int
        Sessions that pages show at a time: their steps take several times as long.
    """

    sessions: int = 1000
    idle_s: float = 3600.0
    state_bytes: int = 1000 << 20
    body_bytes: int = 1 << 20
    rate_per_s: float = 200.0
    burst_s: float = 5.0
    receive_s: float = 30.0
    send_s: float = 30.0
    waiting: int = 4
    listeners: int = 8
    watched: int = 32


@dataclass(slots=True)
class RateLimit:
    """A token bucket for each client address; those not seen for longest are forgotten.

    Parameters
    ----------
    per_s : float
        Tokens a second.
    burst : float
        Tokens of a full bucket, at least 2.
    most_debt : float
        Tokens that a bucket may owe at most.

    Examples
    --------
    >>> limit = RateLimit(per_s=2.0, burst=2.0)
    >>> [limit.wait_s("a", 1.0, now_s=0.0) for _ in range(3)], limit.wait_s("b", 1.0, now_s=0.0)
    ([0.0, 0.0, 0.5], 0.0)
    >>> limit.wait_s("a", 1.0, now_s=0.5)
    0.0
    """

    per_s: float
    burst: float
    most_debt: float = 0.0
    _level: OrderedDict[str, tuple[float, float]] = field(default_factory=OrderedDict)

    def wait_s(self, client: str, cost: float, now_s: float) -> float:
        """Take from a client's bucket; return 0, or the seconds to wait where nothing is taken.

        A cost above the bucket is taken from one that lacks at most one token, as the request took
        one when it came; the bucket is in debt afterwards.
        """
        held, then_s = self._level.pop(client, (self.burst, now_s))
        held = min(held + (now_s - then_s) * self.per_s, self.burst)
        short = min(cost, self.burst - 1.0) - held
        enough = short <= 1e-9
        self._level[client] = (max(held - cost, -self.most_debt) if enough else held, now_s)
        while len(self._level) > _MOST_CLIENTS:
            self._level.popitem(last=False)
        return 0.0 if enough else short / self.per_s


def same_token(given: str | None, token: str) -> bool:
    """Compare tokens in a time that does not depend on where they differ, nor on their lengths."""
    digests = (hashlib.sha256((one or "").encode()).digest() for one in (given, token))
    return hmac.compare_digest(*digests) and given is not None


def bearer(headers: Mapping[str, str]) -> str | None:
    """Return the token of a request's ``Authorization`` header."""
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if kind.lower() == "bearer" else None


def is_own_host(header: str, names: frozenset[str]) -> bool:
    """Return whether a ``Host`` header is an address, localhost, or one of some names.

    A web page of a stranger can make its own name point to this machine (DNS rebinding), and would
    then be let in by the browser; it cannot make an address its name.

    Examples
    --------
    >>> [is_own_host(host, frozenset()) for host in ("127.0.0.1:80", "[::1]:80", "localhost")]
    [True, True, True]
    >>> is_own_host("evil.example:80", frozenset()), is_own_host("", frozenset())
    (False, False)
    """
    name = header.rpartition("]")[0].removeprefix("[") if header.startswith("[") else ""
    name = (name or header.partition(":")[0]).lower().rstrip(".")
    if name == "localhost" or name in names:
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_local(host: str) -> bool:
    """Return whether an address to listen on is reached from this machine only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"
