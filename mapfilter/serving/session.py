"""One session: the filter's state of a device, and what is known of it besides."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

from mapfilter._same import EqualByValue
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.log_options import LogStatement
from mapfilter.serving.events import Channel

_EMPTY_STATE_BYTES = 20_000
_ARRAYS = ("state", "log_weight", "kept")


@dataclass(frozen=True, slots=True, eq=False)
class Progress(EqualByValue):
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
        state = self.state
        rivals = (*state.held, *state.unaided, state.alternative, state.twin)
        beliefs = [state.belief, *(one.belief for one in rivals if one is not None)]
        arrays = [getattr(b, name) for b in beliefs for name in _ARRAYS if hasattr(b, name)]
        return _EMPTY_STATE_BYTES + sum(int(one.nbytes) for one in arrays)


@dataclass(eq=False, slots=True)
class Session:
    """One device.

    Parameters
    ----------
    id : str
        128 random bits; who knows it may use the session.
    name : str
        As the client calls it; may be empty.
    seed : int
        Of its random generator.
    began_utc_s : float
        When it began, Unix time.
    progress : Progress or None
        None while it is on disk only.
    epochs, time_s, last
        As of :class:`Progress`, also while that is on disk.
    saved_epochs, saved_time_s : int and float
        Epochs that are on disk, and the time of the last of them; -1 and NaN for nothing.
    used_s : float
        When it was last used, of the monotonic clock.
    bytes : int
        Memory of its state.
    waiting : int
        Requests that wait for it.
    ended : bool
        Whether it is to be used no more.
    fault_told : bool
        Whether a fault in what a page shows was reported.
    lock : asyncio.Lock
        Held by the request that uses the state.
    channel : Channel
        To the pages that watch it.
    stated : LogStatement
        What the device's log states, which its filter is fitted to.
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
    fault_told: bool = False
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    channel: Channel = field(default_factory=Channel)
    stated: LogStatement = field(default_factory=LogStatement)

    def take(self, progress: Progress) -> None:
        """Replace what is known by what is new."""
        self.progress, self.epochs, self.time_s = progress, progress.epochs, progress.time_s
        self.last, self.bytes = progress.last, progress.state_bytes
