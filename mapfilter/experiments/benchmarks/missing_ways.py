"""Maps that lack some of their ways."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import STRtree

from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Ways


def without_ways(
    routes: RouteLattice, ways: Ways, share: float, half_width_m: float, rng: np.random.Generator
) -> RouteLattice:
    """Return the points that are left when a share of the ways is not known.

    A point of a way that is missing stays where it lies in a square or within the half width of
    another way, of which it then is.

    Parameters
    ----------
    routes : RouteLattice
    ways : Ways
        In the lattice's CRS.
    share : float
        Each way is missing with this probability; parts of one way go together.
    half_width_m : float
    rng : numpy.random.Generator
    """
    ids = np.unique(ways.way_id)
    gone = ids[rng.random(ids.size) < share]
    kept_way = ~np.isin(ways.way_id, gone)
    kept = ~np.isin(routes.way_id, gone) | routes.on_square
    way_id, distance_m = routes.way_id.copy(), routes.distance_to_way_m.copy()
    lost = np.flatnonzero(np.isin(routes.way_id, gone))
    if lost.size and kept_way.any():
        places = shapely.points(*routes.lattice.east_north(routes.row[lost], routes.col[lost]))
        (which, nearest), away_m = STRtree(ways.geometry[kept_way]).query_nearest(
            places, return_distance=True, all_matches=False
        )
        near = away_m <= half_width_m
        kept[lost[which]] |= near
        distance_m[lost[which]] = away_m
        way_id[lost[which]] = np.where(near, ways.way_id[kept_way][nearest], 0)
    return RouteLattice(
        routes.lattice,
        routes.row[kept],
        routes.col[kept],
        way_id[kept],
        routes.way_class[kept],
        routes.class_names,
        distance_m[kept],
        routes.on_square[kept],
    )
