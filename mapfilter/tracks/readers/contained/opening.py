"""The text of a file as the readers of recordings take it: tables of other kinds as CSV."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from mapfilter._inputs import open_input
from mapfilter.tracks.readers.contained.android_cells import android_table, has_android_cells
from mapfilter.tracks.readers.contained.fixed_lines import igc_table, is_igc, is_vbo, vbo_table
from mapfilter.tracks.readers.contained.json_tables import is_json, json_table
from mapfilter.tracks.readers.contained.modem_lines import is_modem_log, modem_table
from mapfilter.tracks.readers.contained.wkt_points import with_point_columns
from mapfilter.tracks.readers.contained.xml_tables import (
    gpx_table,
    has_cells,
    is_kml,
    is_tcx,
    kml_table,
    tcx_table,
)
from mapfilter.tracks.readers.plain.app_names import full_names
from mapfilter.tracks.readers.plain.fields import usual_fields
from mapfilter.tracks.readers.plain.headers import stated_fields
from mapfilter.tracks.readers.plain_csv import has_content
from mapfilter.tracks.readers.texts.separated_values import header_names
from mapfilter.tracks.readers.texts.text import Text, read_text

_WORKBOOKS = (".xlsx", ".xls", ".ods")
_BEGINS_OF_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
_LAYERS, _BEGINS_OF_LAYERS = (".gpkg",), (b"SQLite format 3\0",)
_FRAMES, _BEGINS_OF_FRAMES = (".parquet", ".pq"), (b"PAR1",)
OF_TABLES = (
    *_WORKBOOKS,
    *_LAYERS,
    *_FRAMES,
    ".json",
    ".jsonl",
    ".ndjson",
    ".geojson",
    ".kml",
    ".tcx",
)
"""Suffixes of files that may hold a table in another form."""
_HEAD_BYTES, _PEEKED_ROWS = 16, 100
_CELLS = {"ci", "cgi", "cell", "level_dbm"}


def read_any(
    path: Path,
    is_known: Callable[[Text], bool],
    most_bytes: int = -1,
    own: Collection[str] = (),
) -> Text:
    """Read a file as text; of one that holds a table in another form, the table as CSV.

    Parameters
    ----------
    path : Path
    is_known : callable
        Whether a text is of a format that is read as it is.
    most_bytes : int
        As of :func:`read_text`; of a layer few rows then, and workbooks as a whole.
    own : collection of str
        Names of columns that a user gives fields.

    Raises
    ------
    InputError
        As of :func:`read_text`, or the table cannot be taken from the file.
    """
    suffix = path.suffix.lower()
    if suffix in _WORKBOOKS and _begins(path, _BEGINS_OF_WORKBOOKS):
        # Here, as what reads workbooks and layers takes long to import.
        from mapfilter.tracks.readers.contained.sheets_and_layers import sheet_of

        return sheet_of(path)
    if suffix in _LAYERS and _begins(path, _BEGINS_OF_LAYERS):
        from mapfilter.tracks.readers.contained.sheets_and_layers import layer_of

        return layer_of(path, _PEEKED_ROWS if most_bytes >= 0 else -1, own)
    # Of many in a folder, as parts of results, none is a journey unless it is named.
    if suffix in _FRAMES and most_bytes < 0 and _begins(path, _BEGINS_OF_FRAMES):
        from mapfilter.tracks.readers.contained.data_frames import frame_of

        return frame_of(path)
    return _table_in(read_text(path, most_bytes), is_known, own)


def _table_in(text: Text, is_known: Callable[[Text], bool], own: Collection[str]) -> Text:
    """Return the table in a text as CSV; another text as it is."""
    if is_json(text.data):
        table = json_table(text)
        return table if table is not None and _is_of_a_journey(table, own) else text
    if has_android_cells(text):
        return android_table(text)
    if is_kml(text):
        return kml_table(text)
    if has_cells(text):
        return gpx_table(text) or text
    if is_tcx(text):
        return tcx_table(text)
    for is_such, table_of in ((is_igc, igc_table), (is_vbo, vbo_table)):
        if is_such(text):
            return table_of(text) or text
    if not is_known(text) and is_modem_log(text):
        return modem_table(text)
    return with_point_columns(text)


def is_of_levels(table: Text) -> bool:
    """Return whether the columns of a table as CSV are those of placed levels."""
    _, fields = _columns(table)
    return {"lat_deg", "lon_deg", "level_dbm"} <= fields


def _columns(table: Text) -> tuple[Sequence[str], set[str]]:
    """Return the names of the columns of a table as CSV, and the fields that they hold."""
    names = full_names(header_names(table.first_line, ","))
    return names, {*usual_fields(names), *stated_fields(names, (), ())}


def _is_of_a_journey(table: Text, own: Collection[str]) -> bool:
    """Return whether a table has places or cells; other JSON is of settings, or of figures."""
    names, fields = _columns(table)
    named = any(name.lower() in names for name in own)
    return named or has_content(names) or {"lat_deg", "lon_deg"} <= fields or bool(_CELLS & fields)


def _begins(path: Path, marks: tuple[bytes, ...]) -> bool:
    if not path.is_file():
        return False
    with open_input(path) as stream:
        return stream.read(_HEAD_BYTES).startswith(marks)
