"""A filter that a user wrote, imported by its name.

The name is ``package.module:Name``. Called with a database, it gives an object with the four
functions of :class:`mapfilter.filters.contract.Filter`; prior and readings are epochs. Importing it
runs the code of its module: give only names of modules that you trust.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from math import nan
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, InputError, MapfilterError, fail
from mapfilter.filters.contract import (
    Estimate,
    Event,
    Filter,
    Reason,
    Status,
    Step,
    UpdateInfo,
    run,
)
from mapfilter.geodesy import same_crs
from mapfilter.positioning.epochs import Epoch, epochs
from mapfilter.positioning.estimate import Fix, PositionedTrack, TrackEstimate, UnusedReading
from mapfilter.positioning.matched_way import nearest_ways
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING

MapFilter = Filter[Epoch, Any, Epoch]
"""A filter whose prior and readings are epochs."""

_FUNCTIONS = ("init", "predict", "update", "locate")


@dataclass(frozen=True, slots=True)
class CustomFilter:
    """A filter by its name; it is imported anew by every process.

    Parameters
    ----------
    name : str
        ``package.module:Name``.
    source_sha256 : str
        Of the module's file, so that what an older text of it found is not taken for its results.
    """

    name: str
    source_sha256: str = ""


def custom_filter(name: str) -> CustomFilter:
    """Import a filter to see that it is there, and return its options.

    Raises
    ------
    ConfigError
        It cannot be imported, is not called, or lacks a function of a filter.

    Examples
    --------
    >>> custom_filter("math:pi")
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: filter math:pi: expected a class, or a function that makes a \
filter of a database, found float
    """
    found = _imported(name)
    if isinstance(found, type):
        _check_functions(name, found)
    file = _file(inspect.getmodule(found) or _module(name))
    text = file.read_bytes() if file is not None and file.is_file() else b""
    return CustomFilter(name, hashlib.sha256(text).hexdigest())


def make_filter(own: CustomFilter, database: RadioRouteDatabase) -> MapFilter:
    """Make the filter over a database.

    Raises
    ------
    ConfigError
        As :func:`custom_filter`, or the filter does not take a database.
    """
    with wrap_user_errors(own.name):
        made: MapFilter = _imported(own.name)(database)
    _check_functions(own.name, made)
    return made


def _imported(name: str) -> Any:
    module, _, path = name.partition(":")
    try:
        found: Any = import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    # A module may do anything when it is imported, also end the program.
    except (Exception, SystemExit) as error:
        hint = "its folder is neither the working folder nor in PYTHONPATH"
        raise fail(
            ConfigError,
            f"filter {name}",
            "a filter that can be imported as package.module:Name",
            _said(error),
            hint if isinstance(error, ModuleNotFoundError) else "",
        ) from error
    if not callable(found):
        expected = "a class, or a function that makes a filter of a database"
        raise fail(ConfigError, f"filter {name}", expected, type(found).__name__)
    return found


def _check_functions(name: str, found: object) -> None:
    lacking = [one for one in _FUNCTIONS if not callable(getattr(found, one, None))]
    if lacking:
        expected = f"the functions {', '.join(_FUNCTIONS)}"
        raise fail(ConfigError, f"filter {name}", expected, f"no {', '.join(lacking)}")


@contextmanager
def wrap_user_errors(name: str) -> Iterator[None]:
    """Tell what goes wrong in a filter's code with its place; the cause keeps the traceback.

    Raises
    ------
    ConfigError
        In place of any error that is not ours.
    """
    try:
        yield
    except MapfilterError:
        raise
    except Exception as error:
        # The last line outside of libraries is most likely the user's own.
        frames, file = traceback.extract_tb(error.__traceback__), _file(_module(name))
        own = [frame for frame in frames if file is not None and Path(frame.filename) == file]
        at = (own or list(frames))[-1]
        where = f"filter {name}, {Path(at.filename).name} line {at.lineno}, in {at.name}"
        hint = "mapfilter.testing.check_filter tells which clause of the contract it breaks"
        raise fail(ConfigError, where, "a filter that runs", _said(error), hint) from error


def _said(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def _module(name: str) -> ModuleType | None:
    return sys.modules.get(name.partition(":")[0])


def _file(module: ModuleType | None) -> Path | None:
    file = getattr(module, "__file__", None)
    return Path(file) if file else None


_NOWHERE = Estimate(nan, nan, np.full((2, 2), nan), np.full(3, nan))


def position_by_own(
    database: RadioRouteDatabase,
    filter_: MapFilter,
    log: TrackLog,
    rng: np.random.Generator,
    *,
    name: str,
    ways: bool = True,
) -> PositionedTrack:
    """Locate a log with a filter of one's own.

    It starts at the first epoch with a fix or with a serving cell of which the database has points:
    ``init`` is given that epoch, and ``update`` the same one and all later ones in which something
    was heard: reports, fixes, pseudoranges or time differences. What is before is labelled and
    passed over.

    Parameters
    ----------
    database : RadioRouteDatabase
    filter_ : Filter
        Its prior and its readings are epochs.
    log : TrackLog
        In the database's CRS.
    rng : numpy.random.Generator
        Handed to the filter.
    name : str
        What estimates call the filter.
    ways : bool
        Whether positions are matched to ways.

    Raises
    ------
    InputError
        The log is in another CRS than the database.
    ConfigError
        The filter's code fails, or returns something else than the contract says.
    """
    if not same_crs(log.crs, database.lattice.crs):
        raise fail(
            InputError, "log, crs", database.lattice.crs, log.crs, "log of another area or zone"
        )
    known = _cells_with_points(database)
    fixes: list[Fix] = []
    unused: list[UnusedReading] = []
    began_s = time.process_time()
    with wrap_user_errors(name):
        for fix, told in _follow(filter_, epochs(log), known, rng):
            fixes.append(fix)
            unused += told
    filter_s = time.process_time() - began_s
    estimate = TrackEstimate.of_fixes(
        database.lattice.crs,
        name,
        nearest_ways(database, fixes) if ways else fixes,
        start_utc_s=log.start_utc_s,
        unused=unused,
    )
    return PositionedTrack(estimate, (), filter_s)


def _follow(
    filter_: MapFilter,
    merged: Sequence[Epoch],
    known: Callable[[str], Reason],
    rng: np.random.Generator,
) -> Iterator[tuple[Fix, list[UnusedReading]]]:
    """Yield what the filter says after each epoch, and what it did not use."""
    belief: Any = None
    status, hypotheses = Status.SEARCHING, 0
    for epoch in merged:
        cell, reason = _serving(epoch, known)
        unused: list[UnusedReading] = []
        if belief is None:
            if epoch.motion:
                unused.append(UnusedReading(epoch.time_s, "motion", "", Reason.NOT_STARTED))
            if epoch.fix is None and reason is not Reason.USED:
                if epoch.heard:
                    unused.append(UnusedReading(epoch.time_s, SERVING, cell, reason))
                yield _fix(epoch, _NOWHERE, status, 0, reason), unused
                continue
            belief = filter_.init(epoch, rng)
            events: tuple[Event[Epoch], ...] = (Event(epoch.time_s, reading=epoch),)
        else:
            events = _events(epoch)
        info = None
        for taken in run(filter_, belief, events, rng):
            _check_types(taken)
            belief = taken.belief
            if taken.motion_reason is not Reason.USED:
                unused.append(UnusedReading(epoch.time_s, "motion", "", taken.motion_reason))
            info = taken.info or info
        if info is not None:
            status, hypotheses, reason = info.status, info.hypotheses, info.reason
            if reason not in (Reason.USED, Reason.NOT_MOVED_ENOUGH):
                unused.append(UnusedReading(epoch.time_s, SERVING, cell, reason))
        elif status is Status.CONVERGED:
            status = Status.TRACKING
        located = filter_.locate(belief)
        if not isinstance(located, Estimate):
            raise TypeError(f"locate returns an Estimate, not {type(located).__name__}")
        yield _fix(epoch, located, status, hypotheses, reason), unused


def _events(epoch: Epoch) -> tuple[Event[Epoch], ...]:
    *earlier, last = epoch.motion or (None,)
    told = epoch.heard or epoch.ranges or epoch.differences or epoch.fix is not None
    heard = epoch if told else None
    return (
        *(Event[Epoch](epoch.time_s, motion) for motion in earlier),
        Event(epoch.time_s, last, heard),
    )


def _fix(epoch: Epoch, located: Estimate, status: Status, hypotheses: int, reason: Reason) -> Fix:
    return Fix(
        epoch.time_s,
        float(located.east_m),
        float(located.north_m),
        np.asarray(located.covariance_m2, dtype=np.float64).reshape(2, 2),
        np.asarray(located.radii_m, dtype=np.float64).reshape(3),
        status,
        hypotheses,
        nan,
        0,
        nan,
        reason,
    )


def _serving(epoch: Epoch, known: Callable[[str], Reason]) -> tuple[str, Reason]:
    """Return the serving cell, and whether the filter can start from it."""
    if not epoch.heard:
        return "", Reason.NO_READING
    named = [row.cell for row in epoch.heard if row.role == SERVING and row.cell is not None]
    return (named[0], known(named[0])) if named else ("", Reason.NO_SERVING_CELL)


def _cells_with_points(database: RadioRouteDatabase) -> Callable[[str], Reason]:
    cells = frozenset(database.cell_ids)

    @cache
    def known(cell: str) -> Reason:
        if cell not in cells:
            return Reason.UNKNOWN_CELL
        row, _, _ = database.cell_points(cell)
        return Reason.USED if row.size else Reason.NO_POINTS_IN_CELL

    return known


def _check_types(taken: Step[Any, Epoch]) -> None:
    if not isinstance(taken.motion_reason, Reason):
        raise TypeError("predict returns (belief, Reason)")
    if taken.info is not None and not isinstance(taken.info, UpdateInfo):
        raise TypeError("update returns (belief, UpdateInfo)")
