"""mapfilter finds where a phone or a vehicle is without GNSS.

The data's way::

    cell plan + buildings ── radio.predict ──▶ RxLev rasters ─┐
    planner exports ── radio.rasters ────────────────────────▶┤
                                                              ├─ database.build ─▶ RadioRouteDatabase ─┐
    OSM, land-use raster ── roads ──▶ lattice ────────────────┘                                        │
                                                                                                       ├─ positioning ─▶ TrackEstimate ─▶ evaluation ─▶ report
    logs ── tracks ──▶ TrackLog (motion, radio, GNSS, truth) ──────────────────────────────────────────┘

The names below are loaded when they are first used, so that importing mapfilter is quick.
"""  # noqa: E501

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mapfilter.database.build import build as build
    from mapfilter.database.radioroutes import RadioField as RadioField
    from mapfilter.database.radioroutes import RadioRouteDatabase as RadioRouteDatabase
    from mapfilter.database.store import open_database as open_database
    from mapfilter.errors import MapfilterError as MapfilterError
    from mapfilter.evaluation.accuracy import Truth as Truth
    from mapfilter.evaluation.accuracy import accuracy as accuracy
    from mapfilter.evaluation.success import wilson_interval as wilson_interval
    from mapfilter.filters.candidate import CandidateFilter as CandidateFilter
    from mapfilter.filters.candidate import CandidateOptions as CandidateOptions
    from mapfilter.filters.contract import Status as Status
    from mapfilter.geodesy import Lattice as Lattice
    from mapfilter.positioning.candidate import cell_points as cell_points
    from mapfilter.positioning.candidate import (
        position_by_candidates as position_by_candidates,
    )
    from mapfilter.positioning.estimate import Fix as Fix
    from mapfilter.positioning.estimate import TrackEstimate as TrackEstimate
    from mapfilter.radio.cells import CellPlan as CellPlan
    from mapfilter.radio.cells import read_cell_plan as read_cell_plan
    from mapfilter.rasters.raster_set import RxLevRasters as RxLevRasters
    from mapfilter.rasters.raster_set import open_rasters as open_rasters
    from mapfilter.roads.lattice import RouteLattice as RouteLattice
    from mapfilter.tracks.log import TrackLog as TrackLog
    from mapfilter.tracks.log import make_log as make_log
    from mapfilter.tracks.store import read_log as read_log

_HOMES = {
    "CandidateFilter": "filters.candidate",
    "CandidateOptions": "filters.candidate",
    "CellPlan": "radio.cells",
    "Fix": "positioning.estimate",
    "Lattice": "geodesy",
    "MapfilterError": "errors",
    "RadioField": "database.radioroutes",
    "RadioRouteDatabase": "database.radioroutes",
    "RouteLattice": "roads.lattice",
    "RxLevRasters": "rasters.rxlev_rasters",
    "Status": "filters.contract",
    "TrackEstimate": "positioning.estimate",
    "TrackLog": "tracks.log",
    "Truth": "evaluation.accuracy",
    "accuracy": "evaluation.accuracy",
    "build": "database.build",
    "cell_points": "positioning.candidate",
    "make_log": "tracks.log",
    "open_database": "database.store",
    "open_rasters": "rasters.rxlev_rasters",
    "position_by_candidates": "positioning.candidate",
    "read_cell_plan": "radio.cells",
    "read_log": "tracks.store",
    "wilson_interval": "evaluation.success",
}

__all__ = sorted(_HOMES)
__version__ = version("mapfilter")


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{home}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
