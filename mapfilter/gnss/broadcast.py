"""Places and clocks of satellites by broadcast ephemerides (IS-GPS-200, 20.3.3.3 and 20.3.3.4).

GPS, Galileo, QZSS and BeiDou's satellites in inclined orbits; GLONASS broadcasts no elements.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._constants import DAY_S, GPS_EPOCH_S, LIGHT_MPS
from mapfilter._types import Floats, Ints
from mapfilter.gnss.earth_rotation import in_frame_of_reception
from mapfilter.gnss.orbits import EARTH_RATE_RAD_S, LEAPS_UTC_S

_GRAVITY = {"G": 3.986005e14, "J": 3.986005e14, "E": 3.986004418e14, "C": 3.986004418e14}
_EARTH_RATE = {"C": 7.292115e-5}
_RELATIVITY = -4.442807633e-10
_OLDEST_S = 4 * 3600.0
UNPLACED = "without an ephemeris within 4 h"
"""In the note on satellites that stay without a place."""

_GEOSTATIONARY_BEIDOU = {f"C{n:02d}" for n in (*range(1, 6), *range(59, 64))}


def gps_from_utc_s(utc_s: ArrayLike) -> Floats:
    """Turn UTC seconds (Unix time) into seconds since 6 January 1980 of GPS time.

    Examples
    --------
    >>> float(gps_from_utc_s(1_483_228_800.0)) - 1930 * 604_800
    18.0
    """
    utc = np.asarray(utc_s, dtype=np.float64)
    leaps = np.searchsorted(np.sort(np.asarray(LEAPS_UTC_S)), utc, side="right")
    return np.asarray(utc - GPS_EPOCH_S + leaps)


def satellite_states(ephemeris: pd.DataFrame, index: Ints, gps_s: Floats) -> tuple[Floats, Floats]:
    """Return positions and clock errors of satellites.

    Parameters
    ----------
    ephemeris : pandas.DataFrame
        ``satellite``, ``toc_s`` and ``toe_s`` (seconds since 6 January 1980, GPS time), clock
        terms af0, af1, af2 and tgd, and the elements as in RINEX, in radians and metres.
    index : (N,) array of int
        Row of ``ephemeris`` for each time.
    gps_s : (N,) array
        Seconds since 6 January 1980, GPS time, at sending.

    Returns
    -------
    place_m : (N, 3) array
        Earth-centred, in the frame of the moment of sending.
    clock_s : (N,) array
        How much the satellite's clock is ahead, with relativity and group delay (L1).
    """
    of = {name: ephemeris[name].to_numpy()[index] for name in ephemeris.columns}
    system = np.array([str(name)[0] for name in of["satellite"]])
    gravity = np.array([_GRAVITY.get(letter, 3.986005e14) for letter in system])
    rate = np.array([_EARTH_RATE.get(letter, EARTH_RATE_RAD_S) for letter in system])
    since = gps_s - of["toe_s"]
    e, axis = of["eccentricity"], of["sqrt_a"] ** 2
    mean = of["m0"] + (np.sqrt(gravity / axis**3) + of["delta_n"]) * since
    anomaly = mean.copy()
    for _ in range(15):
        anomaly -= (anomaly - e * np.sin(anomaly) - mean) / (1 - e * np.cos(anomaly))
    true = np.arctan2(np.sqrt(1 - e**2) * np.sin(anomaly), np.cos(anomaly) - e)
    latitude = true + of["omega"]
    sin2, cos2 = np.sin(2 * latitude), np.cos(2 * latitude)
    argument = latitude + of["cus"] * sin2 + of["cuc"] * cos2
    radius = axis * (1 - e * np.cos(anomaly)) + of["crs"] * sin2 + of["crc"] * cos2
    tilt = of["i0"] + of["cis"] * sin2 + of["cic"] * cos2 + of["idot"] * since
    along, across = radius * np.cos(argument), radius * np.sin(argument)
    week_s = np.mod(of["toe_s"] - np.where(system == "C", 14.0, 0.0), 604_800.0)
    node = of["omega0"] + (of["omega_dot"] - rate) * since - rate * week_s
    place = np.stack(
        [
            along * np.cos(node) - across * np.cos(tilt) * np.sin(node),
            along * np.sin(node) + across * np.cos(tilt) * np.cos(node),
            across * np.sin(tilt),
        ],
        axis=1,
    )
    after = gps_s - of["toc_s"]
    clock = of["af0"] + of["af1"] * after + of["af2"] * after**2 - of["tgd"]
    return place, clock + _RELATIVITY * e * of["sqrt_a"] * np.sin(anomaly)


def place_by_broadcast(
    rows: pd.DataFrame, ephemerides: pd.DataFrame
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Give satellites their places, and take their clocks' errors out of the pseudoranges.

    Parameters
    ----------
    rows : pandas.DataFrame
        ``time_s`` (UTC seconds by the receiver's clock), ``satellite``, ``pseudorange_m``, and
        ``x_m``, ``y_m``, ``z_m``, which are filled in where they are missing: earth-centred, in
        the frame of the moment of reception.
    ephemerides : pandas.DataFrame
        As for :func:`satellite_states`, with ``health``.

    Returns
    -------
    rows : pandas.DataFrame
    notes : tuple of str
        Satellites without an ephemeris of the last four hours.
    """
    rows = rows.reset_index(drop=True)
    missing = rows[["x_m", "y_m", "z_m"]].isna().any(axis=1).to_numpy()
    received = gps_from_utc_s(rows["time_s"].to_numpy())
    sent = received - rows["pseudorange_m"].to_numpy() / LIGHT_MPS
    sane = ephemerides[
        (ephemerides["health"].fillna(0) == 0)
        & ~ephemerides["satellite"].isin(_GEOSTATIONARY_BEIDOU)
        & ephemerides["eccentricity"].between(0, 0.1)
        & ephemerides["sqrt_a"].between(4500, 7000)
    ].reset_index(drop=True)
    nearest = np.full(len(rows), -1)
    for name, elements in sane.groupby("satellite"):
        of = np.flatnonzero(missing & (rows["satellite"] == name).to_numpy())
        if of.size:
            away = np.abs(sent[of, None] - elements["toe_s"].to_numpy()[None, :])
            best = np.argmin(away, axis=1)
            near = away[np.arange(len(of)), best] <= _OLDEST_S
            nearest[of[near]] = elements.index.to_numpy()[best[near]]
    found = np.flatnonzero(nearest >= 0)
    notes = []
    if without := int((missing & (nearest < 0)).sum()):
        lost = sorted(rows["satellite"][missing & (nearest < 0)].unique())
        notes.append(
            f"pseudoranges: {without} {UNPLACED} ({', '.join(lost[:12])}{_days(rows, sane)})"
        )
    if not found.size:
        return rows, tuple(notes)
    _, clock = satellite_states(sane, nearest[found], sent[found])
    place, clock = satellite_states(sane, nearest[found], sent[found] - clock)
    range_m = rows["pseudorange_m"].to_numpy().copy()
    range_m[found] += LIGHT_MPS * clock
    placed = rows[["x_m", "y_m", "z_m"]].to_numpy(dtype=np.float64).copy()
    placed[found] = in_frame_of_reception(place, range_m[found])
    notes.append(f"pseudoranges: {len(found)} placed by broadcast ephemerides")
    columns = dict(zip(("x_m", "y_m", "z_m"), placed.T, strict=True))
    return rows.assign(pseudorange_m=range_m, **columns), tuple(notes)


def _days(rows: pd.DataFrame, ephemerides: pd.DataFrame) -> str:
    """Return the days of ephemerides and ranges where they lie more than a day apart, else ""."""
    if not len(ephemerides) or not len(rows):
        return ""
    middles = float(ephemerides["toe_s"].median()), float(gps_from_utc_s(rows["time_s"].median()))
    if abs(middles[0] - middles[1]) <= DAY_S:
        return ""
    of, measured = (
        pd.Timestamp(GPS_EPOCH_S + seconds, unit="s").date().isoformat() for seconds in middles
    )
    return f"; the ephemerides are of {of}, the pseudoranges of {measured}"
