"""Expected accuracy of a radio map without measurements: all bounds, by point and by way.

Of two places that differ by levels d, one report with error covariance S decides which it is with
a probability of error of at most half the Bhattacharyya coefficient, exp(-d' S⁻¹ d / 8) (Kailath
1967, "The divergence and Bhattacharyya distance measures in signal selection"). A point's bits are
minus the logarithm of the mean of these over the places of its cell: with b bits, one place in 2^b
is left on average.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

from mapfilter._parallel import Progress
from mapfilter._types import Floats, Floats32
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.evaluation.first_fix import FirstFix, FirstFixOptions, first_fix
from mapfilter.evaluation.position_bound import PositionBound, position_bound
from mapfilter.evaluation.radio_map import (
    MOST_RECEIVED,
    ErrorModel,
    RadioMap,
    distance_squared,
    radio_map,
    received_cells,
)
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import new_geotiff

COMPARED = 500

TWIN_ERROR = 0.3
"""Two places count as twins when they are mistaken for each other with at least this chance."""

BANDS = (
    ("plane_bound_m", "m"),
    ("along_bound_m", "m"),
    ("cell_bits", "bit"),
    ("level_bits", "bit"),
    ("cells_to_fix_m", "m"),
    ("levels_to_fix_m", "m"),
    ("twin_error", ""),
)
"""Bands of the raster in their order, with units."""


@dataclass(frozen=True, slots=True, eq=False)
class Distinctness:
    """Information of one report at each point, shape (N,) each, in the order of the points.

    Parameters
    ----------
    cell_bits : numpy.ndarray
        From the name of the serving cell: log2 of all points over the cell's. Exact.
    level_bits : numpy.ndarray
        From the levels, among the points of that cell. Exact for the error model, save that at most
        500 places of a cell, evenly chosen, stand for all.
    """

    cell_bits: Floats
    level_bits: Floats


def distinctness(radio: RadioMap, errors: ErrorModel) -> Distinctness:
    """Return the information of one report at every point of a radio map."""
    first, point = radio.points_by_cell()
    counts = np.diff(first)
    chosen = [
        point[begin:end][np.linspace(0, end - begin - 1, min(COMPARED, end - begin)).astype(int)]
        for begin, end in pairwise(first)
    ]
    compared = np.concatenate(chosen)
    from_ = np.concatenate([[0], np.cumsum([part.size for part in chosen])])
    levels = radio.level_dbm[radio.row, radio.col]
    mean = _mean_overlap(
        levels,
        radio.server,
        from_,
        levels[compared],
        radio.site,
        radio.layer,
        radio.floor_dbm,
        errors.deviation_db**2,
        errors.site_share,
    )
    cell_bits = np.log2(len(radio) / counts[radio.server])
    return Distinctness(cell_bits, -np.log2(np.maximum(mean, 1.0 / len(radio))))


@njit(cache=True)
def _mean_overlap(  # type: ignore[no-untyped-def]
    levels, server, first, others, site, layer, floor_dbm, variance, share
):
    mean = np.zeros(server.size)
    cells = np.empty(MOST_RECEIVED, dtype=np.int64)
    off_db, part = np.empty(MOST_RECEIVED), np.empty(MOST_RECEIVED)
    scale = -1.0 / (8.0 * variance * (1.0 - share))
    for i in range(server.size):
        received = received_cells(levels[i], floor_dbm, site, layer, share, cells, part)
        begin, end = first[server[i]], first[server[i] + 1]
        total = 0.0
        for other in range(begin, end):
            for j in range(received):
                off_db[j] = levels[i, cells[j]] - others[other, cells[j]]
            total += np.exp(scale * distance_squared(off_db, part, received))
        mean[i] = total / max(end - begin, 1)
    return mean


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapBound:
    """Bounds of a radio map at its points and ways."""

    radio: RadioMap
    options: FirstFixOptions
    position: PositionBound
    distinct: Distinctness
    fix: FirstFix

    def __repr__(self) -> str:
        """Return the numbers of points and starts, and the place, in one line."""
        sizes = f"{self.radio.row.size} points, {self.fix.start.size} starts"
        return f"<MapBound: {sizes}, {self.radio.lattice}>"

    def at_points(self) -> dict[str, Floats]:
        """Return the columns of :data:`BANDS`, shape (N,) each.

        What is only known at the starts is taken from the nearest one.
        """
        from scipy.spatial import cKDTree

        fix, most_m = self.fix, self.options.most_m
        place = np.column_stack([self.radio.row, self.radio.col])
        nearest = cKDTree(place[fix.start]).query(place)[1]
        return {
            "plane_bound_m": _known(self.position.plane_m),
            "along_bound_m": _known(self.position.along_m),
            "cell_bits": self.distinct.cell_bits,
            "level_bits": self.distinct.level_bits,
            "cells_to_fix_m": np.minimum(fix.cells_m, most_m).mean(axis=1)[nearest],
            "levels_to_fix_m": np.minimum(fix.levels_m, most_m).mean(axis=1)[nearest],
            "twin_error": fix.twin_error.mean(axis=1)[nearest],
        }

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each point: way_id, east_m, north_m, and the columns of the bands."""
        radio = self.radio
        east_m, north_m = radio.lattice.east_north(radio.row, radio.col)
        place = {"way_id": radio.way_id, "east_m": east_m, "north_m": north_m}
        return pd.DataFrame(place | self.at_points())

    def by_way(self) -> pd.DataFrame:
        """Return one row for each way: its points' medians, and the means of its starts.

        Metres of journeys that never became clear count as ``most_m``. A way without a start has
        NaN there.
        """
        way, most_m = self.radio.way_id, self.options.most_m
        points = pd.DataFrame(
            {
                "way_id": way,
                "plane_bound_m": self.position.plane_m,
                "along_bound_m": self.position.along_m,
                "cell_bits": self.distinct.cell_bits,
                "level_bits": self.distinct.level_bits,
            }
        )
        table = points.groupby("way_id").median().replace(np.inf, np.nan)
        table.insert(0, "points", points.groupby("way_id").size())
        fix = self.fix
        starts = pd.DataFrame(
            {
                "way_id": way[fix.start],
                "starts": 1,
                "cells_to_fix_m": np.minimum(fix.cells_m, most_m).mean(axis=1),
                "levels_to_fix_m": np.minimum(fix.levels_m, most_m).mean(axis=1),
                "cells_bits_per_m": fix.cells_bits.mean(axis=1) / self.options.path_m,
                "levels_bits_per_m": fix.levels_bits.mean(axis=1) / self.options.path_m,
                "twins": (fix.twin_error >= TWIN_ERROR).mean(axis=1),
                "twin_error": fix.twin_error.mean(axis=1),
            }
        )
        sums = starts.groupby("way_id")["starts"].sum()
        means = starts.drop(columns="starts").groupby("way_id").mean()
        found = table.join(sums).join(means).reset_index()
        return found.assign(starts=found["starts"].fillna(0).astype(np.int64))

    def twins(self) -> pd.DataFrame:
        """Return places with similar levels, the worst first; at most one row for each start."""
        fix, lattice = self.fix, self.radio.lattice
        journey = np.argmax(fix.twin_error, axis=1)
        each = np.arange(fix.start.size)
        error, twin = fix.twin_error[each, journey], fix.twin[each, journey]
        kept = np.flatnonzero((twin >= 0) & (error >= TWIN_ERROR))
        kept = kept[np.argsort(-error[kept], kind="stable")]
        start, twin = fix.start[kept], twin[kept]
        east_m, north_m = lattice.east_north(self.radio.row[start], self.radio.col[start])
        twin_east_m, twin_north_m = lattice.east_north(self.radio.row[twin], self.radio.col[twin])
        return pd.DataFrame(
            {
                "east_m": east_m,
                "north_m": north_m,
                "way_id": self.radio.way_id[start],
                "twin_east_m": twin_east_m,
                "twin_north_m": twin_north_m,
                "twin_way_id": self.radio.way_id[twin],
                "apart_m": np.hypot(twin_east_m - east_m, twin_north_m - north_m),
                "twin_error": error[kept],
            }
        )


def bound(
    database: RadioRouteDatabase,
    *,
    errors: ErrorModel | None = None,
    options: FirstFixOptions | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> MapBound:
    """Bound the positioning accuracy of a radio-route database, before any drive.

    Parameters
    ----------
    errors : ErrorModel, optional
        Assumed errors of the predicted levels: 7 dB, correlated over 50 m.
    options : FirstFixOptions, optional
        Simulated journeys of the ideal filter.
    seed : int
        Of these journeys.
    progress : callable, optional
        Called with starts done and starts in all.

    Raises
    ------
    InputError
        The database has no cells, or is too large for the memory.
    """
    radio = radio_map(database)
    rng = np.random.default_rng(seed)
    return map_bound(radio, errors or ErrorModel(), options or FirstFixOptions(), rng, progress)


def map_bound(
    radio: RadioMap,
    errors: ErrorModel,
    options: FirstFixOptions,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> MapBound:
    """Return all bounds of a radio map, as defined in the modules that compute them."""
    return MapBound(
        radio,
        options,
        position_bound(radio, errors),
        distinctness(radio, errors),
        first_fix(radio, errors, options, rng, progress),
    )


def on_lattice(radio: RadioMap, values: Floats) -> Floats32:
    """Return values of points as a raster, NaN elsewhere."""
    raster = np.full(radio.on_way.shape, np.nan, dtype=np.float32)
    raster[radio.row, radio.col] = values
    return raster


def _known(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, np.nan)


def write_bound(
    rasters: Mapping[str, Floats32], lattice: Lattice, path: Path, attribution: str = ""
) -> None:
    """Write the rasters of :data:`mapfilter.evaluation.map_bound.BANDS`, NaN off the points.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    tags = {"TIFFTAG_COPYRIGHT": attribution} if attribution else {}
    with new_geotiff(path, lattice, BANDS, tags) as target:
        for band, (name, _) in enumerate(BANDS, start=1):
            target.write(rasters[name], band)
