"""The filter of each session: that of the service, fitted to what the device's log states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np

from mapfilter.errors import Faults
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.log_options import LogStatement, fitted_to_statement, has_default
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.serving.documents import as_json, check_keys, number
from mapfilter.serving.watching import Watcher

LOG = "log"
"""Name of what a log states, in the body that begins a session."""

_USUAL = LogStatement()
_KEPT = 8
"""Filters that are kept besides the usual one; others are made again when they are needed."""
_MOST_STEP_DB, _STEP_DIGITS = 60.0, 1


@dataclass(frozen=True, eq=False)
class SessionFilter:
    """The filter of sessions whose logs state the same.

    Parameters
    ----------
    positioner : BayesPositioner
        The filter over the area.
    watcher : Watcher
        Shows its steps.
    technology : str
        Whose timing advances it reads; empty where an option of the service sets their step.
    exact_levels : bool
        Whether levels count as exact: no step is stated, and no option sets their error.
    notes : tuple of str
        Options that are others by what is stated.
    """

    stated: LogStatement
    positioner: BayesPositioner
    watcher: Watcher
    technology: str
    exact_levels: bool
    notes: tuple[str, ...] = ()

    def unused(self, document: Mapping[str, Any]) -> tuple[str, ...]:
        """Return notes on what a request's epochs, which were checked, state in vain."""
        if not self.exact_levels:
            return ()
        rows = [row for epoch in document["epochs"] for row in epoch.get("radio") or ()]
        steps_db = [
            row.get("level_step_db") or 0.0
            for row in rows
            if row.get("level_dbm") is not None and not row.get("censored")
        ]
        step_db = float(np.median(steps_db)) if steps_db else 0.0
        if not step_db:
            return ()
        stated = f'"{LOG}": {{"level_step_db": {step_db:g}}}'
        return (f"levels in steps of {step_db:g} dB count as exact; begin sessions with {stated}",)


class SessionFilters:
    """Filters over one area, by what logs state.

    Parameters
    ----------
    options : BayesFilter
        Of the service.
    make : callable
        Makes a filter over the area.
    plan : CellPlan
        Cells of the database.
    """

    def __init__(
        self,
        options: BayesFilter,
        make: Callable[[BayesFilter], BayesPositioner],
        plan: CellPlan,
    ) -> None:
        self.options, self.make, self.plan = options, make, plan
        self.usual = self._made(_USUAL)
        self._of, self._making = lru_cache(maxsize=_KEPT)(self._made), Lock()

    def of(self, stated: LogStatement) -> SessionFilter:
        """Return the filter of a session; it may have to be made first."""
        if stated == _USUAL:
            return self.usual
        with self._making:
            return self._of(stated)

    def _made(self, stated: LogStatement) -> SessionFilter:
        fitted, notes = fitted_to_statement(self.options, stated)
        positioner = self.make(fitted)
        exact_levels = not stated.level_step_db and has_default(self.options, "level_error_db")
        read = (stated.technology or "GSM") if has_default(self.options, "timing_step_m") else ""
        watcher = Watcher.over(positioner, self.plan)
        return SessionFilter(stated, positioner, watcher, read, exact_levels, notes)


def statement_of(given: object, faults: Faults) -> LogStatement:
    """Return what the log of a device states, as it begins a session; with faults, nothing."""
    if not isinstance(given, Mapping):
        if given is not None:
            faults.add(LOG, f"an object with {', '.join(_fields())}", "something else")
        return _USUAL
    before = len(faults.found)
    check_keys(given, _fields(), LOG, faults)
    technology, step_db, vehicle = (given.get(name) for name in _fields())
    if technology is not None and technology not in list(TIMING_STEP_M):
        expected = " or ".join(TIMING_STEP_M)
        faults.add(f"{LOG}.technology", expected, as_json(technology), "of timing advances")
    if step_db is not None:
        where, expected = f"{LOG}.level_step_db", f"dB in 0..{_MOST_STEP_DB:g}"
        step_db = number(step_db, where, expected, faults, 0.0, _MOST_STEP_DB)
    if vehicle is not None and not isinstance(vehicle, bool):
        faults.add(f"{LOG}.vehicle", "true or false", as_json(vehicle))
    if len(faults.found) > before:
        return _USUAL
    return LogStatement(technology, round(step_db or 0.0, _STEP_DIGITS), vehicle)


def statement_document(stated: LogStatement) -> dict[str, Any]:
    """Return a statement as :func:`statement_of` takes it."""
    return asdict(stated)


def _fields() -> tuple[str, ...]:
    return tuple(one.name for one in fields(LogStatement))
