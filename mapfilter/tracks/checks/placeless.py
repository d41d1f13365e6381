"""Logs in another CRS than a database: a local frame, another name of its own, another system."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pyproj import CRS

from mapfilter.angles import wrap_rad
from mapfilter.geodesy import grid_convergence_rad, same_grid, short_crs
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.projected import projected_log

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


def in_frame(log: TrackLog, crs: str, about_deg: tuple[float, float] | None = None) -> TrackLog:
    """Return a log as one in ``crs``, with a note where it states another one.

    One whose CRS has the same metres, such as that of WGS 84 for that of ETRS89 in one UTM zone,
    keeps its numbers. One of another CRS is projected. One that names none is taken to be in
    ``crs`` where it holds no positions, else it is returned as it is.

    Parameters
    ----------
    log : TrackLog
    crs : str
        Projected CRS of the area.
    about_deg : (float, float) or None
        Latitude and longitude of the area, where headings of a log without positions are turned.
        North of a local frame is true north. None leaves headings of a local frame as they are, and
        such logs of another CRS in it.

    Raises
    ------
    InputError
        ``crs`` covers none of the positions of a table.
    """
    if log.crs == crs:
        return log
    if same_grid(log.crs, crs):
        return replace(log, crs=crs)
    if not is_local_frame(log.crs):
        return projected_log(log, crs, about_deg)
    if not (log.truth.empty and log.gnss.empty):
        return log
    note = f"no positions in the log: taken to be in {short_crs(crs)}"
    motion = log.motion
    if about_deg is not None and motion["heading_rad"].notna().any():
        turned_rad = grid_convergence_rad(crs, about_deg[1], about_deg[0])
        motion = motion.assign(heading_rad=wrap_rad(motion["heading_rad"] + turned_rad))
        angle = f"{abs(np.degrees(turned_rad)):.1f} degrees"
        note += f", headings by its grid convergence there, {angle}"
    return replace(log, crs=crs, motion=motion, notes=(*log.notes, note))
