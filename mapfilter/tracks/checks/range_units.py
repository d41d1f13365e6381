"""Units of time differences and timing advances, judged by the sites of a plan."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Bools, Floats
from mapfilter.geodesy import same_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import LIMITS, TIMING_STEP_M
from mapfilter.tracks.log import TrackLog

_FEWEST = 20
_SHARE = 0.25
_ALIKE = 0.8
_FACTOR = 1.25
_TINY = 0.02
_NEAR_M = 50.0
_USUAL_SD_M = 100.0
_FEWEST_STEPS = 2.0
_OFTEN_GSM = 63
_UNITS: Mapping[str, float] = {
    "the sign the other way round: how much farther the reference is?": -1.0,
    "nanoseconds for metres?": 1e9 / LIGHT_MPS,
    "microseconds for metres?": 1e6 / LIGHT_MPS,
    "kilometres for metres?": 1e-3,
}
"""What differences in metres are multiplied by, by the mistake."""


def with_range_notes(log: TrackLog, plan: CellPlan) -> TrackLog:
    """Return a log with notes on time differences and timing advances of another unit.

    Parameters
    ----------
    plan : CellPlan
        Whose ids the log has, see :func:`mapfilter.tracks.joining.identify.name_by_plan`.
    """
    notes = [note for note in range_notes(log, plan) if note not in log.notes]
    return replace(log, notes=(*log.notes, *notes)) if notes else log


def range_notes(log: TrackLog, plan: CellPlan) -> tuple[str, ...]:
    """Return what is wrong with the unit of time differences and timing advances; none for nothing.

    A difference of distances to two sites is at most their own distance. Where the log has true
    positions, or fixes, distances from there are compared. Without, a sign cannot be judged, nor a
    unit in which the values stay possible.
    """
    if not same_crs(log.crs, plan.crs):
        return ()
    sites_m = {cell.id: (cell.east_m, cell.north_m) for cell in plan.cells}
    places = next((rows for rows in (log.truth, log.gnss) if len(rows) > 1), log.truth)
    found = {
        "tdoa, difference_m": _differences(log.tdoa, sites_m, places),
        "radio, timing_advance": _advances(log.radio, plan, sites_m, places),
    }
    return tuple(f"{where}: {fault}" for where, fault in found.items() if fault)


def _differences(
    tdoa: pd.DataFrame, sites_m: Mapping[str, tuple[float, float]], places: pd.DataFrame
) -> str:
    """Return what is wrong with differences of distances; "" for nothing."""
    cell_m, reference_m = (_sites(tdoa[name], sites_m) for name in ("cell", "reference"))
    sites_apart_m = np.hypot(*(cell_m - reference_m).T)
    difference_m = tdoa["difference_m"].to_numpy(dtype=np.float64)
    used = np.isfinite(difference_m) & (sites_apart_m >= _NEAR_M)
    if used.sum() < _FEWEST:
        return ""
    rows, difference_m, apart_m = tdoa[used], difference_m[used], sites_apart_m[used]
    at_m = _at(rows["time_s"], places)
    expected_m = np.hypot(*(at_m - cell_m[used]).T) - np.hypot(*(at_m - reference_m[used]).T)
    factor = _factor(expected_m, difference_m)
    for cause, by in _UNITS.items():
        if 1 / _FACTOR <= factor / by <= _FACTOR:
            return f"differences are {factor:.3g} times those of the positions ({cause})"
    if np.isfinite(factor):
        return ""
    sd_m = rows[["sigma_m", "reference_sigma_m"]].fillna(_USUAL_SD_M).to_numpy()
    beyond = float(np.mean(np.abs(difference_m) > apart_m + 3 * np.hypot(*sd_m.T)))
    if beyond > _SHARE:
        got = f"{beyond:.0%} of {len(rows)} are larger than the distance of their two sites"
        return f"{got} (nanoseconds for metres, or sites of another network?)"
    pairs = rows[["cell", "reference"]].drop_duplicates()
    if len(pairs) > 1 and bool((np.abs(difference_m) < _TINY * apart_m).all()):
        most_m = np.abs(difference_m).max()
        got = f"all of {len(rows)} are at most {most_m:.2g}, of sites up to {apart_m.max():.0f} m"
        return f"{got} apart (kilometres or microseconds for metres?)"
    return ""


def _advances(
    radio: pd.DataFrame,
    plan: CellPlan,
    sites_m: Mapping[str, tuple[float, float]],
    places: pd.DataFrame,
) -> str:
    """Return what is wrong with timing advances; "" for nothing."""
    rows = radio[radio["timing_advance"].notna()]
    if len(rows) < _FEWEST:
        return ""
    stated = {cell.id: cell.technology for cell in plan.cells}
    family = rows["cell"].map(stated).astype(object)
    if "technology" in rows:
        family = rows["technology"].where(rows["technology"].notna(), family)
    # A filter takes steps of an unknown technology for those of GSM.
    known = family.notna().to_numpy()
    named = [str(one) for one in family.where(family.notna(), "GSM")]
    steps = rows["timing_advance"].to_numpy(dtype=np.float64)
    step_m = np.array([TIMING_STEP_M.get(name, np.nan) for name in named])
    away_m = np.hypot(*(_at(rows["time_s"], places) - _sites(rows["cell"], sites_m)).T)
    own, in_metres = _factor(away_m, steps * step_m), _factor(away_m, steps)
    if np.isfinite(own) and steps.mean() >= _FEWEST_STEPS and not 0.5 < own < 2:
        for cause, by in _causes(named, known).items():
            if 1 / _FACTOR <= in_metres / by <= _FACTOR:
                return (
                    f"distances of the steps are {own:.3g} times those of the positions ({cause})"
                )
    most = np.array([_OFTEN_GSM if n == "GSM" else _limit(n) for n in named], dtype=np.float64)
    beyond = steps > most
    if np.mean(beyond) <= 0.5:
        return ""
    typical = named[int(np.argmax(beyond))]
    hint = "metres for steps?" if known.all() else "metres for steps, or LTE without a technology?"
    got = f"{np.mean(beyond):.0%} of {len(rows)} are above {most[np.argmax(beyond)]:.0f}"
    return f"{got}, the most of {typical} ({hint})"


def _causes(named: Collection[str], known: Bools) -> dict[str, float]:
    """Return steps by metre that other units and technologies give."""
    causes = {"metres for steps?": 1.0}
    if "LTE" not in named:
        lacking = "" if known.all() else ", without a technology"
        causes[f"steps of LTE{lacking}?"] = 1 / TIMING_STEP_M["LTE"]
    if "GSM" not in named:
        causes["steps of GSM?"] = 1 / TIMING_STEP_M["GSM"]
    return causes


def _limit(family: str) -> float:
    return float(LIMITS.get(family, {}).get("timing_advance", np.inf))


def _sites(cells: pd.Series, sites_m: Mapping[str, tuple[float, float]]) -> Floats:
    """Return east and north of cells, (N, 2); NaN for unknown ones."""
    nowhere = (np.nan, np.nan)
    found = [sites_m.get(cell, nowhere) for cell in cells.tolist()]
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def _at(time_s: pd.Series, places: pd.DataFrame) -> Floats:
    """Return east and north at some times, (N, 2); NaN beyond the places that are known."""
    at_s = time_s.to_numpy(dtype=np.float64)
    if len(places) < 2:
        return np.full((len(at_s), 2), np.nan)
    known_s, first = np.unique(places["time_s"].to_numpy(dtype=np.float64), return_index=True)
    columns = [
        np.interp(at_s, known_s, places[name].to_numpy()[first], np.nan, np.nan)
        for name in ("east_m", "north_m")
    ]
    return np.column_stack(columns)


def _factor(expected: Floats, got: Floats) -> float:
    """Return by what measured values are multiplied; NaN where they follow no factor."""
    known = np.isfinite(expected) & np.isfinite(got)
    x, y = expected[known], got[known]
    if x.size < _FEWEST or not x.any() or not y.any():
        return float("nan")
    alike = float(np.sum(x * y) / np.sqrt(np.sum(x**2) * np.sum(y**2)))
    if abs(alike) < _ALIKE:
        return float("nan")
    return float(np.sum(x * y) / np.sum(x**2))
