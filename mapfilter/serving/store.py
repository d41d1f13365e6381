"""The folder of saved sessions."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import ensure_writable_folder
from mapfilter.errors import ConfigError, Faults, StoreError, fail
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.level_memory import LevelMemory
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.receiver import LINEAR
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.serving.filters import statement_of
from mapfilter.serving.state_file import read_session, write_session

SUFFIX = ".session"
LOCK = ".lock"
"""Empty file of a folder, locked while a service uses it."""

_LETTERS = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_")
_ID_LENGTH = 22
_TYPES: Mapping[str, type | tuple[type, ...]] = {
    "name": str,
    "seed": int,
    "began_utc_s": float,
    "stated": dict,
    "state": BayesState,
    "rng": dict,
    "epochs": int,
    "time_s": float,
    "last": str,
}


@dataclass(frozen=True, slots=True)
class SessionStore:
    """Saved sessions, a file each, in a folder that one service uses at a time.

    Parameters
    ----------
    folder : Path
        Of sessions of one database and filter only.
    binding : str
        Of which database and filter; states mean nothing over another.
    lock : FileIO
        A locked file of the folder; see :meth:`close`.
    """

    folder: Path
    binding: str
    lock: FileIO = field(repr=False, compare=False)

    @classmethod
    def in_folder(cls, folder: Path, binding: str) -> SessionStore:
        """Take a folder, and make it where there is none.

        Raises
        ------
        OutputError
            It cannot be written.
        ConfigError
            Another service uses it, or it cannot be locked.
        """
        ensure_writable_folder(folder)
        return cls(folder, binding, _locked(folder))

    def close(self) -> None:
        """Leave the folder to others."""
        self.lock.close()

    def path(self, session_id: str) -> Path:
        """Return the file of a session; ids are those that the service made, never paths."""
        if len(session_id) != _ID_LENGTH or not _LETTERS.issuperset(session_id):
            raise ValueError("no id of a session")
        return self.folder / f"{session_id}{SUFFIX}"

    def write(self, session_id: str, value: Mapping[str, Any]) -> None:
        """Save a session; it is there whole, or as it was saved before."""
        write_session(self.path(session_id), {**value, "binding": self.binding})

    def read(self, session_id: str) -> dict[str, Any]:
        """Read a session.

        Raises
        ------
        StoreError
            It is missing, damaged, or of another version.
        ConfigError
            It is of another database or filter.
        """
        path = self.path(session_id)
        value = read_session(path)
        if value.get("binding") != self.binding:
            expected = "sessions of this database and these options of the filter"
            hint = "the database was built again; choose another folder, or remove the sessions"
            raise fail(ConfigError, f"--state, {path}", expected, "one of others", hint)
        _check(value, str(path))
        return value

    def read_all(self) -> tuple[dict[str, dict[str, Any]], list[str]]:
        """Return all saved sessions without their states, and why others cannot be read.

        Raises
        ------
        ConfigError
            The folder is that of another database or filter.
        """
        found: dict[str, dict[str, Any]] = {}
        lost: list[str] = []
        for path in sorted(self.folder.glob(f"*{SUFFIX}")):
            name = path.name.removesuffix(SUFFIX)
            try:
                value = self.read(name)
            except ValueError:
                lost.append(f"{path}: no name of a session")
            except StoreError as error:
                lost.append(str(error))
            else:
                del value["state"]
                found[name] = value
        return found, lost

    def remove(self, session_id: str) -> None:
        """Remove a session; nothing happens where there is none."""
        self.path(session_id).unlink(missing_ok=True)


def _locked(folder: Path) -> FileIO:
    """Return a locked file; the system unlocks it when the process ends, in whatever way."""
    where, expected = f"--state, {folder}", "a folder that no other service uses"
    try:
        held = FileIO(folder / LOCK, "a", opener=_open_private)
    except OSError as error:
        raise fail(ConfigError, where, expected, f"{LOCK}: {error.strerror}") from error
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        held.close()
        if isinstance(error, BlockingIOError):
            hint = "end the other service, or choose another folder"
            raise fail(ConfigError, where, expected, "one in use", hint) from error
        raise fail(ConfigError, where, "a folder that can be locked", error.strerror) from error
    return held


def _open_private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)


def _check(value: Mapping[str, Any], where: str) -> None:
    """Raise StoreError where values do not fit together, before compiled code gets them."""
    for name, kind in _TYPES.items():
        if not isinstance(value.get(name), kind):
            raise fail(StoreError, where, f"{name}, as it was saved", "something else", "edited")
    faults = Faults()
    statement_of(value["stated"], faults)
    if faults.found:
        raise fail(StoreError, where, "what a log states", "something else", "edited")
    state = value["state"]
    beliefs, sources = (
        [state.belief, *(one.belief for one in state.held + state.unaided)],
        [state.sources],
    )
    if state.alternative is not None:
        beliefs.append(state.alternative.belief)
        sources.append(state.alternative.sources)
    if state.twin is not None:
        beliefs.append(state.twin.belief)
    is_whole = all(belief is None or _is_whole(belief) for belief in beliefs)
    if not (is_whole and all(_receives_whole(one) for one in sources)):
        raise fail(StoreError, where, "arrays of one length", "others", "edited")
    try:
        np.random.default_rng().bit_generator.state = value["rng"]
    except (ValueError, TypeError, KeyError) as error:
        raise fail(StoreError, where, "a random generator", "something else", "edited") from error


def _is_whole(belief: object) -> bool:
    if not isinstance(belief, ParticleBelief):
        return False
    shared, count = belief.shared, belief.log_weight.size
    width = shared.width if isinstance(shared, LevelMemory) else belief.kept.shape[0]
    rows, columns = belief.state.shape if belief.state.ndim == 2 else (0, 0)
    # Behind these rows stand those of a satellite receiver.
    return (
        rows >= STATES
        and columns == count
        and belief.log_weight.shape == (count,)
        and belief.kept.shape == (width, count)
    )


def _receives_whole(sources: Mapping[str, Any]) -> bool:
    """Return whether the receiver among the states of sources, if any, has all of its states."""
    gnss = sources.get(GnssSource.name)
    receiver = gnss.receiver if isinstance(gnss, GnssState) else None
    if receiver is None:
        return True
    satellites = len(receiver.biases.names)
    size = LINEAR + satellites
    return (
        receiver.mean.shape == (size,)
        and receiver.covariance.shape == (size, size)
        and receiver.biases.reflection_m.shape == (satellites,)
    )
