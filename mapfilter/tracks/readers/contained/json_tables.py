"""Records in JSON: a list of objects, an object on each line, or the features of GeoJSON."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import Path_, table_of_records, written
from mapfilter.tracks.readers.texts.text import Text

_BEGINS = re.compile(rb"\s*(?:\[\s*)?\{\s*(?:\"|\})")
_LINE_BEGINS = re.compile(rb"[^{}\[\]\"\n]{1,80}\{\"")
"""A time and a topic before the object of a line, as OwnTracks' recorder writes them."""
_LIST = re.compile(r"\"(\w{1,40})\"\s{0,20}:\s{0,20}\[\s{0,40}(?=\{)")
_BLANK = re.compile(r"[\s,]*")
_LARGEST_BYTES = 1 << 28
_DEEPEST, _MOST_COLUMNS = 8, 1000
_OF_KINDS: Mapping[str, tuple[str, ...]] = {"class": ("TPV",), "_type": ("location",)}
"""Names by which programs tell their kinds of records (gpsd, OwnTracks), and the kinds to read."""
_CRS = re.compile(
    r"\"crs\"\s{0,9}:\s{0,9}\{[^{}]{0,99}\{[^{}]{0,99}?\"name\"\s{0,9}:\s{0,9}\"([^\"]{0,99})"
)
_OF_ESTIMATES = {"filter", "status", "radius_95_m"}
_OF_DEGREES = re.compile(r"CRS84|EPSG:{1,2}4326|OGC:1\.3:CRS84", re.IGNORECASE)


def is_json(data: bytes) -> bool:
    """Return whether a text begins as JSON whose records may be rows, or each line has one."""
    return bool(_BEGINS.match(data) or _LINE_BEGINS.match(data))


def json_table(text: Text) -> Text | None:
    """Return the records of a text of JSON as a text of CSV; None where there are none.

    An object within a record adds its values; each object of a list within it is a row of its own.

    Raises
    ------
    InputError
        The file is too large, nested too deep, or of another CRS than WGS 84.
    """
    if len(text.data) > _LARGEST_BYTES:
        got = f"{len(text.data) >> 20} MiB"
        raise fail(InputError, str(text.path), "JSON of at most 256 MiB", got, "export CSV")
    records, cut = _records(text.data.decode("utf-8", "replace"))
    records = [record for record in records if isinstance(record, dict)]
    if not records:
        return None
    _check_crs(text)
    records, left = _of_kind(records)
    rows = [row for record in records for row in _rows(_with_place(record), text)]
    if not any(rows):
        return None
    if {path[-1] for row in rows for path in row} >= _OF_ESTIMATES:
        hint = "what a filter estimated; it is no recording, nor a ground truth"
        raise fail(InputError, str(text.path), "a recording", "an estimate of mapfilter", hint)
    notes = [
        f"{number_of(n, f'record of {kind}', f'records of {kind}')} left out" for kind, n in left
    ]
    notes += ["the file is cut off or damaged; whole records were read"] if cut else []
    return table_of_records(replace(text, notes=(*text.notes, *notes)), rows, "JSON")


def _records(content: str) -> tuple[list[Any], bool]:
    """Return the objects of a text, and whether it is cut off or damaged."""
    decoder = json.JSONDecoder()
    begin = content.lstrip()
    if not begin.startswith("["):
        objects, whole = _of_lines(content, decoder)
        if len(objects) > 1 or (objects and not _lists(objects[0])):
            return objects, not whole
        if objects:
            return _lists(objects[0]), False
        # An object over many lines, the end of which may be missing.
        try:
            found, _ = decoder.raw_decode(begin)
            return (_lists(found) or [found]) if isinstance(found, dict) else [], False
        except (ValueError, RecursionError):
            inner = _LIST.search(content)
            if inner is None:
                return [], True
            return list(_items(content, inner.end(), decoder)), True
    at = content.index("[") + 1
    items = list(_items(content, at, decoder))
    return items, not content.rstrip().endswith("]")


def _of_lines(content: str, decoder: json.JSONDecoder) -> tuple[list[Any], bool]:
    """Return the objects of lines that are one each, or end in one; other lines are damaged."""
    found, whole = [], True
    for line in content.splitlines():
        at = line.find("{")
        if at < 0:
            whole &= not line.strip()
            continue
        try:
            value, _ = decoder.raw_decode(line, at)
            found.append(value)
        except (ValueError, RecursionError):
            whole = False
            if not found:
                return [], False
    return found, whole


def _items(content: str, at: int, decoder: json.JSONDecoder) -> Iterator[Any]:
    """Yield the items of a list until its end, or until damage."""
    while True:
        found = _BLANK.match(content, at)
        at = found.end() if found else at
        if at >= len(content) or content[at] == "]":
            return
        try:
            value, at = decoder.raw_decode(content, at)
        except (ValueError, RecursionError):
            return
        yield value


def _lists(record: Mapping[str, Any]) -> list[Any]:
    """Return the longest list of objects in an object that is no record itself; else none."""
    lists = [
        value
        for value in record.values()
        if isinstance(value, list) and value and isinstance(value[0], dict)
    ]
    return max(lists, key=len, default=[])


def _check_crs(text: Text) -> None:
    head = text.data[: 1 << 16].decode("utf-8", "replace")
    named = _CRS.search(head)
    if named and not _OF_DEGREES.search(named[1]):
        hint = "export the layer in WGS 84 (EPSG:4326)"
        raise fail(InputError, f"{text.path}, crs", "longitude and latitude", named[1], hint)


def _of_kind(records: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[tuple[str, int]]]:
    """Return the records of positions where a program tells kinds apart, and the others' counts."""
    for name, kinds in _OF_KINDS.items():
        kept = [record for record in records if record.get(name) in kinds]
        if kept:
            others = Counter(
                str(record.get(name, "another kind"))[:40]
                for record in records
                if record.get(name) not in kinds
            )
            return kept, sorted(others.items())
    return records, []


def _with_place(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record with the place of its geometry; properties of a feature are its own."""
    if record.get("type") != "Feature" or not isinstance(record.get("geometry"), dict):
        return record
    properties = record.get("properties")
    found = dict(properties) if isinstance(properties, dict) else {}
    names = {name.lower() for name in found}
    place = record["geometry"].get("coordinates")
    is_point = record["geometry"].get("type") == "Point" and isinstance(place, list)
    if is_point and not names & {"lat", "latitude", "lat_deg"}:
        found |= dict(zip(("longitude", "latitude", "altitude_m"), place, strict=False))
    return found


def _rows(record: Mapping[str, Any], text: Text) -> list[dict[Path_, str]]:
    """Return a record's values by their paths, once for each object of a list within it."""
    own: dict[Path_, str] = {}
    lists: list[tuple[Path_, list[Any]]] = []
    todo: list[tuple[Path_, Any]] = [((str(name),), value) for name, value in record.items()]
    while todo:
        path, value = todo.pop(0)
        if len(path) > _DEEPEST:
            raise fail(InputError, str(text.path), "records of few levels", "JSON nested deeper")
        if isinstance(value, dict):
            todo += [((*path, str(name)), inner) for name, inner in value.items()]
        elif isinstance(value, list):
            lists += [(path, value)] if value and isinstance(value[0], dict) else []
        else:
            own[path] = written(value)
    rows = [
        {**own, **{(*path, *inner): value for inner, value in row.items()}}
        for path, items in lists
        for item in items
        if isinstance(item, dict)
        for row in _rows(item, text)
    ]
    return rows or [own]
