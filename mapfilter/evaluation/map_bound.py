"""Where a radio map will work, before anybody drives: all bounds together, by point and by way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from mapfilter._parallel import Progress
from mapfilter._types import Floats, Floats32
from mapfilter.evaluation.distinctness import Distinctness, distinctness
from mapfilter.evaluation.first_fix import FirstFix, FirstFixOptions, first_fix
from mapfilter.evaluation.position_bound import PositionBound, position_bound
from mapfilter.evaluation.radio_map import ErrorModel, RadioMap

TWIN_ERROR = 0.3
"""Two places count as twins when they are mistaken for each other with at least this chance."""

BANDS = (
    ("plane_bound_m", "m"), ("along_bound_m", "m"), ("cell_bits", "bit"), ("level_bits", "bit"),
    ("cells_to_fix_m", "m"), ("levels_to_fix_m", "m"), ("twin_error", ""),
)  # fmt: skip
"""What the raster holds, in the order of its bands, with units."""


@dataclass(frozen=True, slots=True, eq=False)
class MapBound:
    """What a radio map is good for.

    Parameters
    ----------
    radio : RadioMap
    options : FirstFixOptions
    position : PositionBound
    distinct : Distinctness
    fix : FirstFix
    """

    radio: RadioMap
    options: FirstFixOptions
    position: PositionBound
    distinct: Distinctness
    fix: FirstFix

    def at_points(self) -> dict[str, Floats]:
        """Return the columns of :data:`BANDS`, shape (N,) each.

        What is only known at the starts is taken from the nearest one.
        """
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
        """Return the places that look alike, the worst first: one row for a start at most."""
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


def map_bound(
    radio: RadioMap,
    errors: ErrorModel,
    options: FirstFixOptions,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> MapBound:
    """Return all bounds of a radio map; for what they mean see the modules that make each."""
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
