"""The scene of DLR's hybrid positioning: a street canyon, satellites, and LTE base stations.

The paper's ray-traced city is not published. Here houses block satellites and stations by geometry
alone, and echoes and detours are drawn; :data:`ASSUMPTIONS` lists all that is chosen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from mapfilter._types import Bools, Floats
from mapfilter.gnss.almanacs import joined, nominal_galileo, nominal_gps
from mapfilter.gnss.noise import elevation_sigma_m, multipath_bias_m
from mapfilter.gnss.orbits import satellite_positions_m
from mapfilter.gnss.sky import LocalFrame, directions
from mapfilter.gnss.skyline import Skyline
from mapfilter.lattice import Lattice
from mapfilter.simulation.drives import clock_walk_m
from mapfilter.simulation.lte_network import (
    ArrivalModel,
    LteRadio,
    arrival_errors_m,
    detour_m,
    hexagonal_sites,
    sector_levels_dbm,
    site_sinr_db,
    sites_along,
    turned,
)
from mapfilter.simulation.pedestrians import GasGround, gas_walk
from mapfilter.simulation.synthetic_city import manhattan

Where = Literal["edge", "near"]

EDGE: Where = "edge"
NEAR: Where = "near"

STEPS = 290
CENTRE_LON_LAT_DEG = (11.58, 48.14)
BLOCK_M, STREET_M, ROOF_M = 80.0, (22.0, 25.0), 26.0
WALKED_M = (170.0, 165.0)
"""Half of the part where pedestrians walk, east and north; one more block stands around it."""
CELL_M, AREA_CELLS = 2.5, (212, 220)
HEIGHT_M = 1.5
SPEED_MPS = (0.8, 1.6)
DAY_S = 86_164.0
MASK_DEG = 5.0

ZENITH_SIGMA_M = 1.2
ECHO_M = 3.0
CLOCK_M, CLOCK_FIRST_M = 2.0, 1000.0

SPACING_M, RINGS = 1500.0, 2
TURN_DEG = 17.0
NEAR_M = 200.0
BORESIGHTS_DEG = (30.0, 150.0, 270.0)
SHADOW_DB, SHADOW_M = 6.0, 50.0
DETOUR_M, ALONG_M = 15.0, 5.0
SHARED = 0.5
"""Correlation of shadowing, and of detours, between any two sites."""
RADIO = LteRadio()
ARRIVAL = ArrivalModel()

THRESHOLD_DB = -17.0
"""SINR above which the paper uses stations."""

ASSUMPTIONS = (
    "geometry only: the paper's ray-traced Munich is not published; satellites and stations are "
    "seen or not by rays past the houses, echoes and detours are drawn",
    "canyon: blocks of 80 m, streets 22 m (east-west) and 25 m wide, houses of 26 m; pedestrians "
    "walk in the 340 x 330 m in its middle, 0.8 to 1.6 m/s, 1.5 m high, up the gradient of a gas "
    "from one random target after another; 290 steps of 1 s",
    "nominal GPS 24 and Galileo 27 over 48.14 N 11.58 E, above 5°, at a random time of day, still "
    "during a track; only satellites in line of sight are measured",
    "pseudoranges: deviation 1.2 m / sin(elevation), new at each epoch; in the canyon echoes of "
    "3 m on the average, exponential, correlated over 10 m of the way; one clock for both systems",
    "clock: random walk of 2 m in a second, with which the filters reckon; as in the paper, no "
    "drift is estimated",
    "network: sites 1500 m apart, 19 of them, 30 m high, three sectors of 70° and 43 dBm + 14 dBi, "
    "2 GHz, all sending; turned by 17° against the streets; losses of 3GPP TR 38.901 UMa with or "
    "without line of sight past the canyon's houses, shadowing of 6 dB over 50 m, correlated by "
    "half between sites",
    "edge: the canyon's middle is where three cells meet, 866 m from their sites; near: 200 m from "
    "a site",
    "times of arrival: of each site's best sector; Cramér-Rao bound of 62 carriers of 15 kHz over "
    "40 symbols (the synchronisation channels of 100 ms) at the SINR, with 3 m at the least; a "
    "wrong peak anywhere within 3 km as probable as noise makes it at the SINR, which is often "
    "below -25 dB",
    "detours without line of sight: 15 m on the average, exponential, correlated over 5 m of the "
    "way and by half between stations",
    "filters know the SINR and the deviations, not the means: 3 m for echoes, 15 m for detours; "
    "they take all noise for normal and new at each epoch",
    "mobility: eq. 21 with a diagonal Q of 0.3 m and 0.3 m/s a second in all three directions; "
    "'discretised': white acceleration of 0.3 m/s in a second",
    "filters start within 10 m of the truth, 2 m in height; time differences alone are solved in "
    "two dimensions at the known height",
    "PF: 10 000 particles of the position, drawn anew at every reading; velocity and clock are "
    "Gaussian given a particle's path",
    "errors are those of east and north; static fixes are weighted Gauss-Newton for position and "
    "clock, none is refused for its geometry; 'all' compares on epochs with a static fix, "
    "'every_epoch' counts epochs without one as failures",
    "critical: fewer than four satellites of both systems in line of sight ('gps_critical': of "
    "GPS)",
)


class Scene(NamedTuple):
    """What all tracks share: houses, the ground where pedestrians walk, and stations (S, 3).

    Stations are in the canyon's frame, by where it lies in the network.
    """

    houses: NDArray[np.object_]
    skyline: Skyline
    ground: GasGround
    stations_m: dict[Where, Floats]


@dataclass(frozen=True, eq=False)
class Track:
    """A walk, (K, 3), the sky over it, and how base stations are received on the way.

    Satellites, (S, 3), are those above the mask; they do not move during a track. Those that are
    not of GPS are of Galileo; ``sigma_m``, (S,), is the deviation of pseudoranges in the open, and
    ``seen``, (K, S), whether no house is in between. By where the canyon lies, (K, B), there are
    the line of sight to stations and the SINR of the best sector.
    """

    place_m: Floats
    travelled_m: Floats
    satellites_m: Floats
    gps: Bools
    sigma_m: Floats
    seen: Bools
    stations_seen: dict[Where, Bools]
    sinr_db: dict[Where, Floats]


class Readings(NamedTuple):
    """One draw of all measurements of a track.

    Pseudoranges (K, S) in the canyon, NaN behind houses; the same without houses and echoes; times
    of arrival as distances (K, B), by where the canyon lies.
    """

    ranges_m: Floats
    open_m: Floats
    times_m: dict[Where, Floats]


def dlr_scene() -> Scene:
    """Return canyon and network."""
    rows, cols = AREA_CELLS
    west, north = -cols * CELL_M / 2, rows * CELL_M / 2
    lattice = Lattice("EPSG:32632", west, north, CELL_M, rows, cols)
    city = manhattan(lattice, block_m=BLOCK_M, street_m=STREET_M, height_m=ROOF_M)
    houses = city.buildings.footprints
    row, col = np.mgrid[:rows, :cols]
    e, n = lattice.east_north(row, col)
    free = ~shapely.contains_xy(shapely.union_all(houses), e, n)
    free &= (np.abs(e) < WALKED_M[0]) & (np.abs(n) < WALKED_M[1])
    grid = hexagonal_sites(SPACING_M, RINGS)
    corner = SPACING_M / np.sqrt(3) * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    beside = NEAR_M * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    heights = np.full((len(grid), 1), RADIO.height_m)
    stations: dict[Where, Floats] = {
        where: np.hstack([turned(grid - centre, TURN_DEG), heights])
        for where, centre in ((EDGE, corner), (NEAR, beside))
    }
    skyline = Skyline(list(houses), np.full(len(houses), ROOF_M))
    return Scene(houses, skyline, GasGround(lattice, free), stations)


def draw_track(scene: Scene, rng: np.random.Generator) -> Track:
    """Draw a pedestrian's walk, the time of day, and the shadowing of base stations."""
    flat = gas_walk(scene.ground, STEPS, rng.uniform(*SPEED_MPS), rng)
    place = np.column_stack([flat, np.full(STEPS, HEIGHT_M)])
    strides = np.hypot(*np.diff(flat, axis=0).T)
    travelled = np.concatenate([[0.0], np.cumsum(strides)])
    satellites, gps = sky(rng.uniform(0.0, DAY_S))
    toward = directions(satellites)
    stations_seen: dict[Where, Bools] = {}
    sinr: dict[Where, Floats] = {}
    for where, stations in scene.stations_m.items():
        # Stations stand above all roofs: what a ray meets behind them is lower.
        own = directions(stations, place[:, None])
        stations_seen[where] = scene.skyline.seen(place, own)
        shadow = SHADOW_DB * sites_along(travelled, len(stations), SHADOW_M, SHARED, rng)
        sectors = stations[:, :2], np.array(BORESIGHTS_DEG) + TURN_DEG
        levels = sector_levels_dbm(RADIO, *sectors, flat, stations_seen[where], shadow)
        sinr[where] = site_sinr_db(levels, RADIO.noise_dbm)
    sigma = elevation_sigma_m(toward.elevation_rad, ZENITH_SIGMA_M)
    seen = scene.skyline.seen(place, toward)
    return Track(place, travelled, satellites, gps, sigma, seen, stations_seen, sinr)


def sky(tow_s: float) -> tuple[Floats, Bools]:
    """Return the satellites above the mask, (S, 3), and which of them are of GPS."""
    almanac = joined(nominal_gps(), nominal_galileo())
    frame = LocalFrame(*CENTRE_LON_LAT_DEG, 0.0)
    found = frame.to_local(satellite_positions_m(almanac, tow_s))
    high = directions(found).above(MASK_DEG)
    gps = np.array([name.startswith("G") for name in almanac.names])
    return found[high], gps[high]


def draw_readings(scene: Scene, track: Track, rng: np.random.Generator) -> Readings:
    """Draw clock, noise, echoes, detours and wrong peaks of a track."""
    shape = track.seen.shape
    away = np.linalg.norm(track.satellites_m - track.place_m[:, None], axis=2)
    bias = clock_walk_m(shape[0], CLOCK_M, CLOCK_FIRST_M, rng)[:, None]
    free = away + bias + track.sigma_m * rng.standard_normal(shape)
    echo = multipath_bias_m(track.travelled_m, shape[1], rng, mean_m=ECHO_M)
    times: dict[Where, Floats] = {}
    for where, stations in scene.stations_m.items():
        distance = np.linalg.norm(stations - track.place_m[:, None], axis=2)
        hidden = ~track.stations_seen[where]
        law = {"mean_m": DETOUR_M, "correlation_m": ALONG_M, "shared": SHARED}
        detour = detour_m(track.travelled_m, hidden, rng, **law)
        times[where] = distance + detour + arrival_errors_m(ARRIVAL, track.sinr_db[where], rng)
    return Readings(np.where(track.seen, free + echo, np.nan), free, times)
