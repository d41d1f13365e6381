"""Tables of raw sensors beside a log: the folder ``sensors`` in its folder, one table each.

Times are those of the log. Axes are those of the device, right-handed; odometry is of the vehicle.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._arrow import open_parquet
from mapfilter._cut_ends import without_cut_end
from mapfilter._inputs import open_input
from mapfilter._io import sha256_file, sha256_of
from mapfilter._json_files import read_json
from mapfilter._separator_line import without_separator_line
from mapfilter.errors import Faults, InputError, StoreError, fail
from mapfilter.tracks.table_files import SEPARATORS, as_frame

FOLDER = "sensors"

MOTION_TABLES = frozenset({"motion", "odometry", "poses", "steps", "accelerometer"})
"""Tables of recordings of which motion is made."""

SENSOR_COLUMNS: dict[str, tuple[str, ...]] = {
    "accelerometer": ("time_s", "x_mps2", "y_mps2", "z_mps2"),
    "linear_acceleration": ("time_s", "x_mps2", "y_mps2", "z_mps2"),
    "gravity": ("time_s", "x_mps2", "y_mps2", "z_mps2"),
    "gyroscope": ("time_s", "x_radps", "y_radps", "z_radps"),
    "magnetometer": ("time_s", "x_ut", "y_ut", "z_ut"),
    "orientation": ("time_s", "qx", "qy", "qz", "qw"),
    "barometer": ("time_s", "pressure_hpa"),
    "steps": ("time_s", "count"),
    "compass": ("time_s", "magnetic_deg"),
    "turns": ("time_s", "turn_rad", "yaw_rate_radps"),
    "odometry": ("time_s", "speed_mps", "yaw_rate_radps", "speed_sd_mps", "yaw_rate_sd_radps"),
    "velocity": ("time_s", "speed_mps", "heading_rad"),
    "reckoning": ("time_s", "heading_sd_rad", "disturbed", "climb", "height_m"),
}
"""Sensors of a log and the columns of each.

``accelerometer`` includes gravity, ``linear_acceleration`` does not; ``orientation`` is the
rotation from the device to east, north and up; ``steps`` counts since some start, or in each row;
``compass`` is clockwise from magnetic north; ``turns`` are those of the walker since the row
before, or their rate, counter-clockwise; ``velocity`` is that of a GNSS receiver, with headings
counter-clockwise from grid east; ``reckoning`` belongs to motion made of these sensors, see
:class:`mapfilter.tracks.pdr.walk.Reckoned`.
"""

_LONGEST_HEADER_BYTES = 1 << 16
Form = Literal["parquet", "csv"]
"""Of the tables of a log."""


def check_sensors(sensors: Mapping[str, pd.DataFrame]) -> None:
    """Raise InputError where tables are of no sensor of a log, lack a column, or hold text."""
    faults = Faults()
    for name, rows in sensors.items():
        if name not in SENSOR_COLUMNS:
            near = get_close_matches(name, SENSOR_COLUMNS, 1)
            faults.add("sensors", f"one of {', '.join(SENSOR_COLUMNS)}", repr(name), *near)
            continue
        columns = SENSOR_COLUMNS[name] if len(rows) else ()
        if lacking := [column for column in columns if column not in rows]:
            faults.add(f"sensors, {name}", f"columns {', '.join(columns)}", f"no {lacking[0]}")
        for column in (column for column in columns if column in rows):
            try:
                rows[column].astype("float64")
            except (TypeError, ValueError):
                faults.add(f"sensors, {name}, {column}", "numbers", "others among them")
    faults.raise_if_any(InputError)


def write_sensors(
    folder: Path, sensors: Mapping[str, pd.DataFrame], form: Form
) -> list[dict[str, Any]]:
    """Write sensor tables into a log's new folder, and return their parts for its head."""
    parts: list[dict[str, Any]] = []
    for name, columns in SENSOR_COLUMNS.items():
        rows = sensors.get(name)
        if rows is None or rows.empty:
            continue
        path = folder / FOLDER / f"{name}.{form}"
        path.parent.mkdir(exist_ok=True)
        rows = rows[list(columns)].astype("float64")
        if form == "csv":
            rows.to_csv(path, index=False, lineterminator="\n")
        else:
            table = pa.Table.from_pandas(rows, preserve_index=False).replace_schema_metadata(None)
            pq.write_table(table, path, compression="zstd")
        part = {"path": f"{FOLDER}/{path.name}", "sha256": sha256_file(path)}
        parts.append(part | {"bytes": path.stat().st_size, "rows": len(rows)})
    return parts


def read_sensors(log: str | Path) -> dict[str, pd.DataFrame]:
    """Read the sensor tables of a log, by name; none where it has no folder ``sensors``.

    A last row that was cut off, and zero bytes at the end, are left out.

    Raises
    ------
    InputError
        A table is damaged, or lacks a column.
    StoreError
        A table was cut off or changed since ``mapfilter convert`` wrote it.
    """
    return sensors_of(log)[0]


def sensors_of(log: str | Path) -> tuple[dict[str, pd.DataFrame], tuple[str, ...]]:
    """Return what :func:`read_sensors` returns, and notes on what was left out; same errors."""
    folder, notes = Path(log), list[str]()
    paths = {
        name: path
        for name in SENSOR_COLUMNS
        for path in (folder / FOLDER / f"{name}.parquet", folder / FOLDER / f"{name}.csv")
        if path.exists() or path.is_symlink()
    }
    head = folder / "log.json"
    listed = read_json(head).get("parts", []) if head.is_file() else []
    sums = {part.get("path"): part.get("sha256") for part in listed if isinstance(part, dict)}
    faults, tables = Faults(), {}
    read = {f"{FOLDER}/{path.name}" for path in paths.values()}
    for lost in sorted({str(one) for one in sums if str(one).startswith(f"{FOLDER}/")} - read):
        raise fail(StoreError, str(folder / lost), "a table of the log", "none", "not copied whole")
    for name, path in paths.items():
        known = sums.get(f"{FOLDER}/{path.name}")
        try:
            with open_input(path) as stream:
                if known is not None and known != sha256_of(stream):
                    hint = "changed or cut off"
                    raise fail(StoreError, str(path), f"SHA-256 {known}", "another", hint)
                if path.suffix == ".csv":
                    data, ends = without_cut_end(stream.read(), SEPARATORS, str(path))
                    rows, notes = _csv_rows(data), notes + ends
                else:
                    with open_parquet(stream) as source:
                        rows = as_frame(source.read())
        except (pa.ArrowException, ValueError, OSError) as error:
            got = (str(error).splitlines() or ["nothing"])[0]
            raise fail(InputError, str(path), "a readable table", got, "cut off") from error
        if not rows.columns.is_unique:
            faults.add(str(path), "each column once", "a name of two columns")
            continue
        if lacking := [column for column in SENSOR_COLUMNS[name] if column not in rows]:
            faults.add(str(path), f"columns {', '.join(SENSOR_COLUMNS[name])}", f"no {lacking[0]}")
        for column in SENSOR_COLUMNS[name]:
            values = rows.get(column, pd.Series(dtype=float))
            if values.notna().any() and not pd.api.types.is_numeric_dtype(values):
                faults.add(f"{path}, {column}", "numbers", "others", "text among them")
        tables[name] = rows
    faults.raise_if_any(InputError)
    return tables, tuple(notes)


def _csv_rows(data: bytes) -> pd.DataFrame:
    """Read numbers between commas, semicolons or tabs; decimal commas where these separate none."""
    data = without_separator_line(data)
    header = data.lstrip()[:_LONGEST_HEADER_BYTES].splitlines()[:1]
    separator = max(SEPARATORS, key=lambda one: header[0].count(one.encode()) if header else 0)
    decimal = "," if separator != "," and b"," in data else "."
    return pd.read_csv(io.BytesIO(data), sep=separator, decimal=decimal)
