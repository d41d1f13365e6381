"""Estimates as files: GeoParquet (everything, reads back), GPX 1.1 and GeoJSON (positions)."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pyarrow.parquet as pq
from pyarrow.lib import ArrowException

from mapfilter._arrow import open_parquet
from mapfilter._inputs import json_value, open_input
from mapfilter._io import atomic_file
from mapfilter._types import Ints
from mapfilter.errors import Faults, InputError, StoreError, fail
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate import TrackEstimate, TrackEvidence
from mapfilter.positioning.step_output import UnusedReading

VERSION = 3
_META = b"mapfilter"
_GPX = "http://www.topografix.com/GPX/1/1"
_COLUMNS = tuple(TrackEstimate.of_fixes("", "", ()).to_dataframe())
_EVIDENCE = tuple(TrackEvidence.__dataclass_fields__)
_SINCE_2 = ("radius_99_m", "protection_m")
"""Columns that files of version 1 lack; they are then NaN."""


def write_estimate(estimate: TrackEstimate, path: str | Path) -> None:
    """Write an estimate as GeoParquet, one row per epoch.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    # Slow to import; a replay does it while another process draws.
    import geopandas
    import shapely

    located = np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m)
    points = np.full(len(estimate), None, dtype=object)
    points[located] = shapely.points(estimate.east_m[located], estimate.north_m[located])
    frame = geopandas.GeoDataFrame(estimate.to_dataframe(), geometry=points, crs=estimate.crs)
    meta = {
        "version": VERSION,
        "crs": estimate.crs,
        "filter": estimate.filter,
        "start_utc_s": None if np.isnan(estimate.start_utc_s) else estimate.start_utc_s,
        "unused": [[u.time_s, u.kind, u.what, str(u.reason), u.readings] for u in estimate.unused],
    }
    with atomic_file(Path(path)) as temporary:
        frame.to_parquet(temporary, index=False)
        with open_parquet(temporary) as written:
            table = written.read()
        known = dict(table.schema.metadata or {})
        known[_META] = json.dumps(meta).encode()
        table = table.replace_schema_metadata(known)
        pq.write_table(table, temporary, write_page_checksum=True)


def read_estimate(path: str | Path) -> TrackEstimate:
    """Read what :func:`write_estimate` wrote.

    Raises
    ------
    StoreError
        The file is missing, cut off, not an estimate or of a newer version.
    """
    path = Path(path)
    if inside := sorted(path.glob("**/*.parquet"))[:1] if path.is_dir() else []:
        raise fail(StoreError, str(path), "an estimate", "a folder", f"name the file: {inside[0]}")
    try:
        with (
            open_input(path, StoreError) as stream,
            open_parquet(stream) as source,
        ):
            table = source.read()
    except OSError as error:
        raise fail(StoreError, str(path), "an estimate", error.strerror or error) from error
    except (ArrowException, ValueError) as error:
        raise fail(StoreError, str(path), "an estimate (Parquet)", error, "cut off") from error
    if _META not in (table.schema.metadata or {}):
        raise fail(StoreError, str(path), "an estimate", "Parquet that mapfilter did not write")
    try:
        return _estimate(table, json_value(table.schema.metadata[_META]), path)
    except (ArrowException, InputError, KeyError, TypeError, ValueError) as error:
        raise fail(StoreError, str(path), "an estimate", repr(error), "damaged") from error


def _estimate(table: Any, meta: dict[str, Any], path: Path) -> TrackEstimate:
    faults = Faults()
    if meta["version"] > VERSION:
        faults.add(str(path), f"version <= {VERSION}", meta["version"], "a newer mapfilter")
    old = _SINCE_2 if meta["version"] < 2 else ()
    for name in _COLUMNS:
        if name not in table.column_names and name not in old:
            faults.add(f"{path}, {name}", "a column of that name", "none")
    faults.raise_if_any(StoreError)
    column = {name: table[name].to_numpy() for name in _COLUMNS if name not in old}
    column |= {name: np.full(table.num_rows, np.nan) for name in old}
    east, cross, north = (
        column[name] for name in ("var_east_m2", "cov_east_north_m2", "var_north_m2")
    )
    covariance = np.stack([east, cross, cross, north], axis=1).reshape(len(east), 2, 2)
    start = meta["start_utc_s"]
    evidence = None
    if set(_EVIDENCE) <= set(table.column_names):
        evidence = TrackEvidence(*(table[name].to_numpy() for name in _EVIDENCE))
    return TrackEstimate(
        meta["crs"],
        meta["filter"],
        float("nan") if start is None else start,
        column["time_s"],
        column["east_m"],
        column["north_m"],
        covariance,
        np.stack([column[f"radius_{share}_m"] for share in (50, 67, 95)], axis=1),
        tuple(Status(s) for s in column["status"]),
        column["hypotheses"],
        column["mass_50m"],
        column["way_id"],
        column["way_probability"],
        tuple(Reason(r) for r in column["reason"]),
        column["radius_99_m"],
        column["protection_m"],
        tuple(_unused(*one) for one in meta["unused"]),
        evidence,
    )


def _unused(time_s: float, kind: str, what: str, reason: str, readings: int = 1) -> UnusedReading:
    """Return a reading that was not used; files of before version 3 do not tell how many it is."""
    return UnusedReading(time_s, kind, what, Reason(reason), readings)


def write_gpx(estimate: TrackEstimate, path: str | Path, name: str = "mapfilter") -> None:
    """Write the located epochs as a GPX 1.1 track (lon/lat, WGS 84; times where known).

    Each stretch of located epochs is a segment.
    """
    ElementTree.register_namespace("", _GPX)
    root = ElementTree.Element(f"{{{_GPX}}}gpx", version="1.1", creator="mapfilter")
    track = ElementTree.SubElement(root, f"{{{_GPX}}}trk")
    ElementTree.SubElement(track, f"{{{_GPX}}}name").text = name
    for located in _located_stretches(estimate):
        segment = ElementTree.SubElement(track, f"{{{_GPX}}}trkseg")
        lon, lat = unproject(estimate.crs, estimate.east_m[located], estimate.north_m[located])
        for index, x, y in zip(located.tolist(), lon.tolist(), lat.tolist(), strict=True):
            place = {"lat": f"{y:.7f}", "lon": f"{x:.7f}"}
            point = ElementTree.SubElement(segment, f"{{{_GPX}}}trkpt", place)
            if np.isfinite(estimate.start_utc_s):
                stamp = _utc_text(estimate.start_utc_s + float(estimate.time_s[index]))
                ElementTree.SubElement(point, f"{{{_GPX}}}time").text = stamp
    with atomic_file(Path(path)) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


def write_geojson(estimate: TrackEstimate, path: str | Path) -> None:
    """Write the located epochs as GeoJSON points (lon/lat, WGS 84), after a line for each stretch.

    A stretch of a single epoch has no line.
    """
    lines, points = [], []
    for located in _located_stretches(estimate):
        lon, lat = unproject(estimate.crs, estimate.east_m[located], estimate.north_m[located])
        positions = [
            [round(x, 7), round(y, 7)] for x, y in zip(lon.tolist(), lat.tolist(), strict=True)
        ]
        if len(positions) > 1:
            lines.append(_feature("LineString", positions, {"filter": estimate.filter}))
        for index, position in zip(located.tolist(), positions, strict=True):
            points.append(_feature("Point", position, _point_properties(estimate, index)))
    with atomic_file(Path(path)) as temporary:
        document = {"type": "FeatureCollection", "features": lines + points}
        temporary.write_text(json.dumps(document, allow_nan=False) + "\n", encoding="utf-8")


def _point_properties(estimate: TrackEstimate, index: int) -> dict[str, Any]:
    radius_m, level_m = float(estimate.radii_m[index, 2]), float(estimate.protection_m[index])
    time_s = float(estimate.time_s[index])
    known = np.isfinite(estimate.start_utc_s)
    moment = {"time": _utc_text(estimate.start_utc_s + time_s)} if known else {}
    return {
        **moment,
        "time_s": round(time_s, 3),
        "status": str(estimate.status[index]),
        "radius_95_m": round(radius_m, 2) if np.isfinite(radius_m) else None,
        "protection_m": round(level_m, 2) if np.isfinite(level_m) else None,
    }


def _feature(kind: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _located_stretches(estimate: TrackEstimate) -> list[Ints]:
    """Return the epochs of each stretch in which a position is followed, in their order.

    While a filter searches or is lost its position is no estimate of where the phone is.
    """
    followed = np.array([status.is_followed for status in estimate.status], dtype=bool)
    followed &= np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m)
    located = np.flatnonzero(followed)
    stretches = np.split(located, np.flatnonzero(np.diff(located) > 1) + 1)
    return [stretch for stretch in stretches if stretch.size]


def _utc_text(utc_s: float) -> str:
    moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=utc_s)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")
