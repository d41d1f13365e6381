"""Pseudoranges of a log from those of recordings: one signal, places, clocks, atmosphere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.gnss.atmosphere import directions, ionosphere_m, receiver_m, troposphere_m
from mapfilter.gnss.broadcast import gps_from_utc_s, place_by_broadcast
from mapfilter.tracks.joining.position_units import continuous_deg
from mapfilter.tracks.readers.recorded.recording import Recording
from mapfilter.tracks.schema import LEAST_PLACE_M, MOST_PLACE_M, PLACE

_COLUMNS = ("time_s", "satellite", "pseudorange_m", "sigma_m", *PLACE)

_FEW = 10
_SAME_CLOCK_M = 3.0


def log_pseudoranges(
    recordings: Sequence[Recording], rows: pd.DataFrame, notes: list[str]
) -> pd.DataFrame:
    """Return recorded pseudoranges as a log has them.

    Of several signals of a satellite the first (L1, E1, B1) is kept. Where ephemerides are among
    the recordings, satellites without a place get theirs, and errors of their clocks, the
    troposphere, the ionosphere (with coefficients) and the offsets between the times of
    constellations are taken off; the latter three where a position is known.

    Parameters
    ----------
    recordings : sequence of Recording
        All of the journey, on one clock.
    rows : pandas.DataFrame
        The table ``satellites`` of all of them, with UTC seconds.
    notes : list of str
        Takes what was done.
    """
    first = rows["signal"].astype(object).fillna("").str.contains("1")
    order = rows.assign(rank=~first.astype(bool)).sort_values(["time_s", "rank"], kind="stable")
    kept = order.drop_duplicates(["time_s", "satellite"]).reset_index(drop=True)
    if len(kept) < len(rows):
        notes.append(f"pseudoranges: {len(rows) - len(kept)} of second signals left out")
    kept = _sane_places(kept, notes)
    orbits = [r.tables["ephemerides"] for r in recordings if "ephemerides" in r.tables]
    missing = kept[list(PLACE)].isna().any(axis=1).to_numpy()
    if not orbits or not missing.any():
        return kept[list(_COLUMNS)]
    kept["satellite"] = kept["satellite"].astype(str)
    placed, more = place_by_broadcast(kept, pd.concat(orbits, ignore_index=True))
    notes.extend(more)
    raw = missing & placed[list(PLACE)].notna().all(axis=1).to_numpy()
    here = _receiver(recordings)
    if not raw.any():
        return placed[list(_COLUMNS)]
    if here is None:
        notes.append("pseudoranges: no position, delays in the atmosphere are not taken off")
        return placed[list(_COLUMNS)]
    range_m = placed["pseudorange_m"].to_numpy(dtype=np.float64).copy()
    range_m[raw] -= _delays_m(placed[raw], here, recordings, notes)
    range_m -= _between_clocks_m(placed.assign(pseudorange_m=range_m), raw, here, notes)
    return placed.assign(pseudorange_m=range_m)[list(_COLUMNS)]


def _sane_places(rows: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Return rows without places at which no satellite can be."""
    place = rows[list(PLACE)].to_numpy(dtype=np.float64)
    away_m = np.linalg.norm(place, axis=1)
    bad = np.isfinite(place).any(axis=1) & ~((away_m >= LEAST_PLACE_M) & (away_m <= MOST_PLACE_M))
    if not bad.any():
        return rows
    some = number_of(
        int(bad.sum()), "place of a satellite is none", "places of satellites are none"
    )
    notes.append(f"pseudoranges: {some}, left out")
    return rows.assign(**{name: np.where(bad, np.nan, rows[name]) for name in PLACE})


def _receiver(recordings: Sequence[Recording]) -> tuple[float, float, float] | None:
    """Return latitude, longitude and altitude of the middle of the journey, if it is known."""
    for name in ("positions", "truth"):
        for recording in recordings:
            if name in recording.tables:
                places = recording.tables[name][["lat_deg", "lon_deg", "altitude_m"]]
                middle = places.assign(lon_deg=continuous_deg(places["lon_deg"])).median()
                altitude = middle["altitude_m"]
                height_m = float(altitude) if np.isfinite(altitude) else 0.0
                return float(middle["lat_deg"]), float(middle["lon_deg"]), height_m
    return None


def _delays_m(
    rows: pd.DataFrame,
    here: tuple[float, float, float],
    recordings: Sequence[Recording],
    notes: list[str],
) -> Floats:
    """Return the delays in the atmosphere; the ionosphere where its coefficients are known."""
    elevation, azimuth = directions(rows[list(PLACE)], *here)
    delay_m = troposphere_m(elevation, here[2])
    tables = [r.tables["ionosphere"] for r in recordings if "ionosphere" in r.tables]
    if not tables:
        notes.append("pseudoranges: troposphere taken off, no coefficients of the ionosphere")
        return delay_m
    notes.append("pseudoranges: troposphere and ionosphere (Klobuchar) taken off")
    known = tables[0].iloc[0]
    alpha, beta = ([float(known[f"{name}{i}"]) for i in range(4)] for name in ("alpha", "beta"))
    tow_s = np.mod(gps_from_utc_s(rows["time_s"].to_numpy()), WEEK_S)
    return delay_m + ionosphere_m(elevation, azimuth, tow_s, here[0], here[1], alpha, beta)


def _between_clocks_m(
    rows: pd.DataFrame, raw: Bools, here: tuple[float, float, float], notes: list[str]
) -> Floats:
    """Return how much each constellation's clock is off that of the most frequent one.

    The median, over the journey, of what distances from its middle leave: a receiver that moves
    by kilometres blurs it, but does not shift it much.
    """
    place = rows[list(PLACE)].to_numpy(dtype=np.float64)
    left_m = rows["pseudorange_m"].to_numpy() - np.linalg.norm(place - receiver_m(*here), axis=1)
    table = pd.DataFrame({"time_s": rows["time_s"], "left_m": left_m})
    table["system"] = rows["satellite"].str[0]
    known = table[raw]
    offsets = np.zeros(len(rows))
    counts = known["system"].value_counts()
    if len(counts) < 2:
        return offsets
    epochs = known.groupby(["time_s", "system"])["left_m"].median().unstack()
    for system in counts.index[1:]:
        difference = (epochs[system] - epochs[counts.index[0]]).dropna()
        if len(difference) < _FEW:
            continue
        offset_m = float(difference.median())
        if abs(offset_m) > _SAME_CLOCK_M:
            of = raw & (table["system"] == system).to_numpy()
            offsets[of] = offset_m
            many = f"{system}: {offset_m:+.0f} m against {counts.index[0]}"
            notes.append(f"pseudoranges: {many}, by the clocks of constellations, taken off")
    return offsets
