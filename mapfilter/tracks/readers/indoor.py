"""Text of the indoor-location competition: inertial sensors, Wi-Fi, beacons, waypoints."""

from __future__ import annotations

import numpy as np

from mapfilter.clocks.times import unix_seconds
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.identities import add_radio
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.grouped import Groups, columns_of, group_lines
from mapfilter.tracks.readers.texts.text import Text

_SENSORS = {
    "TYPE_ACCELEROMETER": ("accelerometer", "mps2"),
    "TYPE_GYROSCOPE": ("gyroscope", "radps"),
    "TYPE_MAGNETIC_FIELD": ("magnetometer", "ut"),
}
_AXES = ("x", "y", "z")
_KNOWN = frozenset({*_SENSORS, "TYPE_ROTATION_VECTOR", "TYPE_WIFI", "TYPE_BEACON", "TYPE_WAYPOINT"})
_OLDEST_S = 5.0


def _matches(text: Text) -> bool:
    return any("\tTYPE_" in line for line in text.head[:400])


def _kind(line: bytes) -> bytes:
    if line.startswith(b"#"):
        return b""
    return [*line.split(b"\t", 2), b"?", b"?"][1]


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "indoor-location competition logger", Clock("utc")
    groups = group_lines(text.data, reading, _kind, _KNOWN)
    for kind, (sensor, unit) in _SENSORS.items():
        rows = columns_of(groups, kind, "time kind x y z accuracy", "\t", reading, least=5)
        if rows is not None:
            columns = {f"{axis}_{unit}": rows.number(axis) for axis in _AXES}
            reading.add(sensor, {"time_s": _time(rows), **columns}, rows.line)
    names = "time kind x y z accuracy"
    rows = columns_of(groups, "TYPE_ROTATION_VECTOR", names, "\t", reading, least=5)
    if rows is not None:
        x, y, z = (rows.number(axis) for axis in _AXES)
        w = np.sqrt(np.maximum(1.0 - x**2 - y**2 - z**2, 0.0))
        columns = {"time_s": _time(rows), "qx": x, "qy": y, "qz": z, "qw": w}
        reading.add("orientation", columns, rows.line)
    rows = columns_of(groups, "TYPE_WAYPOINT", "time kind x y", "\t", reading)
    if rows is not None:
        columns = {"time_s": _time(rows), "east_m": rows.number("x"), "north_m": rows.number("y")}
        reading.add("true_places", columns, rows.line)
    _add_wifi(groups, reading)
    _add_beacons(groups, reading)


def _time(rows: Columns) -> np.ndarray:
    return unix_seconds(rows.number("time"))


def _add_wifi(groups: Groups, reading: Reading) -> None:
    """Add the access points that each scan received anew."""
    names = "time kind ssid bssid level frequency seen"
    rows = columns_of(groups, "TYPE_WIFI", names, "\t", reading, least=6)
    if rows is None:
        return
    time_s, seen_s = _time(rows), unix_seconds(rows.number("seen"))
    seen_s = np.where(np.isfinite(seen_s), seen_s, time_s)
    # A scan repeats what was not received anew.
    keys = np.stack([seen_s.astype(str), rows.texts("bssid").astype(str)], axis=1)
    new = np.zeros(len(rows), dtype=bool)
    new[np.unique(keys, axis=0, return_index=True)[1]] = True
    if (repeats := int((~new).sum())) > 0:
        reading.note(f"radio: {repeats} Wi-Fi results repeat those of an earlier scan, left out")
    old = new & (time_s - seen_s > _OLDEST_S)
    reading.refuse(rows.line[old], f"Wi-Fi: received more than {_OLDEST_S:g} s before the scan")
    columns = {"time_s": time_s, "cell": rows.texts("bssid"), "level_dbm": rows.number("level")}
    _add_transmitters(columns, "WIFI", rows, new & ~old, reading)


def _add_beacons(groups: Groups, reading: Reading) -> None:
    names = "time kind uuid major minor power level distance mac seen"
    rows = columns_of(groups, "TYPE_BEACON", names, "\t", reading, least=7)
    if rows is None:
        return
    parts = (rows.texts("uuid"), rows.texts("major"), rows.texts("minor"))
    cell = np.array(["-".join(words) for words in zip(*parts, strict=True)], dtype=object)
    mac = rows.texts("mac")
    cell = np.where(mac != "", mac, cell)
    columns = {"time_s": _time(rows), "cell": cell, "level_dbm": rows.number("level")}
    _add_transmitters(columns, "BLE", rows, np.ones(len(rows), dtype=bool), reading)


def _add_transmitters(
    columns: dict[str, np.ndarray],
    technology: str,
    rows: Columns,
    good: np.ndarray,
    reading: Reading,
) -> None:
    kept = {name: values[good] for name, values in columns.items()}
    kept["technology"] = np.full(int(good.sum()), technology, dtype=object)
    add_radio(reading, {**kept, "role": "neighbour"}, rows.line[good])


FORMAT = Format(
    "indoor",
    "a file of the indoor-location competition",
    "logger of the indoor-location competition (XYZ10, Kaggle)",
    "accelerometer, gyroscope, magnetometer, orientation, Wi-Fi, beacons, true waypoints",
    _matches,
    _read,
)
