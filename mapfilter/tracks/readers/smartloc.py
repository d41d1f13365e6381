"""smartLoc: lines of pseudoranges, odometry and truth, and CSV of its raw receiver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pyproj import Transformer

from mapfilter._types import Floats
from mapfilter.clocks.times import utc_from_week_s
from mapfilter.gnss.earth_rotation import in_frame_of_reception
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.grouped import columns_of, group_lines
from mapfilter.tracks.readers.texts.separated_values import header_columns, split_blanks
from mapfilter.tracks.readers.texts.text import Text

_RANGES = ("pseudorange3", "range3")
_KNOWN = frozenset({*_RANGES, "odom3", "point3"})
_LETTERS = {1: "G", 2: "S", 4: "R", 8: "E", 16: "J", 32: "C"}
_SYSTEMS = {"GPS": "G", "SBAS": "S", "GLONASS": "R", "GALILEO": "E", "QZSS": "J", "BEIDOU": "C"}
_MOST_NUMBER = 1000
_EARTH_M = (6.2e6, 6.5e6)


def _matches(text: Text) -> bool:
    lines = [line.split() for line in text.head[:50] if line.strip()]
    return bool(lines) and sum(words[0] in _KNOWN for words in lines) > 0.5 * len(lines)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "smartLoc", Clock("monotonic")
    groups = group_lines(
        split_blanks(text.data), reading, lambda line: line.split(b" ", 1)[0], _KNOWN
    )
    for kind in _RANGES:
        names = "kind time range variance x y z id system elevation cn0"
        rows = columns_of(groups, kind, names, " ", reading)
        if rows is not None:
            variance = rows.number("variance")
            sent_m = np.stack([rows.number(axis) for axis in "xyz"], axis=1)
            # The files give places in the frame of the moment of sending (as libRSF takes them).
            place_m = in_frame_of_reception(sent_m, rows.number("range"))
            columns = {
                "time_s": rows.number("time"),
                "satellite": _satellites(rows.number("system"), rows.number("id")),
                "signal": "L1",
                "pseudorange_m": rows.number("range"),
                "sigma_m": np.sqrt(np.where(variance > 0, variance, np.nan)),
                "cn0_dbhz": rows.number("cn0"),
                **{f"{axis}_m": place_m[:, i] for i, axis in enumerate("xyz")},
            }
            reading.add("satellites", columns, rows.line)
    names = "kind time vx vy vz wx wy wz vvx vvy vvz vwx vwy vwz"
    rows = columns_of(groups, "odom3", names, " ", reading)
    if rows is not None:
        columns = {
            "time_s": rows.number("time"),
            "speed_mps": rows.number("vx"),
            "yaw_rate_radps": rows.number("wz"),
            "speed_sd_mps": _deviation(rows.number("vvx")),
            "yaw_rate_sd_radps": _deviation(rows.number("vwz")),
        }
        reading.add("odometry", columns, rows.line)
    names = "kind time x y z " + " ".join(f"v{i}" for i in range(9))
    rows = columns_of(groups, "point3", names, " ", reading, least=5)
    if rows is not None:
        place = np.stack([rows.number(axis) for axis in ("x", "y", "z")])
        lon, lat, altitude = _geodetic(place)
        columns = {"time_s": rows.number("time"), "lat_deg": lat, "lon_deg": lon}
        reading.add("truth", {**columns, "altitude_m": altitude}, rows.line)


def _deviation(variance: Floats) -> Floats:
    return np.sqrt(np.where(variance >= 0, variance, np.nan))


def _geodetic(place_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Return longitude, latitude and altitude of earth-centred places; NaN off the ground."""
    away = np.sqrt((place_m**2).sum(axis=0))
    good = (away > _EARTH_M[0]) & (away < _EARTH_M[1])
    found = np.full(place_m.shape, np.nan)
    if good.any():
        to_degrees = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
        found[:, good] = np.array(to_degrees.transform(*place_m[:, good]))
    return found[0], found[1], found[2]


def _satellites(system: Floats, number: Floats) -> np.ndarray:
    """Return names as in RINEX; slots of GLONASS count from 1, 65 or 301."""
    names = np.full(len(number), None, dtype=object)
    whole = np.isin(system, list(_LETTERS)) & (np.floor(number) == number) & (number < _MOST_NUMBER)
    for kind, index in {*zip(system[whole].tolist(), number[whole].tolist(), strict=True)}:
        letter = _LETTERS[int(kind)]
        slot = index - (300 if index > 300 else 64 if letter == "R" and index > 64 else 0)
        if letter == "S" and index > 100:
            slot = index - 100
        if 1 <= slot <= 99:
            names[(system == kind) & (number == index)] = f"{letter}{int(slot):02d}"
    return names


def _is_raw(text: Text) -> bool:
    line = text.first_line.lower()
    return line.startswith("gpsweek") and "prmes" in line


def _read_raw(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "smartLoc receiver (RXM-RAWX)", Clock("gps")
    rows = header_columns(text.data, reading, text.line)
    rows = replace(rows, names=tuple(_short(name) for name in rows.names))
    time_s = utc_from_week_s(rows.number("week"), rows.number("rcvtow"))
    heading = rows.number("gt heading")
    truth = {"time_s": utc_from_week_s(rows.number("gpsweek"), rows.number("gpssecondsofweek"))}
    truth |= {"lat_deg": rows.number("gt lat"), "lon_deg": rows.number("gt lon")}
    new = np.ones(len(rows), dtype=bool)
    new[1:] = np.diff(truth["time_s"]) != 0
    columns = {**truth, "altitude_m": rows.number("gt height")}
    reading.add("truth", {k: v[new] for k, v in columns.items()}, rows.line[new])
    if np.isfinite(heading).any():
        reading.note("true headings, velocities and yaw rates are not used")
    letters = {word: _SYSTEMS.get(word.upper(), "") for word in set(rows.texts("gnssid").tolist())}
    numbers = rows.number("svid")
    names = [
        f"{letters[word]}{int(number):02d}" if letters[word] and 1 <= number <= 99 else None
        for word, number in zip(rows.texts("gnssid"), numbers, strict=True)
    ]
    satellites = {
        "time_s": time_s,
        "satellite": names,
        "signal": "L1",
        "pseudorange_m": rows.number("prmes"),
        "sigma_m": rows.number("prstdev"),
        "cn0_dbhz": rows.number("cno"),
    }
    reading.add("satellites", satellites, rows.line)


def _short(name: str) -> str:
    """Return the name in parentheses, else the first word, of a column's long title."""
    inner = name.split("(")[-1].split(")")[0].strip() if "(" in name else ""
    if inner and inner.isascii() and "=" not in inner:
        return inner
    return name.split("[")[0].strip()


FORMAT = Format(
    "smartloc",
    "a smartLoc file",
    "smartLoc of TU Chemnitz (input and ground truth)",
    "pseudoranges with satellites' places, odometry (speed, yaw rate), truth",
    _matches,
    _read,
)
RAW = Format(
    "smartloc-raw",
    "a smartLoc receiver file",
    "smartLoc of TU Chemnitz (RXM-RAWX.csv)",
    "pseudoranges, truth",
    _is_raw,
    _read_raw,
    by_rows=True,
)
