"""Columns of motion that are no speeds or no turns: exchanged, or in another unit."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.errors import Faults, InputError, fail
from mapfilter.tracks.pdr.step_counts import are_own_counts
from mapfilter.tracks.pdr.turns import Turning
from mapfilter.tracks.readers.recorded.recording import Recording

_COLUMNS = {"odometry": ("speed_mps", "yaw_rate_radps"), "motion": ("step_m", "turn_rad")}
_FEWEST = 60
_BOTH_WAYS, _ONE_WAY, _MOSTLY = 0.1, 0.01, 0.3
"""Share of negative speeds of no vehicle that keeps turning to one side; of other turns; of
turns."""
_MIXED, _RESTLESS = 0.2, 0.05
"""Share of negative speeds, and of rows that change their sign, of no vehicle at all."""
_SIDEWAYS_MPS2, _OFTEN, _FEWEST_FAST, _MOVING_MPS = 20.0, 0.05, 20, 1.0
"""Twice what tyres hold in a corner."""
_FAST_MPS = 70.0
_LARGE_RAD, _SLOW = 0.5, 0.2
_FALLS = 0.1
"""Share of rows in which no counter falls, however often it begins anew."""


def check_columns(recording: Recording) -> tuple[str, ...]:
    """Return notes on columns of motion, odometry or steps that may be of another quantity.

    Speeds of both signs beside turns to one side alone are exchanged columns: a vehicle mostly
    drives ahead, and turns to both sides. Speeds and yaw rates of odometry that together push it
    sideways by more than 20 m/s² in 5 % of the rows are degrees for radians, or another unit.
    Counted steps seldom fall, or are few in each row.

    Parameters
    ----------
    recording : Recording
        Such as one with a table ``motion``, ``odometry`` or ``steps``.

    Raises
    ------
    InputError
        Columns are exchanged, no tyre holds the vehicle, or steps are none.
    """
    faults, notes = Faults(), list[str]()
    for table, names in _COLUMNS.items():
        rows = recording.tables.get(table)
        if rows is None or not set(names) <= set(rows):
            continue
        along, turn = (rows[name].to_numpy(dtype=np.float64) for name in names)
        where = f"{recording.path}, {table}"
        if _exchanged(along, turn):
            share = float(np.mean(along[np.isfinite(along) & (along != 0)] < 0))
            got = f"{share:.0%} of {names[0]} negative, and {names[1]} of one sign"
            hint = f"the columns of {names[0]} and {names[1]} are exchanged"
            faults.add(where, f"{names[0]} mostly positive, {names[1]} of both signs", got, hint)
        elif table == "motion" and _is_heading(turn):
            got = f"{np.nanmedian(np.abs(turn)):.1f} rad in the median, changing slowly"
            hint = "headings (heading_rad, or compass_deg) for their changes"
            faults.add(f"{where}, turn_rad", "changes of heading in each interval", got, hint)
        elif table == "odometry" and (most := sideways_mps2(along, turn)):
            got = f"{most:.0f} m/s² sideways (speed times yaw rate) in 5 % of the rows or more"
            hint = "degrees for radians: --column yaw_rate_degps=COLUMN; or another unit of speed"
            faults.add(where, "m/s and rad/s of a vehicle that its tyres hold", got, hint)
        elif table == "odometry" and (fast := _fast_mps(along)):
            notes.append(
                f"{recording.name}: odometry, speed_mps: {fast:.0f} m/s or more in 5 % of the "
                "rows (likely: km/h for m/s, --column wheel_speed_kmh=COLUMN)"
            )
        elif table == "odometry" and _unsigned(turn):
            notes.append(
                f"{recording.name}: odometry, yaw_rate_radps: all of one sign (likely: their "
                "sign is lost, or turns to one side alone)"
            )
        elif share := _negative_share(along):
            what = "another quantity, such as an acceleration or a rate of turning"
            notes.append(
                f"{recording.name}: {table}, {names[0]}: {share:.0%} negative, now and then "
                f"(likely: {what})"
            )
    if (steps := recording.tables.get("steps")) is not None:
        _check_counts(recording, steps, faults)
    faults.raise_if_any(InputError)
    return tuple(notes)


def check_turning(rows: pd.DataFrame, turning: Turning, where: str) -> None:
    """Raise InputError where a gyroscope's turns beside a vehicle's speeds are too fast for it.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, rising, and speed_mps.
    turning : Turning
    where : str
        Names of the files, in messages.
    """
    time_s, speed = (rows[name].to_numpy(dtype=np.float64) for name in ("time_s", "speed_mps"))
    lasted_s = np.diff(time_s, prepend=np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = turning.between(time_s) / lasted_s
    if most := sideways_mps2(speed, rate):
        expected = "rad/s of a vehicle that its tyres hold"
        got = f"{most:.0f} m/s² sideways (speed times rate of turning) in 5 % of the rows or more"
        hint = "degrees for radians per second: state it in the header, as in gyro_x (deg/s)"
        raise fail(InputError, f"{where}, gyroscope", expected, got, hint)


def _check_counts(recording: Recording, steps: pd.DataFrame, faults: Faults) -> None:
    """Note counted steps that fall again and again, and are too many for those of each row."""
    time_s, count = (steps[name].to_numpy(dtype=np.float64) for name in ("time_s", "count"))
    if count.size < _FEWEST:
        return
    falls = float(np.mean(np.diff(count) < 0))
    if falls <= _FALLS or are_own_counts(time_s, count):
        return
    got = f"{count.min():g} to {count.max():g}, falling in {falls:.0%} of the rows"
    hint = "another quantity, such as an azimuth (compass_deg) or a length (step_m)"
    if "compass" in recording.tables:
        hint = "the columns of steps and compass_deg are exchanged"
    expected = "a counter that grows, or the few steps of each row"
    faults.add(f"{recording.path}, steps", expected, got, hint)


def _exchanged(along: Floats, turn: Floats) -> bool:
    """Return whether the one has both signs and the other only one, against their nature."""
    moved, turned = (values[np.isfinite(values) & (values != 0)] for values in (along, turn))
    known = np.isfinite(turn)
    if moved.size < _FEWEST or turned.size < max(_FEWEST, _MOSTLY * known.sum()):
        return False
    back, left = float(np.mean(moved < 0)), float(np.mean(turned > 0))
    return _BOTH_WAYS <= back <= 1 - _BOTH_WAYS and min(left, 1 - left) <= _ONE_WAY


def _is_heading(turn: Floats) -> bool:
    """Return whether turns are large all the time and nearly the same from row to row."""
    known = turn[np.isfinite(turn)]
    if known.size < _FEWEST or np.median(np.abs(known)) < _LARGE_RAD:
        return False
    return bool(np.median(np.abs(wrap_rad(np.diff(known)))) < _SLOW * np.median(np.abs(known)))


def _unsigned(turn: Floats) -> bool:
    """Return whether yaw rates, noise and all, have one sign though there are many of them."""
    turned = turn[np.isfinite(turn) & (turn != 0)]
    return turned.size >= _FEWEST and bool((turned > 0).all() or (turned < 0).all())


def _negative_share(along: Floats) -> float:
    """Return the share of negative speeds that change their sign again and again; else 0."""
    moved = along[np.isfinite(along) & (along != 0)]
    if moved.size < _FEWEST:
        return 0.0
    back, changes = float(np.mean(moved < 0)), float(np.mean(np.diff(np.sign(moved)) != 0))
    return back if _MIXED <= back <= 1 - _MIXED and changes >= _RESTLESS else 0.0


def _fast_mps(speed_mps: Floats) -> float:
    """Return the speed that is exceeded in 5 % of the rows; 0 where a vehicle may have it."""
    known = np.abs(speed_mps[np.isfinite(speed_mps)])
    fast = float(np.quantile(known, 1 - _OFTEN)) if known.size >= _FEWEST else 0.0
    return fast if fast > _FAST_MPS else 0.0


def sideways_mps2(speed_mps: Floats, rate_radps: Floats, often: float = _OFTEN) -> float:
    """Return the acceleration that is often exceeded while moving; 0 where tyres hold it.

    Parameters
    ----------
    speed_mps, rate_radps : (N,) arrays
    often : float
        Share of the moving rows.
    """
    moving = np.isfinite(rate_radps) & (np.abs(speed_mps) > _MOVING_MPS)
    sideways = np.abs(speed_mps * rate_radps)[moving]
    if sideways.size < _FEWEST or np.sum(sideways > _SIDEWAYS_MPS2) < _FEWEST_FAST:
        return 0.0
    most = float(np.quantile(sideways, 1 - often))
    return most if most > _SIDEWAYS_MPS2 else 0.0
