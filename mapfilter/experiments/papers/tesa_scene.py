"""The scene of TESA's GNSS and GSM fusion: a straight drive past seven base stations.

The paper prints neither where the stations are nor which satellites; what is chosen here is listed
in :data:`ASSUMPTIONS`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapfilter.filters.trials import CompiledMeasurement
from mapfilter.gnss.constellations import nominal_gps
from mapfilter.gnss.noise import elevation_sigma_m
from mapfilter.gnss.orbits import satellite_positions_m
from mapfilter.gnss.sky import LocalFrame, directions
from mapfilter.models.gaussian import stack
from mapfilter.models.motion import LinearMotion, constant_velocity, random_walk, together
from mapfilter.models.pseudorange import pseudoranges
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import POSITION_CLOCK_3D, StateLayout
from mapfilter.positioning.fusion import compiled
from mapfilter.simulation.drives import (
    Drive,
    ahead_and_left,
    clock_walk_m,
    shadowing_db,
    straight_drive,
)

Floats = NDArray[np.float64]
Motion = Literal["identity", "isotropic", "velocity"]

START_LON_LAT_DEG, START_HEIGHT_M = (4.86, 43.52), 20.0
LENGTH_M, DURATION_S, BEARING_DEG = 9456.0, 720.0, 200.0
OUTAGE_S = (200.0, 400.0)
SATELLITES = 5

STATIONS_ALONG_M = (300.0, 9100.0)
STATIONS_LEFT_M = (250.0, -400.0, 300.0, -200.0, 450.0, -300.0, 250.0)
STATION_HEIGHT_M = 30.0
EIRP_DBM = 45.5 + 17.0
WAVELENGTH_M = 0.33
CORRELATION_M = 100.0
BETAS_DB = (0.0, 1.0, 4.0)
BETA_DB = 1.0
"""That of the figures that are told first."""

ZENITH_SIGMA_M = 2.0
CLOCK_M, CLOCK_FIRST_M = 0.5, 1000.0
LEAST_SIGMA_DB = 0.5
ALONG_M, ACROSS_M, UP_M = 25.0, 5.0, 0.5
ACCELERATION_MPS2, CLIMB_MPS2 = 0.1, 0.01
FIRST_HORIZONTAL_M, FIRST_UP_M, FIRST_SPEED_MPS = 50.0, 10.0, 15.0
FIRST_CLOCK_M = 3e5

IDENTITY: Motion = "identity"
VELOCITY_MODEL: Motion = "velocity"

VELOCITY = StateLayout(7, 0, 2, 4, 6)
"""East, north and up, each followed by its rate; clock bias."""

ASSUMPTIONS = (
    "a straight road of 9456 m from 43.52 N 4.86 E, bearing 200°, flat, at constant speed",
    "base stations at 300 to 9100 m along it in equal steps, +250, -400, +300, -200, +450, -300, "
    "+250 m to its left, 30 m high; omnidirectional, EIRP 62.5 dBm, wavelength 0.33 m, Friis",
    "the five highest satellites of the nominal constellation of GPS at its epoch; deviation of "
    "pseudoranges 2 m / sin(elevation), new at each epoch",
    "clock: random walk of 0.5 m in a second, first bias unknown; estimated as a random walk",
    "shadowing is normal in dB, its standard deviation is β, its correlation exp(-d / 100 m), "
    "independent between stations",
    "identity model: normal steps of 25 m along the road, 5 m across it, 0.5 m up; isotropic: 25 m "
    "to all sides",
    "velocity model: acceleration 0.1 m/s² to all sides; since it remembers for longer than "
    "shadowing lasts, it takes levels as √((1+ρ)/(1-ρ)) times as noisy, ρ their correlation over "
    "a step",
    "filters take β as known, at least 0.5 dB; they start within 50 m, 10 m in height",
    "10 000 particles, drawn anew at every reading; errors are norms in three dimensions; "
    "available is an epoch with less than 100 m of error, over all 720 s",
)


@dataclass(frozen=True, eq=False)
class Scene:
    """What all trials share.

    Parameters
    ----------
    drive : Drive
    satellites_m : (K, 5, 3) array
    range_sigma_m : (K, 5) array
    stations_m : (7, 3) array
    outage : (K,) array of bool
        Epochs without satellites in scenario 2.
    """

    drive: Drive
    satellites_m: Floats
    range_sigma_m: Floats
    stations_m: Floats
    outage: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Assumed:
    """What a filter takes for true.

    Parameters
    ----------
    layout : StateLayout
    motion : LinearMotion
    first_mean : (n,) array
    first_covariance : (n, n) array
    sampled : tuple of int
        Of which it has particles.
    """

    layout: StateLayout
    motion: LinearMotion
    first_mean: Floats
    first_covariance: Floats
    sampled: tuple[int, ...]


def tesa_scene() -> Scene:
    """Return road, stations and satellites."""
    drive = straight_drive(LENGTH_M, BEARING_DEG, DURATION_S)
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


def assumed(motion: Motion) -> Assumed:
    """Return a filter's state, motion and start."""
    flat, up, clock = FIRST_HORIZONTAL_M**2, FIRST_UP_M**2, FIRST_CLOCK_M**2
    if motion == "velocity":
        moving = together([
            constant_velocity(1.0, [ACCELERATION_MPS2, ACCELERATION_MPS2, CLIMB_MPS2], 3),
            random_walk(1.0, CLOCK_M, dimensions=1),
        ])  # fmt: skip
        speed = FIRST_SPEED_MPS**2
        first = np.diag([flat, speed, flat, speed, up, CLIMB_MPS2**2, clock])
        return Assumed(VELOCITY, moving, np.zeros(7), first, (0, 2, 4))
    ahead, left = ahead_and_left(BEARING_DEG)
    across = ACROSS_M if motion == "identity" else ALONG_M
    noise = np.diag([0.0, 0.0, UP_M**2, CLOCK_M**2])
    noise[:2, :2] = ALONG_M**2 * np.outer(ahead, ahead) + across**2 * np.outer(left, left)
    first = np.diag([flat, flat, up, clock])
    return Assumed(POSITION_CLOCK_3D, LinearMotion(np.eye(4), noise), np.zeros(4), first, (0, 1, 2))


def level_sigma_db(motion: Motion, beta_db: float) -> float:
    """Return the deviation of levels that a filter takes for true."""
    sigma = max(beta_db, LEAST_SIGMA_DB)
    if motion != "velocity":
        return sigma
    rho = np.exp(-LENGTH_M / DURATION_S / CORRELATION_M)
    return float(sigma * np.sqrt((1 + rho) / (1 - rho)))


def measurements(
    scene: Scene, motion: Motion, beta_db: float | None
) -> tuple[CompiledMeasurement, ...]:
    """Return what is measured at each epoch: pseudoranges and, with β, levels."""
    layout = assumed(motion).layout
    heard = [] if beta_db is None else [
        levels(
            layout, scene.stations_m, level_sigma_db(motion, beta_db),
            loss_at_km_db=loss_at_km_db(), exponent=2.0, eirp_dbm=EIRP_DBM,
        )
    ]  # fmt: skip
    return tuple(
        compiled(stack([pseudoranges(layout, place, sigma), *heard]))
        for place, sigma in zip(scene.satellites_m, scene.range_sigma_m, strict=True)
    )
