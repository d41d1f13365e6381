"""Google's location history: of a phone (Timeline.json) and of an account (Takeout), as records.

Google has not described these files. Names are those of published schemas and of programs that
read them: of a phone ``semanticSegments`` with a ``timelinePath`` and ``rawSignals``, of an iPhone
a list of segments with places as ``geo:60.17,24.94``; of an account ``locations`` (Records.json)
and ``timelineObjects`` (Semantic Location History).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any

from mapfilter._words import number_of

_PLACE = re.compile(r"(?:geo:)?\s?(-?\d{1,3}(?:\.\d{1,15})?)°?,\s?(-?\d{1,3}(?:\.\d{1,15})?)°?")
_SEGMENTS, _SIGNALS, _OBJECTS = "semanticSegments", "rawSignals", "timelineObjects"
_LOCATIONS = "locations"
_OF_SEGMENTS = ("timelinePath", "visit", "activity", "timelineMemory")
_OF_SIGNALS = ("position", "wifiScan", "activityRecord")
_OF_OBJECTS = ("activitySegment", "placeVisit")
_E7 = ("latitudeE7", "longitudeE7")
_NO_CELLS = "Google's location history holds no cells, steps or headings"
_INFERRED = "ends of segments, as Google inferred them"
_MAC_BITS, _MAC_DIGITS = 48, 18

Record = dict[str, Any]


def timeline_records(value: Mapping[str, Any] | Sequence[Any]) -> tuple[list[Record], list[str]]:
    """Return positions and Wi-Fi of a location history as records, and notes; none of others.

    Parameters
    ----------
    value : mapping or sequence
        Of the outermost object its lists by name; or the list alone.

    Examples
    --------
    >>> point = {"point": "60.17°, 24.94°", "time": "2026-05-01T10:00:00.000+03:00"}
    >>> records, notes = timeline_records({"semanticSegments": [{"timelinePath": [point]}]})
    >>> records
    [{'time': '2026-05-01T10:00:00.000+03:00', 'latitude': '60.17', 'longitude': '24.94'}]
    """
    if isinstance(value, Mapping):
        lists = {name: _objects(value.get(name)) for name in (_SEGMENTS, _SIGNALS, _OBJECTS)}
        located = _objects(value.get(_LOCATIONS))
        lists[_LOCATIONS] = located if any(_E7[0] in one for one in located) else []
    else:
        items = _objects(value)
        kinds = [_kind_of(one) for one in items]
        lists = {
            name: [one for one, kind in zip(items, kinds, strict=True) if kind == name]
            for name in (_SEGMENTS, _SIGNALS, _OBJECTS, _LOCATIONS)
        }
    if not any(lists.values()):
        return [], []
    left = Counter[str]()
    raw = [row for one in lists[_SIGNALS] for row in _of_signal(one, left)]
    raw += [row for one in lists[_LOCATIONS] for row in _of_location(one, left)]
    path = [row for one in lists[_SEGMENTS] for row in _of_path(one, left)]
    path += [row for one in lists[_OBJECTS] for row in _of_raw_path(one, left)]
    found = [*raw, *_beyond(path, raw, left)]
    notes = []
    if not any("cell" not in one for one in found):
        ends = [row for one in (*lists[_SEGMENTS], *lists[_OBJECTS]) for row in _ends(one)]
        notes += [f"{number_of(len(ends), 'position')}: {_INFERRED}"] if ends else []
        found += ends
    # A file of visits alone has records of these, and columns of none that are known.
    notes += [f"{_counted(n, one)} left out" for one, n in sorted(left.items()) if n]
    return found, [*notes, _NO_CELLS]


def _counted(count: int, what: str) -> str:
    noun, blank, rest = what.partition(" ")
    return f"{number_of(count, noun, 'guesses' if noun == 'guess' else '')}{blank}{rest}"


def _kind_of(record: Mapping[str, Any]) -> str:
    """Return the list that a record is of; "" for none."""
    if {"startTime", "endTime"} <= set(record) and any(name in record for name in _OF_SEGMENTS):
        return _SEGMENTS
    if len(record) == 1 and any(name in record for name in _OF_SIGNALS):
        return _SIGNALS
    if len(record) == 1 and any(name in record for name in _OF_OBJECTS):
        return _OBJECTS
    return _LOCATIONS if _E7[0] in record and ("activity" in record or "source" in record) else ""


def _objects(value: object) -> list[Record]:
    return [one for one in value if isinstance(one, dict)] if isinstance(value, list) else []


def _inner(record: Mapping[str, Any], *names: str) -> Record:
    """Return an object within others; an empty one where there is none."""
    found: Any = record
    for name in names:
        found = found.get(name) if isinstance(found, dict) else None
    return found if isinstance(found, dict) else {}


def _place(value: object) -> Record:
    found = _PLACE.fullmatch(value.strip()) if isinstance(value, str) else None
    return {"latitude": found[1], "longitude": found[2]} if found else {}


def _place_e7(record: Mapping[str, Any]) -> Record:
    """Return the place of a record in degrees times 1e7, of whichever names."""
    for names in (_E7, ("latE7", "lngE7")):
        parts = [str(record.get(name, "")) for name in names]
        if all(re.fullmatch(r"-?\d{1,10}", part) for part in parts):
            lat, lon = (f"{int(part) / 1e7:.7f}" for part in parts)
            return {"latitude": lat, "longitude": lon}
    return {}


def _of_signal(record: Mapping[str, Any], left: Counter[str]) -> Iterator[Record]:
    position, scan = _inner(record, "position"), _inner(record, "wifiScan")
    if place := _place(position.get("LatLng", position.get("latLng"))):
        yield {
            "time": position.get("timestamp"),
            **place,
            "accuracy_m": position.get("accuracyMeters"),
            "altitude_m": position.get("altitudeMeters"),
            "speed_mps": position.get("speedMetersPerSecond"),
        }
    elif position:
        left["position that is no latitude and longitude"] += 1
    yield from _of_scan(scan.get("deliveryTime"), scan, left)
    if "activityRecord" in record:
        left["guess of the kind of motion"] += 1


def _of_location(record: Mapping[str, Any], left: Counter[str]) -> Iterator[Record]:
    time = record.get("timestamp") or record.get("timestampMs")
    if place := _place_e7(record):
        yield {
            "time": time,
            **place,
            "accuracy_m": record.get("accuracy"),
            "altitude_m": record.get("altitude"),
            "speed_mps": record.get("velocity"),
            "course_deg": record.get("heading"),
        }
    scans = [record, *_objects(record.get("locationMetadata"))]
    for one in scans:
        yield from _of_scan(one.get("timestamp") or time, _inner(one, "wifiScan"), left)
    left["guess of the kind of motion"] += len(_objects(record.get("activity")))


def _of_scan(time: object, scan: Mapping[str, Any], left: Counter[str]) -> Iterator[Record]:
    points = _objects(scan.get("devicesRecords")) or _objects(scan.get("accessPoints"))
    for one in points:
        mac = str(one.get("mac", ""))
        if not mac.isdecimal() or len(mac) > _MAC_DIGITS or int(mac).bit_length() > _MAC_BITS:
            left["access point without an address"] += 1
            continue
        address = f"{int(mac):012x}"
        yield {
            "time": time,
            "technology": "WIFI",
            "role": "neighbour",
            "cell": ":".join(address[at : at + 2] for at in range(0, 12, 2)),
            "level_dbm": one.get("rawRssi", one.get("strength")),
        }


def _of_path(segment: Mapping[str, Any], left: Counter[str]) -> Iterator[Record]:
    points = _objects(segment.get("timelinePath"))
    for one in points:
        time = one.get("time") or _later(segment, one.get("durationMinutesOffsetFromStartTime"))
        place = _place(one.get("point"))
        if place and time:
            yield {"time": time, **place}
        else:
            left["point of a path without a place or a time"] += 1
    left["visit"] += "visit" in segment


def _later(segment: Mapping[str, Any], minutes: object) -> str:
    """Return the start of a segment, and minutes later; "" where either is missing."""
    try:
        start = datetime.fromisoformat(str(segment.get("startTime")))
        return (start + timedelta(minutes=float(str(minutes)))).isoformat()
    except (ValueError, OverflowError):
        return ""


def _of_raw_path(record: Mapping[str, Any], left: Counter[str]) -> Iterator[Record]:
    for name in _OF_OBJECTS:
        path = _inner(record, name, "simplifiedRawPath").get("points")
        for one in _objects(path):
            if place := _place_e7(one):
                time = one.get("timestamp") or one.get("timestampMs")
                yield {"time": time, **place, "accuracy_m": one.get("accuracyMeters")}
    ways = _inner(record, "activitySegment", "waypointPath").get("waypoints")
    left["waypoint without a time"] += len(_objects(ways))
    left["visit"] += "placeVisit" in record


def _ends(record: Mapping[str, Any]) -> Iterator[Record]:
    """Yield where and when a way began and ended."""
    segment, activity = _inner(record, "activitySegment"), record.get("activity")
    own = activity if isinstance(activity, dict) else {}
    span = _inner(segment, "duration")
    for end in ("start", "end"):
        at = own.get(end)
        place = _place(at.get("latLng") if isinstance(at, dict) else at)
        place = place or _place_e7(_inner(segment, f"{end}Location"))
        stamps = (record.get(f"{end}Time"), *(span.get(f"{end}Timestamp{s}") for s in ("", "Ms")))
        time = next((one for one in stamps if one), None)
        if place and time:
            yield {"time": time, **place}


def _beyond(path: list[Record], raw: Sequence[Record], left: Counter[str]) -> Iterator[Record]:
    """Yield the points of a path that is not between positions, which are better."""
    days = {str(one["time"])[:10] for one in raw if "cell" not in one}
    for one in path:
        if str(one["time"])[:10] in days:
            left["point of a path of a day that has positions"] += 1
        else:
            yield one
