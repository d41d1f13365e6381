"""The scene of TESA's GNSS and GSM fusion: a straight drive past seven base stations.

The paper prints neither where the stations are nor which satellites; what is chosen here is listed
in :data:`ASSUMPTIONS`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.noise import elevation_sigma_m
from mapfilter.gnss.orbits import satellite_positions_m
from mapfilter.gnss.sky import LocalFrame, directions
from mapfilter.simulation.drives import (
    Drive,
    ahead_and_left,
    clock_walk_m,
    shadowing_db,
    straight_drive,
)

START_LON_LAT_DEG, START_HEIGHT_M = (4.86, 43.52), 20.0
LENGTH_M, DURATION_S, BEARING_DEG = 9456.0, 720.0, 200.0
OUTAGE_S = (200.0, 400.0)
HALT_S, HALT_MPS2 = (240.0, 300.0), 1.0
SATELLITES = 5

STATIONS_ALONG_M = (300.0, 9100.0)
STATIONS_LEFT_M = (250.0, -400.0, 300.0, -200.0, 450.0, -300.0, 250.0)
STATION_HEIGHT_M = 30.0
EIRP_DBM = 45.5 + 17.0
WAVELENGTH_M = 0.33
CORRELATION_M = 100.0
BETAS_DB = (0.0, 1.0, 4.0)
BETA_DB = 1.0
"""Shadowing of the headline figures."""

ZENITH_SIGMA_M = 2.0
CLOCK_M, CLOCK_FIRST_M = 0.5, 1000.0
START_HORIZONTAL_M, START_UP_M = 50.0, 10.0

ASSUMPTIONS = (
    "a straight road of 9456 m from 43.52 N 4.86 E, bearing 200°, flat, at constant speed; "
    "scenario 3 (not in the paper) is scenario 2 with a halt: braking at 1 m/s² from 240 s, "
    "standing until 300 s, back to speed at 1 m/s²",
    "base stations at 300 to 9100 m along it in equal steps, +250, -400, +300, -200, +450, -300, "
    "+250 m to its left, 30 m high; omnidirectional, EIRP 62.5 dBm, wavelength 0.33 m, Friis",
    "the five highest satellites of the nominal constellation of GPS at its epoch; deviation of "
    "pseudoranges 2 m / sin(elevation), new at each epoch",
    "clock: random walk of 0.5 m in a second, first bias unknown; estimated as a random walk",
    "shadowing is normal in dB, its standard deviation is β, its correlation exp(-d / 100 m), "
    "independent between stations",
    "start: the first particles are drawn around a start that is itself drawn for each trial, "
    "50 m (east, north) and 10 m (height) around point A",
    "velocity model (headline): white acceleration of 0.5 m/s² to the east and to the north, half "
    "of a comfortable maximum of 1 m/s² (the rule of Bar-Shalom, Li & Kirubarajan 2001, section "
    "6.3.2); height a random walk of 0.5 m; first velocity 0 with the paper's 50 km/h as root mean "
    "square; shadowing a Gauss-Markov state of each station with the paper's correlation distance "
    "at 50 km/h; receiver noise 0.29 dB (a step of 1 dB)",
    "identity model (the paper's): independent normal steps of 25 m to the east and to the north, "
    "0.5 m in height; shadowing taken as white",
    "known-bearing model (comparison only, uses the true bearing of the road): as identity, 25 m "
    "along the road but 5 m across it",
    "filters know β, at least 0.5 dB, the stations and the path-loss model, as the paper supposes; "
    "only the known-bearing model uses bearing or course of the true drive",
    "10 000 particles, drawn anew at every reading; errors are norms in three dimensions; "
    "available is an epoch with less than 100 m of error, over all 720 s",
)


class Scene(NamedTuple):
    """What all trials share: satellites (K, 5, 3), stations (7, 3), epochs without satellites (K,).

    The outage is that of scenarios 2 and 3.
    """

    drive: Drive
    satellites_m: Floats
    range_sigma_m: Floats
    stations_m: Floats
    outage: Bools


def tesa_scene(*, halt: bool = False) -> Scene:
    """Return road, stations and satellites, with a halt in the outage or at constant speed."""
    drive = straight_drive(LENGTH_M, BEARING_DEG, DURATION_S)
    drive = with_halt(drive) if halt else drive
    frame = LocalFrame(*START_LON_LAT_DEG, START_HEIGHT_M)
    almanac = nominal_gps()
    first = frame.to_local(satellite_positions_m(almanac, 0.0))
    highest = np.argsort(-directions(first).elevation_rad, kind="stable")[:SATELLITES]
    seen = frame.to_local(satellite_positions_m(almanac.only(highest), drive.time_s))
    sigma = elevation_sigma_m(
        directions(seen, drive.place_m[:, None]).elevation_rad, ZENITH_SIGMA_M
    )
    ahead, left = ahead_and_left(BEARING_DEG)
    along = np.linspace(*STATIONS_ALONG_M, len(STATIONS_LEFT_M))
    flat = np.outer(along, ahead) + np.outer(STATIONS_LEFT_M, left)
    stations = np.column_stack([flat, np.full(len(flat), STATION_HEIGHT_M)])
    outage = (drive.time_s >= OUTAGE_S[0]) & (drive.time_s < OUTAGE_S[1])
    return Scene(drive, seen, sigma, stations, outage)


def with_halt(drive: Drive) -> Drive:
    """Return a drive at constant speed with a halt: braking, standing, back to speed."""
    speed_mps = LENGTH_M / DURATION_S
    ramp_s = speed_mps / HALT_MPS2
    braking_s, leaving_s = (np.clip(drive.time_s - start, 0.0, ramp_s) for start in HALT_S)
    cruising_s = np.minimum(drive.time_s, HALT_S[0])
    cruising_s = cruising_s + np.maximum(drive.time_s - HALT_S[1] - ramp_s, 0.0)
    travelled = speed_mps * (cruising_s + braking_s)
    travelled += 0.5 * HALT_MPS2 * (leaving_s**2 - braking_s**2)
    place = np.zeros_like(drive.place_m)
    place[:, :2] = np.outer(travelled, ahead_and_left(BEARING_DEG)[0])
    return Drive(drive.time_s, place, travelled)


def loss_at_km_db() -> float:
    """Return Friis' loss over 1 km at the paper's wavelength."""
    return float(20 * np.log10(4 * np.pi * 1000.0 / WAVELENGTH_M))


def draw_readings(scene: Scene, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Draw pseudoranges (K, 5), levels without shadowing (K, 7), and shadowing at 1 dB (K, 7)."""
    epochs, stations = scene.drive.time_s.size, len(scene.stations_m)
    place = scene.drive.place_m[:, None]
    bias = clock_walk_m(epochs, CLOCK_M, CLOCK_FIRST_M, rng)
    noise = rng.standard_normal(scene.range_sigma_m.shape) * scene.range_sigma_m
    ranges = np.linalg.norm(scene.satellites_m - place, axis=2) + bias[:, None] + noise
    distance = np.linalg.norm(scene.stations_m - place, axis=2)
    level = EIRP_DBM - loss_at_km_db() - 20 * np.log10(distance / 1000.0)
    return ranges, level, shadowing_db(scene.drive, stations, 1.0, CORRELATION_M, rng)


def draw_start_m(rng: np.random.Generator) -> Floats:
    """Draw the start that a receiver assumes, around point A: east, north, up, shape (3,)."""
    return rng.normal(0.0, [START_HORIZONTAL_M, START_HORIZONTAL_M, START_UP_M])
