"""Options of a filter that a log itself states: errors of motion, steps of timing and levels."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import hypot
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from annotated_types import Ge, Le

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.models.street_motion import MotionErrors
from mapfilter.options import Options
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.logged_errors import (
    by_typical_step,
    has_long_rows,
    standing_errors,
    stated_errors,
    turn_drift_deg_per_s,
)
from mapfilter.positioning.vehicle_signs import vehicle_signs
from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.tracks.checks.motion_fault import fault_notes
from mapfilter.tracks.checks.speeds import speed_fault
from mapfilter.tracks.log import TrackLog

STREETS_ALONE = "no cells in the log: located by streets, and by positions where it has some"

OptionsT = TypeVar("OptionsT")


@dataclass(frozen=True, slots=True)
class LogStatement(Options):
    """What a log states, for a live application, which has no log yet.

    Parameters
    ----------
    technology : {"GSM", "LTE"} or None
        Of all timing advances, which gives their step; None where unknown, or of several kinds.
    level_step_db : float
        Step of levels inside their scale, such as the width of a bar; 0 for none.
    vehicle : bool or None
        Whether motion is a vehicle's, such as of its wheels; None where unknown.
    """

    technology: Literal["GSM", "LTE"] | None = None
    level_step_db: Annotated[float, Ge(0), Le(60)] = 0.0
    vehicle: bool | None = None

    @classmethod
    def of_log(cls, log: TrackLog) -> LogStatement:
        """Return what a log states."""
        return cls(_timing_technology(log), level_step_db(log), log.vehicle)


def fitted_to_statement(
    options: OptionsT, stated: LogStatement
) -> tuple[OptionsT, tuple[str, ...]]:
    """Return options with what is stated in place of defaults, and notes on the changes.

    With the statement of a log these are the options by which that log is located, unless
    :func:`fitted_to_log` takes more from it: measured errors of motion, and the signs of a vehicle.

    Examples
    --------
    >>> options, notes = fitted_to_statement(BayesFilter(), LogStatement(technology="LTE"))
    >>> round(options.timing_step_m, 2), notes
    (78.07, ('timing advance: steps of 78.07 m, by technology',))
    """
    changes, notes = _stated_changes(options, stated)
    return _changed(options, changes), tuple(notes)


def fitted_to_log(options: OptionsT, log: TrackLog) -> tuple[OptionsT, tuple[str, ...]]:
    """Return options with what a log states in place of defaults, and notes on the changes.

    Errors of motion that were measured (``log.imu``) are those that the filter assumes, the map
    filter those of a typical step where rows are longer; the step of
    timing advance is that of the technology of all reports that have one; a step of levels (the
    column ``level_step_db``) adds its rounding error, ``step / √12``, to the error of levels. The
    motion of wheels is a vehicle's (``log.vehicle``); where a log does not state it, turns without
    headings are taken for a vehicle's odometry by several signs
    (:class:`mapfilter.positioning.vehicle_signs.VehicleSigns`). Steps with headings whose speed is
    no walker's are noted.
    Options that are no dataclass, lack these fields, or have other values than the defaults, are
    not changed.
    """
    changes, notes = _stated_changes(options, LogStatement.of_log(log))
    if log.vehicle is None and has_default(options, "vehicle"):
        vehicle, note = _motion_by_signs(log)
        if vehicle is not None:
            changes["vehicle"] = vehicle
        notes += [note] if note else []
    stated, units = stated_errors(log), {}
    if isinstance(options, BayesFilter) and stated and has_long_rows(log):
        stated["step_sd_m"] = by_typical_step(stated["step_sd_m"], log)
        units["step_sd_m"] = f" (of a step of {MotionErrors().typical_step_m:g} m)"
    measured = _in_place_of_defaults(options, stated)
    if measured:
        shown = ", ".join(
            f"{name} = {value:.3g}{units.get(name, '')}" for name, value in measured.items()
        )
        notes.append(f"errors of motion as the log states them: {shown}")
        changes |= measured
    standing = _in_place_of_defaults(options, standing_errors(log))
    if standing:
        shown = ", ".join(f"{name} = {value:.3g}" for name, value in standing.items())
        notes.append(f"errors of turns as they are at standstill: {shown}")
        changes |= standing
    may_drift = has_default(options, "turn_rate_sd_deg_per_s")
    drift_deg_per_s = turn_drift_deg_per_s(log) if may_drift else 0.0
    if drift_deg_per_s > changes.get("turn_rate_sd_deg_per_s", 0.0):
        changes["turn_rate_sd_deg_per_s"] = drift_deg_per_s
        notes.append(
            f"turns drift by {drift_deg_per_s:.2g} deg/s beside the course of the positions, as of "
            "a gyroscope with a bias: turn_rate_sd_deg_per_s is as large"
        )
    return _changed(options, changes), tuple(notes)


def _stated_changes(options: Any, stated: LogStatement) -> tuple[dict[str, Any], list[str]]:
    """Return which fields take other values by a statement, and notes on them."""
    default = _defaults(options)
    changes: dict[str, Any] = {}
    notes = []
    step_m = TIMING_STEP_M.get(stated.technology or "")
    # The default is that of GSM, rounded to 0.1 m.
    other = step_m is not None and abs(step_m - default.get("timing_step_m", step_m)) > 1.0
    if other and has_default(options, "timing_step_m"):
        changes["timing_step_m"] = step_m
        notes.append(f"timing advance: steps of {step_m:.2f} m, by technology")
    step_db = stated.level_step_db
    # Rounding is noise where that is apart from errors that last.
    rounded = "level_noise_db" if "level_noise_db" in default else "level_error_db"
    if step_db > 0 and has_default(options, rounded):
        error_db = hypot(default[rounded], step_db / 12**0.5)
        changes[rounded] = error_db
        notes.append(f"levels in steps of {step_db:g} dB: {rounded} = {error_db:.2f}")
    if stated.vehicle is not None and has_default(options, "vehicle"):
        whose = "a vehicle's" if stated.vehicle else "no vehicle's"
        changes["vehicle"] = stated.vehicle
        notes.append(f"motion: {whose}, as the log states it (filter.bayes.vehicle)")
    return changes, notes


def has_default(options: Any, name: str) -> bool:
    """Return whether options have a field, and it has its default."""
    default = _defaults(options)
    return name in default and bool(getattr(options, name) == default[name])


def _in_place_of_defaults(options: Any, found: dict[str, float]) -> dict[str, float]:
    """Return those of some values that are other than defaults which options have."""
    default = _defaults(options)
    return {
        name: value
        for name, value in found.items()
        if has_default(options, name) and value != default[name]
    }


def _changed(options: OptionsT, changes: dict[str, Any]) -> OptionsT:
    return replace(options, **changes) if changes else options  # type: ignore[type-var]


def by_streets_alone(options: object, log: TrackLog, database: RadioRouteDatabase) -> bool:
    """Return whether a log has motion and no cells, so that cells of a database tell nothing.

    The Bayes map filter starts by the streets, or by positions, and takes their rules in a database
    without cells (:meth:`mapfilter.database.radioroutes.RadioRouteDatabase.without_cells`).
    """
    if not isinstance(options, BayesFilter) or isinstance(options, GridFilter):
        return False
    measured = (log.radio, log.tdoa)
    moved = log.motion["step_m"].notna().any()
    return bool(database.cell_ids and moved) and all(table.empty for table in measured)


def _motion_by_signs(log: TrackLog) -> tuple[bool | None, str]:
    """Return whether motion is a vehicle's, None where nothing speaks for one, and a note."""
    signs = vehicle_signs(log)
    if signs is None:
        # Where positions contradict the steps, their note says more than the speed does.
        in_doubt = log.imu is None and not fault_notes(log.notes, "step_m")
        fault = speed_fault(log.motion) if in_doubt else ""
        advice = "if a vehicle moved, set filter.bayes.vehicle = true"
        return None, f"motion: {fault}; {advice}" if fault else ""
    if not signs.fast:
        return None, ""
    whose = "a vehicle's" if signs.vehicle else "a cyclist's, no vehicle's"
    return (
        signs.vehicle or None,
        f"motion: turns without headings, {signs}: taken for {whose} (filter.bayes.vehicle)",
    )


def _timing_technology(log: TrackLog) -> Literal["GSM", "LTE"] | None:
    """Return the technology of all timing advances; None where unknown, or of several kinds."""
    if "technology" not in log.radio:
        return None
    of = log.radio["technology"][log.radio["timing_advance"].notna().to_numpy()]
    if of.isna().any():
        return None
    families = set(of)
    return "GSM" if families == {"GSM"} else "LTE" if families == {"LTE"} else None


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
