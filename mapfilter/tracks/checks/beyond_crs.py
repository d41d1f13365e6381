"""Positions at which the coordinates of a log's CRS mean nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapfilter._crs_reach import (
    ground_m,
    is_on_the_ground,
    is_used_at,
    likely_mistake,
    project_within,
)
from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import short_crs, unproject, utm_crs
from mapfilter.tracks.readers.recorded.recording import Recording

_CRS = "Web Mercator or another CRS of the world; at that place it is {}"
_OF_PLACES = ("positions", "truth", "places", "true_places")


def without_beyond(
    where: str,
    crs: str,
    lon_deg: Floats,
    lat_deg: Floats,
    beyond: Bools,
    faults: Faults,
    row_numbers: Ints | None = None,
) -> str:
    """Return the note on positions beyond a CRS that are left out, "" without any.

    All of them are a fault: wrong degrees, or a CRS of another region. So are positions at which
    its metres are none on the ground, as those of Web Mercator: steps would not fit them.

    Parameters
    ----------
    where : str
        File or table.
    beyond : (N,) array of bool
        As :func:`mapfilter._crs_reach.project_within` returns it.
    row_numbers : (N,) array of int, optional
        Of the rows of a table; without them positions are counted.
    """
    if not beyond.all():
        within = np.flatnonzero(~beyond)
        # One of a middle latitude, on which scales depend most: a single one may be wrong.
        middle = within[np.argsort(lat_deg[within], kind="stable")[len(within) // 2]]
        _check_ground(where, crs, float(lon_deg[middle]), float(lat_deg[middle]), _CRS, faults)
    if not beyond.any():
        return ""
    row, count = int(np.argmax(beyond)), int(beyond.sum())
    place = f"position {row + 1}" if row_numbers is None else f"row {row_numbers[row]}"
    found = f"{lat_deg[row]:.6g}, {lon_deg[row]:.6g} ({place})"
    if count == beyond.size:
        found += f" and {count - 1} more" if count > 1 else ""
        expected = f"positions that {short_crs(crs)} covers"
        faults.add(where, expected, found, likely_mistake(crs, lon_deg[row], lat_deg[row]))
        return ""
    some = number_of(count, "position")
    return f"{where}: {some} left out: {short_crs(crs)} has no such places; first {found}"


def check_metres(where: str, crs: str, east_m: Floats, north_m: Floats, faults: Faults) -> None:
    """Check that metres of a log are metres on the ground, as in no CRS of the world.

    Places outside of the region of a CRS may be wrong otherwise, and are not judged.
    """
    if not east_m.size:
        return
    middle = np.argsort(north_m, kind="stable")[len(north_m) // 2]
    lon_deg, lat_deg = (float(one) for one in unproject(crs, east_m[middle], north_m[middle]))
    if is_used_at(crs, lon_deg, lat_deg):
        _check_ground(where, crs, lon_deg, lat_deg, f"{_CRS}, or give lat_deg and lon_deg", faults)


def _check_ground(
    where: str, crs: str, lon_deg: float, lat_deg: float, likely: str, faults: Faults
) -> None:
    if is_on_the_ground(crs, lon_deg, lat_deg):
        return
    name, own = short_crs(crs), f"{lat_deg:.6g}, {lon_deg:.6g}"
    expected = f"positions at which metres of {name} are metres on the ground"
    found = f"{own}, where 100 m are {ground_m(crs, lon_deg, lat_deg):.0f} m"
    zone = utm_crs((lon_deg + 180) % 360 - 180, lat_deg)
    faults.add(where, expected, found, likely.format(zone))


def within_crs(
    recordings: Sequence[Recording], crs: str, local: str
) -> tuple[list[Recording], tuple[str, ...]]:
    """Return recordings without positions that a CRS does not cover, and notes on them.

    Parameters
    ----------
    crs : str
        Of the log.
    local : str
        CRS of metres in a frame of their own; "" where they are in that of the log.

    Raises
    ------
    InputError
        It covers none of the positions of a file.
    """
    faults, notes, kept = Faults(), list[str](), list[Recording]()
    for recording in recordings:
        tables = dict(recording.tables)
        for name in _OF_PLACES:
            if name not in tables:
                continue
            rows, source = tables[name], recording.crs or local
            if "lat_deg" in rows:
                lon_deg, lat_deg = rows["lon_deg"].to_numpy(), rows["lat_deg"].to_numpy()
            elif source and source != crs:
                lon_deg, lat_deg = unproject(source, rows["east_m"], rows["north_m"])
            else:
                continue
            beyond = project_within(crs, lon_deg, lat_deg)[2]
            note = without_beyond(recording.name, crs, lon_deg, lat_deg, beyond, faults)
            if note:
                notes.append(note)
                tables[name] = rows[~beyond].reset_index(drop=True)
        kept.append(replace(recording, tables=tables))
    faults.raise_if_any(InputError)
    return kept, tuple(notes)
