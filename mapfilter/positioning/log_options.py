"""Options of a filter that a log itself states: steps of timing advance and of levels."""

from __future__ import annotations

from dataclasses import fields, replace
from math import hypot
from typing import Any, TypeVar

import numpy as np

from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.tracks.log import TrackLog

OptionsT = TypeVar("OptionsT")


def fitted_to_log(options: OptionsT, log: TrackLog) -> tuple[OptionsT, tuple[str, ...]]:
    """Return options with what a log states in place of defaults, and notes on the changes.

    The step of timing advance is that of the technology of all reports that have one; a step of
    levels (the column ``level_step_db``) adds its rounding error, ``step / √12``, to the error of
    levels. Options that are no dataclass, lack these fields, or have other values than the
    defaults, are not changed.
    """
    default = _defaults(options)
    changes: dict[str, Any] = {}
    notes = []
    step_m = timing_step_m(log)
    # The default is that of GSM, rounded to 0.1 m.
    other = step_m is not None and abs(step_m - default.get("timing_step_m", step_m)) > 1.0
    if other and _is_default(options, default, "timing_step_m"):
        changes["timing_step_m"] = step_m
        notes.append(f"timing advance: steps of {step_m:.2f} m, by technology")
    step_db = level_step_db(log)
    if step_db > 0 and _is_default(options, default, "level_error_db"):
        error_db = hypot(default["level_error_db"], step_db / 12**0.5)
        changes["level_error_db"] = error_db
        notes.append(f"levels in steps of {step_db:g} dB: level_error_db = {error_db:.2f}")
    if not changes:
        return options, ()
    return replace(options, **changes), tuple(notes)  # type: ignore[type-var]


def timing_step_m(log: TrackLog) -> float | None:
    """Return the step of all timing advances of a log; None where unknown, or of several kinds."""
    if "technology" not in log.radio:
        return None
    of = log.radio["technology"][log.radio["timing_advance"].notna().to_numpy()]
    families = set(of.dropna())
    if of.isna().any() or len(families) != 1:
        return None
    return TIMING_STEP_M.get(families.pop())


def level_step_db(log: TrackLog) -> float:
    """Return the median step of the levels inside the scale of a log; 0 where none is stated."""
    if "level_step_db" not in log.radio:
        return 0.0
    inside = (log.radio["censored"] == 0).to_numpy() & log.radio["level_dbm"].notna().to_numpy()
    steps = log.radio["level_step_db"].fillna(0.0).to_numpy(dtype=np.float64)[inside]
    return float(np.median(steps)) if steps.size else 0.0


def _defaults(options: Any) -> dict[str, Any]:
    if not hasattr(type(options), "__dataclass_fields__"):
        return {}
    return {one.name: one.default for one in fields(options)}


def _is_default(options: Any, default: dict[str, Any], name: str) -> bool:
    return name in default and bool(getattr(options, name) == default[name])
