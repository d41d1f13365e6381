"""Satellite positions by IS-GPS-200, and GPS time."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._constants import DAY_S, GPS_EPOCH_S
from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.gnss.almanacs import WEEK_S, Almanac

EARTH_GRAVITY_M3_S2 = 3.986005e14
"""μ of IS-GPS-200, as receivers take it."""

EARTH_RATE_RAD_S = 7.2921151467e-5
OLDEST_DAYS = 180.0
"""Farther from its time of applicability an almanac is too inaccurate."""

LEAPS_UTC_S = tuple(
    datetime(year, month, 1, tzinfo=UTC).timestamp()
    for month, years in (
        (1, (1988, 1990, 1991, 1996, 1999, 2006, 2009, 2017)),
        (7, (1981, 1982, 1983, 1985, 1992, 1993, 1994, 1997, 2012, 2015)),
    )
    for year in years
)
"""UTC dates from which on GPS time is ahead by one second more."""


def gps_time(utc_s: float) -> tuple[int, float]:
    """Return GPS week, counted on from 6 January 1980, and second of the week of a UTC time.

    Leap seconds are those announced until 2026; the last was at the end of 2016.

    ``utc_s`` is Unix time; InputError is raised where it is not finite or before GPS.

    Examples
    --------
    >>> gps_time(datetime(2017, 1, 1, tzinfo=UTC).timestamp())
    (1930, 18.0)
    """
    if not (np.isfinite(utc_s) and utc_s >= GPS_EPOCH_S):
        hint = "seconds since another start than 1970" if np.isfinite(utc_s) else ""
        raise fail(InputError, "utc_s", "Unix time from 6 January 1980 on", utc_s, hint)
    elapsed = utc_s - GPS_EPOCH_S + sum(utc_s >= leap for leap in LEAPS_UTC_S)
    week = int(elapsed // WEEK_S)
    return week, elapsed - week * WEEK_S


def satellite_positions_m(
    almanac: Almanac,
    tow_s: ArrayLike,
    week: int | None = None,
    *,
    oldest_days: float = OLDEST_DAYS,
) -> Floats:
    """Return positions of satellites in the frame that turns with the earth (ECEF).

    Parameters
    ----------
    tow_s : float or (K,) array_like
        Seconds of the week.
    week : int, optional
        The week, counted as the almanac counts it; without one each satellite is taken within
        half a week of its time of applicability, as IS-GPS-200 (Table 20-IV) does.
    oldest_days : float
        How far from its time of applicability an almanac may be used.

    Returns
    -------
    (S, 3) or (K, S, 3) array
        Earth-centred x, y and z of S satellites in metres, for one time or for each of K.

    Raises
    ------
    InputError
        Times are not within a week, or the almanac is of another time.
    """
    given = np.asarray(tow_s, dtype=np.float64)
    if not ((given >= 0) & (given <= WEEK_S)).all():
        hint = "Unix time, or seconds counted on over weeks" if np.any(given > WEEK_S) else ""
        raise fail(InputError, "tow_s", "seconds of the week, 0..604800", given, hint)
    since = given[..., None] - almanac.toa_s
    if week is None:
        since = since - WEEK_S * np.round(since / WEEK_S)
    else:
        since = since + WEEK_S * (week - almanac.week)
        off_days = float(np.abs(since).max(initial=0.0)) / DAY_S
        if off_days > oldest_days:
            expected = f"one within {oldest_days:g} days of week {week}"
            hint = "weeks counted modulo 1024: see Almanac.in_era"
            raise fail(InputError, "almanac", expected, f"one {off_days:.0f} days off", hint)
    axis = almanac.sqrt_a**2
    mean = almanac.anomaly_rad + np.sqrt(EARTH_GRAVITY_M3_S2 / axis**3) * since
    eccentric = _kepler(mean, almanac.eccentricity)
    e = almanac.eccentricity
    true = np.arctan2(np.sqrt(1 - e**2) * np.sin(eccentric), np.cos(eccentric) - e)
    latitude = true + almanac.perigee_rad
    radius = axis * (1 - e * np.cos(eccentric))
    along, across = radius * np.cos(latitude), radius * np.sin(latitude)
    node = (
        almanac.node_rad
        + (almanac.node_rate_rad_s - EARTH_RATE_RAD_S) * since
        - EARTH_RATE_RAD_S * almanac.toa_s
    )
    cos_tilt, sin_tilt = np.cos(almanac.inclination_rad), np.sin(almanac.inclination_rad)
    x = along * np.cos(node) - across * cos_tilt * np.sin(node)
    y = along * np.sin(node) + across * cos_tilt * np.cos(node)
    return np.stack([x, y, across * sin_tilt], axis=-1)


def _kepler(mean_rad: Floats, eccentricity: Floats) -> Floats:
    """Solve ``E - e sin E = M`` by Newton's steps; few are needed where e < 0.9."""
    mean = np.remainder(mean_rad + np.pi, 2 * np.pi) - np.pi
    eccentric = mean + 0.85 * eccentricity * np.sign(np.sin(mean))
    for _ in range(50):
        off = eccentric - eccentricity * np.sin(eccentric) - mean
        step = off / (1 - eccentricity * np.cos(eccentric))
        eccentric = eccentric - step
        if np.abs(step).max(initial=0.0) < 1e-14:
            break
    return eccentric
