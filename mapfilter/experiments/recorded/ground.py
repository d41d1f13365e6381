"""Databases of places where there is no street map: corridors of other journeys, open ground."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter.database.build import build, build_roads
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.sources import LayerRoutes
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.corridors import CORRIDOR_HALF_WIDTH_M, Positions, corridors
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.route_points import RouteSource

_RESOLUTION_M = 5.0


def positions_of(table: pd.DataFrame) -> Positions:
    """Return the positions of a log's table ``gnss`` or ``truth``, each once."""
    east, north = (table[name].to_numpy(dtype=np.float64) for name in ("east_m", "north_m"))
    kept = np.ones(len(east), dtype=np.bool_)
    kept[1:] = np.hypot(np.diff(east), np.diff(north)) > 0
    return Positions(east[kept], north[kept])


def lattice_about(
    crs: str, tracks: Sequence[Positions], margin_m: float, resolution_m: float = _RESOLUTION_M
) -> Lattice:
    """Return a lattice over tracks and a margin around them."""
    east = np.concatenate([track.east_m for track in tracks])
    north = np.concatenate([track.north_m for track in tracks])
    bounds = (
        float(east.min() - margin_m),
        float(north.min() - margin_m),
        float(east.max() + margin_m),
        float(north.max() + margin_m),
    )
    return Lattice.covering(crs, bounds, resolution_m)


def corridor_routes(lattice: Lattice, tracks: Sequence[Positions]) -> LayerRoutes:
    """Return the corridors along tracks."""
    found = corridors(lattice.crs, tracks)
    return LayerRoutes(RouteSource.of(found.ways, None, None, CORRIDOR_HALF_WIDTH_M), lattice)


def open_ground(lattice: Lattice) -> RouteLattice:
    """Return a lattice of which every point is a place to be."""
    row, col = (part.ravel().astype(np.int32) for part in np.indices((lattice.rows, lattice.cols)))
    return RouteLattice(
        lattice,
        row,
        col,
        np.zeros(row.size, dtype=np.int64),
        np.zeros(row.size, dtype=np.int16),
        ("square",),
        np.full(row.size, np.inf, dtype=np.float32),
        np.ones(row.size, dtype=np.bool_),
    )


def roads_alone(routes: RouteLattice | LayerRoutes, folder: Path) -> RadioRouteDatabase:
    """Build a database without cells."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    return build_roads(routes, folder)


def predicted(
    plan: CellPlan,
    lattice: Lattice,
    routes: RouteLattice | LayerRoutes,
    folder: Path,
    model: PredictionModel | None = None,
    *,
    floor_dbm: float | None = None,
) -> RadioRouteDatabase:
    """Predict the levels of a plan without buildings, and build a database of them."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    raster = folder.with_suffix(".tif")
    levels = predict(plan, lattice, None, model or PredictionModel())
    write_rasters(raster, lattice, levels, plan.ids)
    return build(open_rasters(raster), plan, routes, folder, floor_dbm=floor_dbm)
