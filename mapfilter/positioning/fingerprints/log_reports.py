"""Reports of a log, with the positions that it has."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats, Ints
from mapfilter._words import number_of
from mapfilter.positioning.fingerprints.reports import Reports, make_reports
from mapfilter.survey.floor_values import fillers
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.scans import SCAN_S, advertised, scan_of_rows
from mapfilter.tracks.schema import SERVING

_LARGEST_GAP_S = 30.0
"""Between two true positions farther apart in time than this, none is interpolated."""


def reports_of_log(log: TrackLog, block: int = -1) -> Reports:
    """Return the reports of a log: its scans, with the true position at their mean time.

    See :func:`mapfilter.tracks.scans.scan_of_rows`. Of beacons that advertise several times in a
    scan the mean level counts. Rows without the cell's id, such as neighbours known by carrier and
    BSIC alone, are left out, and levels that fill in for cells that were not received
    (:func:`mapfilter.survey.floor_values.fillers`).
    """
    report = scan_of_rows(log.radio)
    count = int(report.max(initial=-1)) + 1
    time_s = _mean_times(log.radio["time_s"].to_numpy(np.float64), report, count)
    radio, report = _without_repeats(log.radio, report)
    level_dbm = radio["level_dbm"].to_numpy(np.float64)
    filled = fillers(level_dbm)
    named = radio["cell"].notna().to_numpy(np.bool_)
    known = named & ~filled
    notes = list(log.notes)
    if count < log.radio["time_s"].nunique():
        notes.append(f"readings of one scan, less than {SCAN_S:g} s apart, are one report")
    if not named.all():
        notes.append(f"{number_of(int((~named).sum()), 'reading')} left out: cell unknown")
    if filled.any():
        some = number_of(int(filled.sum()), "reading")
        notes.append(
            f"{some} left out: {level_dbm[filled][0]:g} dBm, far below all others (likely: what "
            "stands for a cell that was not received)"
        )
    cell = radio["cell"].to_numpy(object)
    is_serving = known & (radio["role"] == SERVING).to_numpy(np.bool_)
    # Of several serving cells of a report the first counts.
    served, first = np.unique(report[is_serving], return_index=True)
    serving = np.full(count, "", dtype=object)
    serving[served] = cell[is_serving][first]
    advance = np.full(count, np.nan)
    steps = pd.to_numeric(radio["timing_advance"]).to_numpy(np.float64, na_value=np.nan)
    advance[served] = steps[is_serving][first]
    return make_reports(
        log.crs,
        report[known],
        cell[known].astype(str),
        level_dbm[known],
        count=count,
        places=_true_places(log.truth, time_s),
        time_s=time_s,
        block=np.full(count, block),
        serving=serving.astype(str),
        timing_advance=advance,
        censored=radio["censored"].to_numpy(np.int8)[known],
        notes=notes,
    )


def _mean_times(time_s: Floats, report: Ints, count: int) -> Floats:
    """Return the mean time of each report's rows; exactly the time of rows of one time."""
    first_s = time_s[np.searchsorted(report, np.arange(count))]
    later_s = np.bincount(report, time_s - first_s[report], count)
    return np.asarray(first_s + later_s / np.bincount(report, minlength=count))


def _without_repeats(radio: pd.DataFrame, report: Ints) -> tuple[pd.DataFrame, Ints]:
    """Return rows of which those of one beacon in one report are a row with their mean level."""
    beacon = advertised(radio)
    if not beacon.any():
        return radio, report
    keys = pd.DataFrame({"report": report, "cell": radio["cell"].to_numpy()})
    mean_dbm = radio["level_dbm"].groupby([keys["report"], keys["cell"]]).transform("mean")
    kept = ~(beacon & keys.duplicated().to_numpy() & keys["cell"].notna().to_numpy())
    radio = radio.assign(level_dbm=radio["level_dbm"].where(~beacon, mean_dbm))
    return radio[kept], report[kept]


def _true_places(truth: pd.DataFrame, time_s: Floats) -> Floats:
    """Return true positions at times, shape (T, 2); NaN outside the truth and in its gaps."""
    known_s = truth["time_s"].to_numpy(np.float64)
    places = np.full((len(time_s), 2), np.nan)
    if not len(known_s) or not len(time_s):
        return places
    after = np.clip(np.searchsorted(known_s, time_s), 0, len(known_s) - 1)
    before = np.maximum(after - (known_s[after] != time_s), 0)
    inside = (time_s >= known_s[0]) & (time_s <= known_s[-1])
    inside &= known_s[after] - known_s[before] <= _LARGEST_GAP_S
    for i, name in enumerate(("east_m", "north_m")):
        values = np.interp(time_s, known_s, truth[name].to_numpy(np.float64))
        places[:, i] = np.where(inside, values, np.nan)
    return places
