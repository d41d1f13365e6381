"""Delays of satellite signals in the atmosphere, by models that need no measurement."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._constants import DAY_S, LIGHT_MPS
from mapfilter._types import Floats

_LEAST_ELEVATION_RAD = 0.05
_ZENITH_S = 5e-9
_LOCAL_NOON_S = 50_400.0


def troposphere_m(elevation_rad: ArrayLike, altitude_m: float = 0.0) -> Floats:
    """Return the delay in the troposphere, by Saastamoinen and the standard atmosphere.

    Pressure, temperature and humidity (50 %) are those of the altitude; RTCA/DO-229's mapping
    brings the delay from the zenith to the elevation.

    Examples
    --------
    >>> troposphere_m(np.radians([90.0, 10.0])).round(1).tolist()
    [2.4, 13.4]
    """
    altitude = float(np.clip(altitude_m, 0.0, 8000.0))
    pressure_hpa = 1013.25 * (1 - 2.2557e-5 * altitude) ** 5.2568
    kelvin = 288.15 - 6.5e-3 * altitude
    vapour_hpa = 6.108 * 0.5 * np.exp((17.15 * kelvin - 4684.0) / (kelvin - 38.45))
    dry_m = 0.0022768 * pressure_hpa
    wet_m = 0.0022768 * (1255.0 / kelvin + 0.05) * vapour_hpa
    sine = np.sin(np.maximum(np.asarray(elevation_rad, dtype=np.float64), _LEAST_ELEVATION_RAD))
    return np.asarray((dry_m + wet_m) * 1.001 / np.sqrt(0.002001 + sine**2))


def ionosphere_m(
    elevation_rad: ArrayLike,
    azimuth_rad: ArrayLike,
    tow_s: ArrayLike,
    lat_deg: float,
    lon_deg: float,
    alpha: ArrayLike,
    beta: ArrayLike,
) -> Floats:
    """Return the delay on L1 in the ionosphere, by Klobuchar (IS-GPS-200, 20.3.3.5.2.5).

    Parameters
    ----------
    elevation_rad, azimuth_rad : (N,) array_like
        Of the satellites; azimuths clockwise from north.
    tow_s : (N,) array_like
        Seconds of the GPS week.
    lat_deg, lon_deg : float
        Of the receiver.
    alpha, beta : (4,) array_like
        Broadcast coefficients, in seconds and powers of semicircles.

    Examples
    --------
    >>> alpha, beta = [0.47e-8, 0.15e-7, -0.6e-7, -1.2e-7], [8.2e4, 8.2e4, -6.6e4, -5.2e5]
    >>> ionosphere_m([np.pi / 2], [0.0], [50_400.0], 40.0, 0.0, alpha, beta).round(1).tolist()
    [2.4]
    """
    elevation = np.maximum(np.asarray(elevation_rad, dtype=np.float64), 0.0) / np.pi
    angle = 0.0137 / (elevation + 0.11) - 0.022
    lat = np.clip(lat_deg / 180.0 + angle * np.cos(azimuth_rad), -0.416, 0.416)
    lon = lon_deg / 180.0 + angle * np.sin(azimuth_rad) / np.cos(lat * np.pi)
    magnetic = lat + 0.064 * np.cos((lon - 1.617) * np.pi)
    local_s = np.mod(43_200.0 * lon + np.asarray(tow_s, dtype=np.float64), DAY_S)
    powers = magnetic[..., np.newaxis] ** np.arange(4)
    amplitude = np.maximum(powers @ np.asarray(alpha, dtype=np.float64), 0.0)
    period = np.maximum(powers @ np.asarray(beta, dtype=np.float64), 72_000.0)
    phase = 2 * np.pi * (local_s - _LOCAL_NOON_S) / period
    day = np.abs(phase) < 1.57
    seconds = _ZENITH_S + np.where(day, amplitude * (1 - phase**2 / 2 + phase**4 / 24), 0.0)
    slant = 1.0 + 16.0 * (0.53 - elevation) ** 3
    return np.asarray(LIGHT_MPS * slant * seconds)


def directions(
    place_m: ArrayLike, lat_deg: float, lon_deg: float, altitude_m: float
) -> tuple[Floats, Floats]:
    """Return elevations and azimuths (clockwise from north) of earth-centred places, radians."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    north = np.cross(up, east)
    line = np.asarray(place_m, dtype=np.float64) - receiver_m(lat_deg, lon_deg, altitude_m)
    line = line / np.linalg.norm(line, axis=-1, keepdims=True)
    return np.arcsin(np.clip(line @ up, -1.0, 1.0)), np.arctan2(line @ east, line @ north)


def receiver_m(lat_deg: float, lon_deg: float, altitude_m: float) -> Floats:
    """Return an earth-centred place (WGS 84) of latitude, longitude and height.

    Examples
    --------
    >>> receiver_m(0.0, 90.0, 0.0).round(3).tolist()
    [0.0, 6378137.0, 0.0]
    """
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    flat = 6.69437999014e-3
    radius = 6_378_137.0 / np.sqrt(1 - flat * np.sin(lat) ** 2)
    out = (radius + altitude_m) * np.cos(lat)
    return np.array(
        [out * np.cos(lon), out * np.sin(lon), (radius * (1 - flat) + altitude_m) * np.sin(lat)]
    )
