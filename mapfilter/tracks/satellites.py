"""Places of a log's satellites by an almanac.

Positions are earth-centred (ECEF, WGS 84): where a satellite was when it sent, in the frame of the
moment of reception, since the earth turns on while a signal is under way.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.gnss.almanacs import Almanac
from mapfilter.gnss.earth_rotation import in_frame_of_reception
from mapfilter.gnss.orbits import gps_time, satellite_positions_m
from mapfilter.tracks.schema import PLACE

_USUAL_M = 2.25e7


def place_satellites(
    rows: pd.DataFrame, almanac: Almanac, start_utc_s: float, where: str = "pseudoranges"
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Give satellites their places by an almanac, where their rows have none.

    Parameters
    ----------
    rows : pandas.DataFrame
        Checked table of pseudoranges.
    almanac : Almanac
        Weeks may be counted modulo 1024. Satellites that are not healthy get no place.
    start_utc_s : float
        UTC seconds at ``time_s`` = 0.
    where : str
        Name of the table in messages.

    Returns
    -------
    (rows, notes) : (pandas.DataFrame, tuple of str)
        Notes on satellites that are not in the almanac, or not healthy.

    Raises
    ------
    InputError
        The start is not known, or the almanac is of another time.

    Examples
    --------
    >>> from mapfilter.gnss.almanacs import nominal_gps
    >>> start_utc_s = 1_700_000_000.0
    >>> week, _ = gps_time(start_utc_s)
    >>> rows = pd.DataFrame({"time_s": [0.0], "satellite": ["G01"], "pseudorange_m": [2.2e7],
    ...     "x_m": [np.nan], "y_m": [np.nan], "z_m": [np.nan]})
    >>> placed, _ = place_satellites(rows, nominal_gps(week), start_utc_s)
    >>> bool(np.isfinite(placed["x_m"]).all())
    True
    """
    unplaced = ~np.isfinite(rows["x_m"].to_numpy(dtype=np.float64))
    if not unplaced.any():
        return rows, ()
    if not np.isfinite(start_utc_s):
        hint = "needed for places of satellites by an almanac"
        raise fail(InputError, f"{where}, start_utc_s", "UTC seconds of the start", "none", hint)
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    week, second = gps_time(start_utc_s + float(time_s[unplaced][0]))
    known = almanac.in_era(week)
    places, notes = rows[list(PLACE)].to_numpy(dtype=np.float64).copy(), []
    names, range_m = rows["satellite"].to_numpy(), rows["pseudorange_m"].to_numpy(np.float64)
    index = {name: i for i, name in enumerate(known.names)}
    for name in sorted({str(value) for value in names[unplaced]}):
        of = np.flatnonzero(unplaced & (names == name))
        if name not in index or not known.healthy[index[name]]:
            why = "not healthy" if name in index else "not in the almanac"
            notes.append(f"{where}: {name} is {why}, {number_of(len(of), 'row')} without a place")
            continue
        since_s = time_s[of] - time_s[unplaced][0]
        one = known.only(np.array([index[name]]))
        places[of] = sent_from_m(one, week, second + since_s, range_m[of])
    return rows.assign(**dict(zip(PLACE, places.T, strict=True))), tuple(notes)


def sent_from_m(almanac: Almanac, week: int, second: Floats, range_m: Floats) -> Floats:
    """Return where one satellite was when it sent, in the frame of the moment of reception.

    Parameters
    ----------
    almanac : Almanac
        Of that satellite alone, its weeks counted on.
    second : (K,) array
        Of the week, at reception; may run over its end.
    range_m : (K,) array
        Gives the travel time of the signal; a usual one where NaN.
    """
    way_s = np.where(np.isfinite(range_m), range_m, _USUAL_M) / LIGHT_MPS
    sent = second - way_s
    places = np.empty((len(sent), 3))
    weeks = np.floor(sent / 604_800.0).astype(np.int64)
    for turn in np.unique(weeks).tolist():
        of = weeks == turn
        tow_s = sent[of] - 604_800.0 * turn
        places[of] = satellite_positions_m(almanac, tow_s, week + turn)[:, 0]
    return in_frame_of_reception(places, LIGHT_MPS * way_s)
