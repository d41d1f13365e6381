"""Logs in a local frame: without positions they fit any database."""

from __future__ import annotations

from dataclasses import replace

from pyproj import CRS

from mapfilter.geodesy import short_crs
from mapfilter.tracks.log import TrackLog

LOCAL_FRAME = "a local frame"
LOCAL_FRAME_HINT = "convert it with --crs EPSG:CODE, and --origin LAT,LON of its own metres"


def is_local_frame(crs: str) -> bool:
    """Return whether a CRS is that of a log in metres of its own: nameless, and at 0, 0 (degrees).

    Examples
    --------
    >>> is_local_frame("+proj=tmerc +lat_0=0 +lon_0=0 +type=crs")
    True
    >>> is_local_frame("EPSG:32635"), is_local_frame("+proj=utm +zone=35 +datum=WGS84")
    (False, False)
    """
    if not (short_crs(crs) == "unknown" or crs.startswith("+proj")):
        return False
    operation = CRS.from_user_input(crs).coordinate_operation
    names = ("Latitude of natural origin", "Longitude of natural origin")
    params = [] if operation is None else operation.params
    origin = [one.value for one in params if one.name in names]
    return bool(origin) and not any(origin)


def in_frame(log: TrackLog, crs: str) -> TrackLog:
    """Return a log that names no CRS and holds no positions as one in ``crs``.

    Its headings then are relative to that grid's north. Other logs are returned as they are.
    """
    if not is_local_frame(log.crs) or not (log.truth.empty and log.gnss.empty):
        return log
    note = f"no positions in the log: taken to be in {short_crs(crs)}"
    return replace(log, crs=crs, notes=(*log.notes, note))
