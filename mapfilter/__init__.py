"""mapfilter finds where a phone or a vehicle is without GNSS.

The data's way::

    cell plan + buildings ── propagation ──▶ RxLev rasters ───┐
    planner exports, drive tests ── rasters, survey ─────────▶┤
                                                              ├─ database.build ─▶ RadioRouteDatabase ─┐
    OSM, vector layers, land use ── roads ──▶ RouteLattice ───┘                                        │
                                                                                                       ├─ positioning ─▶ TrackEstimate ─▶ evaluation ─▶ report
    logs ── tracks ──▶ TrackLog (motion, radio, GNSS, truth) ──────────────────────────────────────────┘

The names below are loaded when they are first used, so that importing mapfilter is quick.
"""  # noqa: E501

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from mapfilter._kernel_cache import keep_kernels

if TYPE_CHECKING:
    from mapfilter.api.bounds import Bound as Bound
    from mapfilter.api.bounds import bound as bound
    from mapfilter.api.estimates import read_estimate as read_estimate
    from mapfilter.api.estimates import write_estimate as write_estimate
    from mapfilter.api.journeys import simulate as simulate
    from mapfilter.api.located import Track as Track
    from mapfilter.api.located import locate as locate
    from mapfilter.api.logs import make_log as make_log
    from mapfilter.api.logs import read_log as read_log
    from mapfilter.api.pictures import save_picture as save_picture
    from mapfilter.api.plans import read_cell_plan as read_cell_plan
    from mapfilter.api.reports import locate_reports as locate_reports
    from mapfilter.api.scored import Score as Score
    from mapfilter.api.scored import score as score
    from mapfilter.api.studies import sweep as sweep
    from mapfilter.api.swept import Sweep as Sweep
    from mapfilter.database.build import build as build
    from mapfilter.database.radioroutes import RadioRouteDatabase as RadioRouteDatabase
    from mapfilter.database.store import open_database as open_database
    from mapfilter.errors import MapfilterError as MapfilterError
    from mapfilter.evaluation.first_fix import FirstFixOptions as FirstFixOptions
    from mapfilter.filters.contract import MotionStep as MotionStep
    from mapfilter.filters.contract import Status as Status
    from mapfilter.lattice import Lattice as Lattice
    from mapfilter.positioning.bayes.options import BayesFilter as BayesFilter
    from mapfilter.positioning.bayes.options import GridFilter as GridFilter
    from mapfilter.positioning.candidate import CandidateFilter as CandidateFilter
    from mapfilter.positioning.epochs import Epoch as Epoch
    from mapfilter.positioning.epochs import GnssFix as GnssFix
    from mapfilter.positioning.epochs import ReportRow as ReportRow
    from mapfilter.positioning.estimate import TrackEstimate as TrackEstimate
    from mapfilter.positioning.filter import Filter as Filter
    from mapfilter.positioning.fingerprints.located import LocatedReports as LocatedReports
    from mapfilter.positioning.fingerprints.reports import Reports as Reports
    from mapfilter.positioning.fingerprints.tables import (
        read_fingerprint_table as read_fingerprint_table,
    )
    from mapfilter.positioning.kalman.filter import KalmanFilter as KalmanFilter
    from mapfilter.positioning.merging import epochs as epochs
    from mapfilter.positioning.step_output import Fix as Fix
    from mapfilter.positioning.step_output import StepOutput as StepOutput
    from mapfilter.radio.cells import Cell as Cell
    from mapfilter.radio.cells import CellPlan as CellPlan
    from mapfilter.rasters.geotiff_writer import write_rasters as write_rasters
    from mapfilter.rasters.opening import open_rasters as open_rasters
    from mapfilter.rasters.raster_set import RxLevRasters as RxLevRasters
    from mapfilter.roads.lattice import RouteLattice as RouteLattice
    from mapfilter.roads.routes import read_routes as read_routes
    from mapfilter.simulation.reports import ReportModel as ReportModel
    from mapfilter.simulation.walking import WalkerModel as WalkerModel
    from mapfilter.tracks.imu_noise import ImuNoise as ImuNoise
    from mapfilter.tracks.log import TrackLog as TrackLog
    from mapfilter.tracks.pdr.options import WalkOptions as WalkOptions
    from mapfilter.tracks.store import write_log as write_log

_NAMES = {
    "api.bounds": "Bound bound",
    "api.estimates": "read_estimate write_estimate",
    "api.journeys": "simulate",
    "api.located": "Track locate",
    "api.logs": "make_log read_log",
    "api.pictures": "save_picture",
    "api.plans": "read_cell_plan",
    "api.reports": "locate_reports",
    "api.scored": "Score score",
    "api.studies": "sweep",
    "api.swept": "Sweep",
    "database.build": "build",
    "database.radioroutes": "RadioRouteDatabase",
    "database.store": "open_database",
    "errors": "MapfilterError",
    "evaluation.first_fix": "FirstFixOptions",
    "filters.contract": "MotionStep Status",
    "lattice": "Lattice",
    "positioning.bayes.options": "BayesFilter GridFilter",
    "positioning.candidate": "CandidateFilter",
    "positioning.epochs": "Epoch GnssFix ReportRow",
    "positioning.estimate": "TrackEstimate",
    "positioning.filter": "Filter",
    "positioning.fingerprints.located": "LocatedReports",
    "positioning.fingerprints.reports": "Reports",
    "positioning.fingerprints.tables": "read_fingerprint_table",
    "positioning.kalman.filter": "KalmanFilter",
    "positioning.merging": "epochs",
    "positioning.step_output": "Fix StepOutput",
    "radio.cells": "Cell CellPlan",
    "rasters.geotiff_writer": "write_rasters",
    "rasters.opening": "open_rasters",
    "rasters.raster_set": "RxLevRasters",
    "roads.lattice": "RouteLattice",
    "roads.routes": "read_routes",
    "simulation.reports": "ReportModel",
    "simulation.walking": "WalkerModel",
    "tracks.imu_noise": "ImuNoise",
    "tracks.log": "TrackLog",
    "tracks.pdr.options": "WalkOptions",
    "tracks.store": "write_log",
}
"""Names by the modules that define them."""

_HOMES = {name: home for home, names in _NAMES.items() for name in names.split()}

__all__ = sorted(_HOMES)
__version__: str


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module(f"{__name__}._io").program_version()
    home = _HOMES.get(name)
    if home is None:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message, name=name, obj=sys.modules[__name__])
    keep_kernels()
    return getattr(import_module(f"{__name__}.{home}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
