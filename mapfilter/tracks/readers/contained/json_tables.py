"""Records in JSON: a list of objects, an object on each line, or the features of GeoJSON."""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from json import JSONDecoder
from pathlib import Path
from typing import Any

from mapfilter._inputs import json_within
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.google_timeline import timeline_records
from mapfilter.tracks.readers.contained.tables import (
    MOST_COLUMNS,
    MOST_VALUES,
    KeyPath,
    PackedRecords,
    table_of_records,
    written,
)
from mapfilter.tracks.readers.texts.text import Text

_BEGINS = re.compile(rb"(?:\[\s{0,99})?\{\s{0,99}(?:\"|\})")
_LINE_BEGINS = re.compile(rb"[^{}\[\]\"\n]{1,80}\{\"")
"""A time and a topic before the object of a line, as OwnTracks' recorder writes them."""
_LIST = re.compile(r"\"(\w{1,40})\"\s{0,20}:\s{0,20}\[\s{0,40}(?=\{)")
_BLANK = re.compile(r"[\s,]*")
_HEAD_BYTES, _LARGEST_BYTES = 1 << 12, 1 << 28
_MOST_BYTES = 3 << 30
_BYTES_OF = {b"{": 240, b"[": 72, b",": 160}
"""What an object, a list and a further value take in memory, measured on a file of each."""
_MOST_NAMES = 100_000
"""Of one object: with more it is a table by its ids, or of settings."""
_DEEPEST = 8
_OF_KINDS: Mapping[str, tuple[str, ...]] = {"class": ("TPV",), "_type": ("location",)}
"""Names by which programs tell their kinds of records (gpsd, OwnTracks), and the kinds to read."""
_CRS = re.compile(
    r"\"crs\"\s{0,9}:\s{0,9}\{[^{}]{0,99}\{[^{}]{0,99}?\"name\"\s{0,9}:\s{0,9}\"([^\"]{0,99})"
)
_OF_NO_CELLS = re.compile("wi-?fi|wlan|bluetooth|beacon", re.IGNORECASE)
"""Lists whose levels, and positions once more, would be taken for those of cells."""
_OF_ESTIMATES = {"filter", "status", "radius_95_m"}
_DAMAGED = "the file is cut off or damaged; whole records were read"
_OF_DEGREES = re.compile(r"CRS84|EPSG:{1,2}4326|OGC:1\.3:CRS84", re.IGNORECASE)


def is_json(data: bytes) -> bool:
    """Return whether a text begins as JSON whose records may be rows, or each line has one."""
    return bool(_BEGINS.match(data[:_HEAD_BYTES].lstrip()) or _LINE_BEGINS.match(data))


def json_table(text: Text) -> Text | None:
    """Return the records of a text of JSON as a text of CSV; None where there are none.

    An object within a record adds its values; each object of a list within it is a row of its own.

    Raises
    ------
    InputError
        The file is too large, nested too deep, or of another CRS than WGS 84.
    """
    _check_size(text)
    records, notes = _records(text.data.decode("utf-8", "replace"), text.path)
    records = [record for record in records if isinstance(record, dict)]
    if not records:
        return None
    _check_crs(text)
    records, left = _of_kind(records)
    rows, paths, aside = PackedRecords(), dict[KeyPath, KeyPath](), Counter[str]()
    records.reverse()
    while records:
        # Records and rows of a large file need not be in memory at the same time.
        for row in _rows(_with_place(records.pop()), text, aside):
            rows.add({paths.setdefault(at, at): value for at, value in row.items()})
            if rows.values > MOST_VALUES:
                hint = "export the positions and cells alone"
                expected = "records of at most 5e7 values in all"
                raise fail(InputError, str(text.path), expected, "more", hint)
    # An object of thousands of names holds objects by their ids, or is of settings.
    if not rows.values or (len(rows) == 1 and len(rows.paths) > MOST_COLUMNS):
        return None
    if {path[-1] for path in rows.paths} >= _OF_ESTIMATES:
        hint = "what a filter estimated; it is no recording, nor a ground truth"
        raise fail(InputError, str(text.path), "a recording", "an estimate of mapfilter", hint)
    notes += [f"{name}: {number_of(n, 'object')} left out, no cells" for name, n in aside.items()]
    notes += [
        f"{number_of(n, f'record of {kind}', f'records of {kind}')} left out" for kind, n in left
    ]
    return table_of_records(replace(text, notes=(*text.notes, *notes)), rows, "JSON")


def _check_size(text: Text) -> None:
    """Refuse what would take too much memory: a value takes many times its letters.

    Raises
    ------
    InputError
    """
    size = len(text.data)
    if size > _LARGEST_BYTES:
        got = f"{size >> 20} MiB"
        raise fail(InputError, str(text.path), "JSON of at most 256 MiB", got, "export CSV")
    taken = 2 * size + sum(text.data.count(mark) * one for mark, one in _BYTES_OF.items())
    if taken > _MOST_BYTES:
        values = text.data.count(b",") + text.data.count(b"{") + text.data.count(b"[")
        expected = f"JSON whose values take up at most {_MOST_BYTES >> 30} GiB of memory"
        got = f"about {values / 1e6:.0f} million values, which take {taken / 2**30:.1f} GiB"
        hint = "export CSV, or the journey alone, or parts of it"
        raise fail(InputError, str(text.path), expected, got, hint)


def _records(content: str, path: Path) -> tuple[list[Any], list[str]]:
    """Return the objects of a text, and notes on what was left out."""
    # A table has the digits of numbers as they are.
    decoder = json_within()
    begin = content.lstrip()
    if begin.startswith("["):
        items, at = _items(begin, 1, decoder)
        notes = [] if begin[at:].strip() == "]" else [_DAMAGED]
        google, told = timeline_records(items)
        return (google, [*notes, *told]) if google else (items, notes)
    objects, whole = _of_lines(begin, decoder)
    if not objects:
        # Objects over many lines each, the last of which may be cut off.
        items, at = _items(begin, 0, decoder)
        objects, whole = [one for one in items if isinstance(one, dict)], at == len(begin)
    notes = [] if whole else [_DAMAGED]
    if len(objects) == 1:
        google, told = timeline_records(objects[0])
        if told and not google:
            hint = "switch on the timeline of the phone, and export it, or take another logger"
            *left, no_cells = told
            some = ", ".join(one.removesuffix(" left out") for one in left) or "none"
            got = f"{some} ({no_cells})"
            raise fail(InputError, str(path), "positions or Wi-Fi with times", got, hint)
        if google:
            return google, [*notes, *told]
        inner, left = _list_in(objects[0])
        return (inner, [*notes, *left]) if inner else (objects, notes)
    if not objects and (found := _LIST.search(begin)):
        items = _items(begin, found.end(), decoder)[0]
        google, told = timeline_records({found[1]: items})
        return google or items, [_DAMAGED, *(told if google else ())]
    return objects, notes


def _of_lines(content: str, decoder: JSONDecoder) -> tuple[list[Any], bool]:
    """Return the objects of lines that hold some, or end in some; other lines are damaged."""
    found: list[Any] = []
    whole = True
    for line in content.split("\n"):
        at = line.find("{")
        whole &= at >= 0 or not line.strip()
        while at >= 0:
            try:
                value, at = decoder.raw_decode(line, at)
            except (ValueError, RecursionError):
                whole = False
                if not found:
                    return [], False
                break
            found.append(value)
            at = _after_blanks(line, at)
            whole &= line.startswith("{", at) or at == len(line)
            at = line.find("{", at, at + 1)
    return found, whole


def _items(content: str, at: int, decoder: JSONDecoder) -> tuple[list[Any], int]:
    """Return values until the end of a list or of the text, or until damage, and where that is."""
    found: list[Any] = []
    while True:
        at = _after_blanks(content, at)
        if at >= len(content) or content[at] == "]":
            return found, at
        try:
            value, at = decoder.raw_decode(content, at)
        except (ValueError, RecursionError):
            return found, at
        found.append(value)


def _after_blanks(content: str, at: int) -> int:
    found = _BLANK.match(content, at)
    return found.end() if found else at


def _list_in(record: Mapping[str, Any]) -> tuple[list[Any], list[str]]:
    """Return the longest list of objects in an object, of cells if any, and notes on others."""
    lists = {
        name: value
        for name, value in record.items()
        if isinstance(value, list) and value and isinstance(value[0], dict)
    }
    longest = max(lists, key=lambda name: (not _is_of_no_cells(name), len(lists[name])), default="")
    return lists.pop(longest, []), [
        f"{name[:40]}: {number_of(len(value), 'object')} left out; {longest[:40]} is read"
        for name, value in lists.items()
    ]


def _is_of_no_cells(name: str) -> bool:
    return _OF_NO_CELLS.search(name[:40]) is not None


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


def _rows(
    record: Mapping[str, Any], text: Text, aside: Counter[str], above: int = 0
) -> Iterator[dict[KeyPath, str]]:
    """Yield a record's values by their paths, once for each object of a list within it.

    ``above`` names led to the record, and ``aside`` counts objects of lists that are of no cells.
    """
    own: dict[KeyPath, str] = {}
    lists: list[tuple[KeyPath, list[Any]]] = []
    todo = deque[tuple[KeyPath, Any]](((str(name),), value) for name, value in record.items())
    while todo:
        path, value = todo.popleft()
        if above + len(path) > _DEEPEST:
            hint = "export the positions and cells alone"
            expected = f"records of at most {_DEEPEST} levels"
            raise fail(InputError, str(text.path), expected, "JSON nested deeper", hint)
        if isinstance(value, dict):
            todo += [((*path, str(name)), inner) for name, inner in value.items()]
        elif isinstance(value, list):
            if value and any(map(_is_of_no_cells, path)):
                aside[path[-1][:40]] += len(value)
            elif value and isinstance(value[0], dict):
                lists.append((path, value))
        else:
            own[path] = written(value)
        if len(own) > _MOST_NAMES:
            hint = "export the positions and cells as a list of objects"
            expected = f"objects of at most {_MOST_NAMES} names"
            raise fail(InputError, str(text.path), expected, "more in one", hint)
    several = False
    for path, items in lists:
        for item in items:
            if not isinstance(item, dict):
                continue
            for row in _rows(item, text, aside, above + len(path)):
                several = True
                yield {**own, **{(*path, *at): value for at, value in row.items()}}
    if not several:
        yield own
