"""The track log: what one journey recorded, as tables of events.

Missing values stay missing: nothing is dropped because one of its fields is unknown. Rows out of
order are sorted and exact duplicates dropped, and the log's notes tell of both. Rows of equal time
are processed in the order motion, gnss and pseudoranges, radio and tdoa: first move, then measure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import projected_crs
from mapfilter.gnss.almanac import Almanac
from mapfilter.tracks.clocks import check_clocks, check_start, early_ends
from mapfilter.tracks.satellites import PLACE, place_satellites
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.steps import check_steps
from mapfilter.tracks.tidy import tidy_table


@dataclass(frozen=True, eq=False)
class TrackLog:
    """What one journey recorded; made by :func:`make_log`, which checks everything.

    Parameters
    ----------
    crs : str
        Projected CRS of all positions, as :func:`mapfilter.geodesy.projected_crs` returns it.
    start_utc_s : float
        UTC seconds (Unix time) at which ``time_s`` is zero; NaN where unknown.
    motion : pandas.DataFrame
        time_s, step_m, heading_rad, turn_rad: the interval that *ends* at time_s and begins at the
        previous row. Headings are radians counter-clockwise from grid east in [-π, π); NaN where
        unknown.
    radio : pandas.DataFrame
        time_s, role ("serving" or "neighbour"), cell (str or None), arfcn, bsic (nullable
        integers), level_dbm, censored (-1 below the scale, 0 inside, 1 above), timing_advance
        (nullable): one row for each cell heard.
    gnss : pandas.DataFrame
        time_s, east_m, north_m, var_east_m2, var_north_m2, cov_east_north_m2.
    pseudoranges : pandas.DataFrame
        time_s, satellite ("G07": its constellation's letter and number), pseudorange_m, sigma_m,
        and where the satellite was, earth-centred: x_m, y_m, z_m. One row for each satellite
        received. NaN: not measured, not told, or not known.
    tdoa : pandas.DataFrame
        time_s, cell, reference, difference_m (how much farther the cell is than the reference),
        sigma_m and reference_sigma_m: of each one's time of arrival, as distances.
    truth : pandas.DataFrame
        time_s, east_m, north_m, way_id (nullable integer).
    notes : tuple of str
        What was sorted, dropped and ignored.
    """

    crs: str
    start_utc_s: float
    motion: pd.DataFrame
    radio: pd.DataFrame
    gnss: pd.DataFrame
    pseudoranges: pd.DataFrame
    tdoa: pd.DataFrame
    truth: pd.DataFrame
    notes: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last row of any table; 0 for an empty log."""
        times = np.concatenate([getattr(self, name)["time_s"].to_numpy() for name in TABLES])
        return float(np.ptp(times)) if len(times) else 0.0

    @property
    def truth_length_m(self) -> float:
        """Length of the true path, metres; 0 where the truth is unknown."""
        east, north = self.truth["east_m"].to_numpy(), self.truth["north_m"].to_numpy()
        return float(np.sum(np.hypot(np.diff(east), np.diff(north))))


def make_log(
    crs: Any,
    *,
    motion: pd.DataFrame | None = None,
    radio: pd.DataFrame | None = None,
    gnss: pd.DataFrame | None = None,
    truth: pd.DataFrame | None = None,
    pseudoranges: pd.DataFrame | None = None,
    tdoa: pd.DataFrame | None = None,
    almanac: Almanac | None = None,
    start_utc_s: float = float("nan"),
    notes: Sequence[str] = (),
    names: Mapping[str, str] | None = None,
    row_numbers: Mapping[str, ArrayLike] | None = None,
) -> TrackLog:
    """Check tables and make them a log.

    Parameters
    ----------
    crs : str
        Projected CRS in metres, in any form that pyproj knows.
    motion, radio, gnss, truth, pseudoranges, tdoa : pandas.DataFrame, optional
        With the columns of :class:`TrackLog`; only ``time_s``, ``role`` (radio), ``east_m`` and
        ``north_m`` (gnss, truth), ``satellite`` (pseudoranges), ``cell`` and ``reference`` (tdoa)
        must be there. An absent table is an empty one.
    almanac : Almanac, optional
        Tells where satellites were whose rows do not; the start must then be known.
    start_utc_s : float
        UTC seconds (Unix time) at which ``time_s`` is zero; NaN, the default, where unknown.
    notes : sequence of str
        What is known already of the tables' past.
    names : mapping, optional
        From table to the name (such as a file's) by which messages call it; ``log`` for the whole.
    row_numbers : mapping, optional
        From table to what messages call each of its rows; rows are counted from 1 without.

    Raises
    ------
    InputError
        With every fault: NaN or infinity in times or coordinates, text for numbers, values out of
        their range, columns missing or misspelt, milliseconds for seconds, degrees for metres or
        for radians, steps that are none, raw RXLEV for dBm, a CRS that is not projected, tables
        that do not overlap in time, a start outside the years 1 to 9999, an almanac of another
        time, or one without a start.

    Examples
    --------
    >>> walk = pd.DataFrame({"time_s": [2.0, 1.0, 2.0], "step_m": [1.5, 1.4, 1.5]})
    >>> log = make_log("EPSG:32629", motion=walk)
    >>> log.motion["step_m"].tolist(), log.duration_s
    ([1.4, 1.5], 1.0)
    >>> print(*log.notes, sep="; ")
    motion: 1 exact duplicate rows dropped; motion: out of order in 1 places, sorted by time
    """
    faults, called, numbers = Faults(), names or {}, row_numbers or {}
    whole = called.get("log", "log")
    try:
        crs = projected_crs(crs, f"{whole}, crs")
    except InputError as error:
        faults.found.extend(error.faults)
    given = {
        "motion": motion, "radio": radio, "gnss": gnss, "pseudoranges": pseudoranges,
        "tdoa": tdoa, "truth": truth,
    }  # fmt: skip
    tables: dict[str, pd.DataFrame] = {}
    told = tuple(notes)
    for table in TABLES:
        where = called.get(table, table)
        rows, news = tidy_table(table, given[table], where, faults, numbers.get(table))
        tables[table] = rows
        told += news
    check_start(start_utc_s, tables, faults, whole)
    if not any(fault.where.endswith("time_s") for fault in faults.found):
        check_clocks(tables, called, faults)
        told += check_steps(tables, called.get("motion", "motion"), faults)
        told += early_ends(tables)
    faults.raise_if_any(InputError)
    placeless = int(tables["pseudoranges"][list(PLACE)].isna().any(axis=1).sum())
    if almanac is None and placeless:
        told += (
            f"pseudoranges: {placeless} rows without the place of their satellite, of no use "
            "without an almanac beside the log",
        )
    if almanac is not None:
        where = called.get("pseudoranges", "pseudoranges")
        placed, news = place_satellites(tables["pseudoranges"], almanac, start_utc_s, where)
        tables["pseudoranges"] = placed
        told += news
    return TrackLog(str(crs), float(start_utc_s), **tables, notes=tuple(dict.fromkeys(told)))
