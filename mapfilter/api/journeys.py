"""Simulate journeys."""

from __future__ import annotations

from mapfilter._arguments import PATH, Argument, Count, Setting, WholeNumber, check_arguments
from mapfilter.api.python_words import python_words
from mapfilter.options import Positive
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.raster_set import ARRAYS, RxLevRasters
from mapfilter.roads.network import StreetNetwork, street_network
from mapfilter.roads.osm import Profile
from mapfilter.roads.routes import ROADS_EXPECTED, read_roads
from mapfilter.roads.vector import Layer
from mapfilter.roads.ways import Ways
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.simulate import SimulationSettings, simulate_journeys
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.log import TrackLog


@python_words()
def simulate(
    rasters: RxLevRasters,
    plan: CellPlan,
    roads: Layer | Ways,
    *,
    journeys: int = 1,
    draws: int = 1,
    length_m: float = 1940.0,
    imu: ImuNoise | None = None,
    reports: ReportModel | None = None,
    walker: WalkerModel | None = None,
    profile: Profile = "walking",
    seed: int = 0,
) -> dict[str, TrackLog]:
    """Simulate journeys along streets: dead reckoning, radio reports and ground truth.

    Parameters
    ----------
    rasters : RxLevRasters
        The levels that the phone receives. Other rasters than those of the database, or
        the database has no errors.
    plan : CellPlan
        Their cells: sites and carriers, as :func:`mapfilter.read_cell_plan` reads them.
    roads : path, GeoDataFrame or Ways
        OpenStreetMap file or vector layer, as for :func:`mapfilter.read_routes`.
    journeys : int
        Number of different routes.
    draws : int
        Logs of each route, which differ in noise only.
    length_m : float
        Length of each route.
    imu : ImuNoise, optional
        Errors of the inertial unit.
    reports : ReportModel, optional
        What the phone reports: period, hysteresis, fading, neighbours.
    walker : WalkerModel, optional
        Place on the street, and stops.
    profile : {"walking", "driving"}
        Ways that routes may use, and speed. Logs of drives state that a vehicle moved.
    seed : int
        Of routes and noise.

    Returns
    -------
    dict of str to TrackLog
        By name, in the order of the journeys.

    Raises
    ------
    InputError
        Rasters, plan and roads differ in their CRS, or no route is as long as wanted.
    ConfigError
        An argument is none of these, or the seed is none.
    """
    check_arguments(
        "simulate",
        rasters_argument(rasters),
        Argument("plan", plan, CellPlan, "a cell plan of read_cell_plan"),
        roads_argument(roads),
        keywords=[
            Setting("journeys", journeys, Count),
            Setting("draws", draws, Count),
            Setting("length_m", length_m, Positive),
            Argument("imu", imu, ImuNoise | None, "ImuNoise"),
            reports_argument(reports),
            Argument("walker", walker, WalkerModel | None, "WalkerModel"),
            Setting("profile", profile, Profile),
            Setting("seed", seed, WholeNumber),
        ],
    )
    journey = JourneyPlan(length_m=length_m, profile=profile, walker=walker or WalkerModel())
    settings = SimulationSettings(
        journeys=journeys,
        draws=draws,
        journey=journey,
        imu=imu or ImuNoise(),
        reports=reports or ReportModel(),
    )
    network, rasters = network_of(roads, rasters, profile), named_by_plan(rasters, plan)
    return dict(simulate_journeys(network, rasters, plan, settings, seed))


def reports_argument(value: object) -> Argument:
    """Return what a phone reports, to be checked."""
    return Argument("reports", value, ReportModel | None, "ReportModel")


def rasters_argument(value: object) -> Argument:
    """Return rasters, to be checked."""
    return Argument("rasters", value, RxLevRasters, "rasters of open_rasters", ARRAYS)


def roads_argument(value: object) -> Argument:
    """Return a map or its ways, to be checked."""
    return Argument("roads", value, Layer | PATH | Ways, ROADS_EXPECTED)


def network_of(roads: Layer | Ways, rasters: RxLevRasters, profile: Profile) -> StreetNetwork:
    """Return the streets of a map where there are rasters."""
    if not isinstance(roads, Ways):
        roads = read_roads(roads, rasters.lattice, profile=profile).ways
    return street_network(roads)
