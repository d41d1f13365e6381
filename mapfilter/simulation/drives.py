"""Drives along straight roads, and what changes on the way: shadowing and the receiver's clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.gnss.noise import correlated_along


@dataclass(frozen=True, eq=False)
class Drive:
    """Ground truth of a drive at K epochs; ``place_m`` has the columns east, north and up."""

    time_s: Floats
    place_m: Floats
    travelled_m: Floats


def ahead_and_left(bearing_deg: float) -> tuple[Floats, Floats]:
    """Return the unit vectors (east, north) ahead of a bearing, clockwise from north, and left.

    Examples
    --------
    >>> [axis.round(9).tolist() for axis in ahead_and_left(90.0)]
    [[1.0, 0.0], [-0.0, 1.0]]
    """
    bearing = np.radians(bearing_deg)
    ahead = np.array([np.sin(bearing), np.cos(bearing)])
    return ahead, np.array([-ahead[1], ahead[0]])


def straight_drive(
    length_m: float, bearing_deg: float, duration_s: float, interval_s: float = 1.0
) -> Drive:
    """Return a drive from the origin at constant speed, on the plane through it.

    Epochs are at one interval, two intervals and so on to the end.

    Raises
    ------
    InputError
        A number is not above 0, or the bearing not finite.

    Examples
    --------
    >>> drive = straight_drive(300.0, 90.0, 30.0, 10.0)
    >>> drive.time_s.tolist(), drive.place_m[:, 0].round(9).tolist()
    ([10.0, 20.0, 30.0], [100.0, 200.0, 300.0])
    """
    faults = Faults()
    times_s = {"duration_s": duration_s, "interval_s": interval_s}
    faults.check_positive("drive, ", "a number", length_m=length_m, **times_s)
    if not np.isfinite(bearing_deg):
        faults.add("drive, bearing_deg", "finite degrees", bearing_deg)
    faults.raise_if_any(InputError)
    steps = int(np.floor(duration_s / interval_s + 1e-9))
    time = np.asarray(interval_s * np.arange(1, steps + 1), dtype=np.float64)
    travelled = np.asarray(length_m / duration_s * time, dtype=np.float64)
    place = np.zeros((steps, 3))
    place[:, :2] = np.outer(travelled, ahead_and_left(bearing_deg)[0])
    return Drive(time, place, travelled)


def shadowing_db(
    drive: Drive, stations: int, sigma_db: float, correlation_m: float, rng: np.random.Generator
) -> Floats:
    """Draw log-normal shadowing of independent stations, shape (K, stations).

    Its standard deviation is ``sigma_db``, its correlation along the way ``exp(-d /
    correlation_m)``.
    """
    return sigma_db * correlated_along(drive.travelled_m, stations, correlation_m, rng)


def clock_walk_m(epochs: int, sigma_m: float, first_m: float, rng: np.random.Generator) -> Floats:
    """Draw a clock's bias, c₀·δt: uniform within ± ``first_m``, then a random walk, shape (K,)."""
    steps = rng.normal(0.0, sigma_m, epochs)
    return np.asarray(rng.uniform(-first_m, first_m) + np.cumsum(steps))
