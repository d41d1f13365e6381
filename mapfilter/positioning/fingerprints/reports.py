"""Reports: the transmitters received at one time, and where that was, if it is known.

Reports with positions are the fingerprint database; reports without are what is to be located.
Cells, Wi-Fi access points, BLE beacons and LoRaWAN gateways are all transmitters with an id.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats, Ints, Ints8, Ints32
from mapfilter._words import number_of
from mapfilter.positioning.fingerprints.planned import Planned
from mapfilter.positioning.fingerprints.report_checks import checked_columns, serving_cells


@dataclass(frozen=True, eq=False, repr=False)
class Reports:
    """R reports with N readings in all.

    Parameters
    ----------
    crs : str
        Projected CRS of the positions.
    cell_ids : tuple of str
        Transmitters, each once.
    first : ndarray of int64, shape (R + 1,)
        The readings of report i are those from ``first[i]`` to ``first[i + 1]``.
    cell : ndarray of int32, shape (N,)
        Index into ``cell_ids``; each cell at most once in a report.
    level_dbm : ndarray, shape (N,)
        NaN: received, but the level is missing.
    sd_db : ndarray, shape (N,)
        Standard deviation of the level's error, besides that of a new reading; 0 for measurements.
    censored : ndarray of int8, shape (N,)
        -1: the level is below this; 1: it is above; 0: it is this.
    serving : ndarray of int32, shape (R,)
        Index of the serving cell; -1 without one.
    timing_advance : ndarray, shape (R,)
        Steps, of the serving cell; NaN where not reported.
    time_s : ndarray, shape (R,)
    east_m, north_m : ndarray, shape (R,)
        True position; NaN where unknown.
    block : ndarray of int32, shape (R,)
        Log or session; what is left out together in cross-validation. -1: by place.
    notes : tuple of str
        What was left out, and why.
    predicted : bool
        Whether the levels are those of a map, of all cells; phones report the strongest only.
    planned : Planned or None
        What the plan states of the cells of such a map.
    """

    crs: str
    cell_ids: tuple[str, ...]
    first: Ints
    cell: Ints32
    level_dbm: Floats
    sd_db: Floats
    censored: Ints8
    serving: Ints32
    timing_advance: Floats
    time_s: Floats
    east_m: Floats
    north_m: Floats
    block: Ints32
    notes: tuple[str, ...] = ()
    predicted: bool = False
    planned: Planned | None = None

    def __len__(self) -> int:
        return len(self.first) - 1

    def __repr__(self) -> str:
        placed = int(np.isfinite(self.east_m).sum())
        return (
            f"Reports({len(self)}, {placed} with position; {len(self.cell)} readings of "
            f"{len(self.cell_ids)} transmitters)"
        )

    @property
    def report(self) -> Ints:
        """Report that each reading belongs to, shape (N,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    @property
    def places(self) -> Floats:
        """True positions, shape (R, 2)."""
        return np.column_stack([self.east_m, self.north_m])

    def readings(self, index: int) -> tuple[Ints32, Floats]:
        """Return cells and levels of one report."""
        own = slice(int(self.first[index]), int(self.first[index + 1]))
        return self.cell[own], self.level_dbm[own]

    def some(self, kept: Ints | Bools, *notes: str) -> Reports:
        """Return some of the reports; cells keep their indices."""
        chosen = np.arange(len(self))[kept]
        counts = np.diff(self.first)[chosen]
        first = np.concatenate([[0], np.cumsum(counts)])
        # Readings of the kept reports, in their order.
        own = np.repeat(self.first[chosen] - first[:-1], counts) + np.arange(first[-1])
        return Reports(
            self.crs,
            self.cell_ids,
            first,
            self.cell[own],
            self.level_dbm[own],
            self.sd_db[own],
            self.censored[own],
            self.serving[chosen],
            self.timing_advance[chosen],
            self.time_s[chosen],
            self.east_m[chosen],
            self.north_m[chosen],
            self.block[chosen],
            (*self.notes, *notes),
            self.predicted,
            self.planned,
        )

    def placed(self) -> Reports:
        """Return the reports with a position and a reading, over the cells that they received."""
        kept = np.isfinite(self.east_m) & np.isfinite(self.north_m) & (np.diff(self.first) > 0)
        if kept.all():
            return self.compact()
        count = int((~kept).sum())
        note = f"{number_of(count, 'report')} left out: no position, or nothing received"
        return self.some(kept, note).compact()

    def compact(self) -> Reports:
        """Return the reports over those cells only that were received in one of them."""
        used = np.bincount(self.cell, minlength=len(self.cell_ids)) > 0
        if used.all():
            return self
        return self.named_as([name for name, has in zip(self.cell_ids, used, strict=True) if has])[
            0
        ]

    def named_as(self, cell_ids: Sequence[str]) -> tuple[Reports, Ints]:
        """Return the reports over other cells, and how many readings of each have no such cell.

        Those readings are left out: a transmitter that the database does not have is no evidence
        for any place.
        """
        place_of = {cell_id: i for i, cell_id in enumerate(cell_ids)}
        new = np.array([place_of.get(cell_id, -1) for cell_id in self.cell_ids] + [-1], np.int32)
        cell = new[self.cell]
        known = cell >= 0
        unknown = np.bincount(self.report[~known], minlength=len(self))
        counts = np.diff(self.first) - unknown
        found = Reports(
            self.crs,
            tuple(cell_ids),
            np.concatenate([[0], np.cumsum(counts)]),
            cell[known],
            self.level_dbm[known],
            self.sd_db[known],
            self.censored[known],
            new[self.serving],
            self.timing_advance,
            self.time_s,
            self.east_m,
            self.north_m,
            self.block,
            self.notes,
            self.predicted,
        )
        if self.planned is not None:
            own = {cell_id: i for i, cell_id in enumerate(self.cell_ids)}
            kept = np.array([own[cell_id] for cell_id in cell_ids], dtype=np.int64)
            found = replace(found, planned=self.planned.some(kept))
        return found, unknown


def make_reports(
    crs: str,
    report: ArrayLike,
    cell: Sequence[str] | ArrayLike,
    level_dbm: ArrayLike,
    *,
    count: int,
    places: ArrayLike | None = None,
    time_s: ArrayLike | None = None,
    block: ArrayLike | None = None,
    serving: ArrayLike | None = None,
    timing_advance: ArrayLike | None = None,
    sd_db: ArrayLike | None = None,
    censored: ArrayLike | None = None,
    notes: Sequence[str] = (),
) -> Reports:
    """Make reports of readings in any order.

    Of several readings of one cell in one report the strongest counts.

    Parameters
    ----------
    report : (N,) array of int
        Report of each reading, from 0 to ``count - 1``.
    cell : sequence of N str
        Transmitters; whole numbers are taken as text.
    level_dbm : (N,) array
        NaN where missing.
    count : int
        Number of reports; some may have no reading.
    places : (count, 2) array, optional
        East and north, NaN where unknown.
    time_s, block, timing_advance : (count,) array, optional
    serving : sequence of ``count`` str, optional
        Serving cell of each report, empty or missing where there is none.
    sd_db, censored : (N,) array, optional

    Raises
    ------
    InputError
        With every fault: columns of other lengths, a report that there is not, a reading without a
        transmitter, levels that are none in dBm (70 for -70, 100 for one that was not received), a
        CRS that is not projected.
    ConfigError
        ``count`` is no whole number >= 0.

    Examples
    --------
    >>> made = make_reports("EPSG:32635", [1, 0, 1], ["a", "a", "b"], [-70, -60, -80], count=2)
    >>> made.first.tolist(), made.cell.tolist(), made.level_dbm.tolist()
    ([0, 1, 3], [0, 0, 1], [-60.0, -70.0, -80.0])
    """
    by_report = {
        "places": places,
        "time_s": time_s,
        "block": block,
        "serving": serving,
        "timing_advance": timing_advance,
    }
    more = {"sd_db": sd_db, "censored": censored}
    crs, given = checked_columns(
        crs,
        count,
        {"report": report, "cell": cell, "level_dbm": level_dbm}
        | {name: one for name, one in more.items() if one is not None},
        {name: one for name, one in by_report.items() if one is not None},
    )
    names, which, level = given["cell"], given["report"], given["level_dbm"]
    served = serving_cells(serving) if serving is not None else np.full(count, "")
    cell_ids = np.unique(np.concatenate([names, served[served != ""]]))
    index = np.searchsorted(cell_ids, names).astype(np.int32)
    error = np.zeros(len(which)) if sd_db is None else np.asarray(sd_db, np.float64)
    bound = np.zeros(len(which), np.int8) if censored is None else np.asarray(censored, np.int8)
    order = np.lexsort((-np.where(np.isnan(level), -np.inf, level), index, which))
    which, index, level = which[order], index[order], level[order]
    error, bound = error[order], bound[order]
    again = np.zeros(len(which), np.bool_)
    again[1:] = (which[1:] == which[:-1]) & (index[1:] == index[:-1])
    found = list(notes)
    if again.any():
        found.append(
            f"{number_of(int(again.sum()), 'reading')} left out: a cell twice in one report"
        )
        which, index = which[~again], index[~again]
        level, error, bound = level[~again], error[~again], bound[~again]
    served_index = np.where(served == "", -1, np.searchsorted(cell_ids, served))

    def column(given: ArrayLike | None, otherwise: float) -> Floats:
        return np.full(count, otherwise) if given is None else np.asarray(given, np.float64)

    east_m, north_m = column(None, np.nan), column(None, np.nan)
    if places is not None:
        east_m, north_m = np.asarray(places, np.float64).reshape(count, 2).T.copy()
    return Reports(
        crs,
        tuple(cell_ids.tolist()),
        np.searchsorted(which, np.arange(count + 1)).astype(np.int64),
        index,
        level,
        error,
        bound,
        served_index.astype(np.int32),
        column(timing_advance, np.nan),
        column(time_s, np.nan) if time_s is not None else np.arange(count, dtype=np.float64),
        east_m,
        north_m,
        column(block, -1).astype(np.int32),
        tuple(found),
    )
