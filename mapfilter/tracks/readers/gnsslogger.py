"""Text logs of Android's GnssLogger: fixes, raw measurements, inertial sensors."""

from __future__ import annotations

from collections import Counter

import numpy as np

from mapfilter._constants import GPS_EPOCH_S, LIGHT_MPS
from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.clocks.times import unix_seconds, utc_from_gps_s
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain_csv import has_content
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.lines import blocks
from mapfilter.tracks.readers.texts.separated_values import header_names, line_columns
from mapfilter.tracks.readers.texts.text import Text

_BLOCK_BYTES = 1 << 24
_DAY_NS, _WEEK_NS = 86_400 * 10**9, int(WEEK_S) * 10**9
_BEIDOU_BEHIND_NS = 14 * 10**9
_MOSCOW_NS = 3 * 3600 * 10**9
_LETTERS = {1: "G", 2: "S", 3: "R", 4: "J", 5: "C", 6: "E", 7: "I"}
_KNOWN_WEEK, _KNOWN_DAY = 8 | 16384, 128 | 32768
_L1_HZ = (1.55e9, 1.62e9)
_SENSORS = {
    "accelerometer": (("Accel", "UncalAccel"), "mps2", "mps2"),
    "gyroscope": (("Gyro", "UncalGyro"), "radps", "radpersec"),
    "magnetometer": (("Mag", "UncalMag"), "ut", "microt"),
}
_OLD = {
    "Fix": "Provider,Latitude,Longitude,Altitude,Speed,Accuracy,(UTC)TimeInMs",
    "Raw": "ElapsedRealtimeMillis,TimeNanos,LeapSecond,TimeUncertaintyNanos,FullBiasNanos,"
    "BiasNanos,BiasUncertaintyNanos,DriftNanosPerSecond,DriftUncertaintyNanosPerSecond,"
    "HardwareClockDiscontinuityCount,Svid,TimeOffsetNanos,State,ReceivedSvTimeNanos,"
    "ReceivedSvTimeUncertaintyNanos,Cn0DbHz,PseudorangeRateMetersPerSecond,"
    "PseudorangeRateUncertaintyMetersPerSecond,AccumulatedDeltaRangeState,"
    "AccumulatedDeltaRangeMeters,AccumulatedDeltaRangeUncertaintyMeters,CarrierFrequencyHz,"
    "CarrierCycles,CarrierPhase,CarrierPhaseUncertainty,MultipathIndicator,SnrInDb,"
    "ConstellationType",
}
_AXES = ("x", "y", "z")


def _matches(text: Text) -> bool:
    if has_content(header_names(text.first_line, ",")):
        # A table may have a column of such a name.
        return False
    starts = [line.lstrip("# ").split(",", 1)[0] for line in text.head[:400]]
    return any(
        start in ("Fix", "Raw") and line.count(",") >= 6
        for start, line in zip(starts, text.head, strict=False)
    )


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "GnssLogger", Clock("utc")
    sensors = {
        sensor: next((kind for kind in some if _has(text.data, kind)), "")
        for sensor, (some, _, _) in _SENSORS.items()
    }
    names: dict[str, tuple[str, ...]] = {}
    unnamed: dict[str, int] = {}
    ignored: Counter[str] = Counter()
    used = {"Fix", "Raw", *(kind for some, _, _ in _SENSORS.values() for kind in some)}
    for block, first_line in blocks(memoryview(text.data), 1, _BLOCK_BYTES):
        tables: dict[str, Columns] = {}
        for kind, (lines, numbers) in _grouped(block, first_line, names, reading).items():
            if kind not in used or (kind not in names and kind not in _OLD):
                ignored[kind] += len(lines)
                reading.rows += len(lines)
                continue
            header = names.get(kind) or tuple(_OLD[kind].lower().split(","))
            # Programs may write fields that no header names.
            count = unnamed.setdefault(kind, _unnamed(lines, len(header)))
            header += tuple(f"unnamed {i}" for i in range(count))
            least = min(len(header), 21 if kind == "Raw" else 7)
            own = ("kind", *header)
            tables[kind] = line_columns(lines, numbers, reading, own, ",", ragged=least)
        if "Fix" in tables:
            _add_fixes(tables["Fix"], reading)
        if "Raw" in tables:
            _add_raw(tables["Raw"], reading)
        for sensor, (_, unit, suffix) in _SENSORS.items():
            known = sensors[sensor]
            if known in tables:
                _add_sensor(tables[known], reading, sensor, known.lower(), unit, suffix)
    for kind, count in sorted(ignored.items()):
        some = number_of(count, f"row of {kind!r} is", f"rows of {kind!r} are")
        reading.note(f"{some} not used")


def _has(data: bytes, kind: str) -> bool:
    start = f"{kind},".encode()
    return data.startswith(start) or b"\n" + start in data


def _grouped(
    block: bytes, first_line: int, names: dict[str, tuple[str, ...]], reading: Reading
) -> dict[str, tuple[list[bytes], list[int]]]:
    """Return the rows of each kind; add the columns that comments name for each to ``names``."""
    kinds: dict[str, tuple[list[bytes], list[int]]] = {}
    for number, line in enumerate(block.split(b"\n"), start=first_line):
        if line.startswith(b"#"):
            words = line.decode("utf-8", "replace").strip("# ").split(",")
            if words[0].startswith("Version"):
                version = words[0].removeprefix("Version:").split()[:1]
                reading.program = " ".join(["GnssLogger", *version])
            elif len(words) > 2:
                names[words[0].strip()] = tuple(word.strip().lower() for word in words[1:])
            continue
        if not line.strip():
            continue
        kind = line.split(b",", 1)[0].decode("utf-8", "replace").strip()
        if not (kind.isalnum() and len(kind) <= 30):
            reading.rows += 1
            reading.refuse(number, "no row of GnssLogger")
            continue
        lines, numbers = kinds.setdefault(kind, ([], []))
        lines.append(line)
        numbers.append(number)
    return kinds


def _unnamed(lines: list[bytes], named: int) -> int:
    """Return how many fields most rows have beyond those that are named."""
    counts = Counter(line.count(b",") for line in lines[:1000])
    return max(0, min(counts.most_common(1)[0][0] - named, 20))


def _add_fixes(rows: Columns, reading: Reading) -> None:
    columns = {
        "time_s": unix_seconds(rows.number("unixtimemillis", "(utc)timeinms", "utctimemillis")),
        "lat_deg": rows.number("latitudedegrees", "latitude"),
        "lon_deg": rows.number("longitudedegrees", "longitude"),
        "altitude_m": rows.number("altitudemeters", "altitude"),
        "accuracy_m": rows.number("accuracymeters", "accuracy"),
        "speed_mps": rows.number("speedmps", "speed"),
        "course_deg": rows.number("bearingdegrees"),
        "provider": rows.texts("provider"),
    }
    reading.add("positions", columns, rows.line)


def _add_sensor(
    rows: Columns, reading: Reading, sensor: str, kind: str, unit: str, suffix: str
) -> None:
    """Add a sensor; the estimated bias is taken off one that is not calibrated."""
    columns = {"time_s": unix_seconds(rows.number("utctimemillis"))}
    for axis in _AXES:
        value = rows.number(f"{kind}{axis}{suffix}")
        if kind.startswith("uncal"):
            bias = rows.number(f"bias{axis}{suffix}", f"drift{axis}{suffix}")
            value = value - np.nan_to_num(bias)
        columns[f"{axis}_{unit}"] = value
    reading.add(sensor, columns, rows.line)
    if kind.startswith("uncal"):
        reading.note(f"{sensor}: uncalibrated, the estimated bias taken off")


def _add_raw(rows: Columns, reading: Reading) -> None:
    """Add pseudoranges: time of reception less time of sending, times the speed of light."""
    time_ns, has_time = rows.whole("timenanos")
    bias_ns, has_bias = rows.whole("fullbiasnanos")
    sent_ns, has_sent = rows.whole("receivedsvtimenanos")
    state, _ = rows.whole("state")
    svid, has_svid = rows.whole("svid")
    system, has_system = rows.whole("constellationtype")
    reading.refuse(
        rows.line[~(has_time & has_bias & has_sent & has_svid)], "Raw: a time is missing"
    )
    fine_ns = np.nan_to_num(rows.number("timeoffsetnanos")) - np.nan_to_num(
        rows.number("biasnanos")
    )
    gps_ns = time_ns - bias_ns
    utc_s = utc_from_gps_s(gps_ns / 1e9 + fine_ns / 1e9)
    names = satellite_names(np.where(has_system, system, 1), svid)
    by_day = system == 3
    known = np.where(by_day, state & _KNOWN_DAY, state & _KNOWN_WEEK) != 0
    whole = has_time & has_bias & has_sent & has_svid
    reading.refuse(rows.line[whole & ~known], "Raw: the satellite's time is not decoded")
    leap_ns = np.round(gps_ns / 1e9 - (utc_s - GPS_EPOCH_S)).astype(np.int64) * 10**9
    received = np.mod(gps_ns, _WEEK_NS)
    received = np.where(system == 5, received - _BEIDOU_BEHIND_NS, received)
    received = np.where(by_day, np.mod(gps_ns + _MOSCOW_NS - leap_ns, _DAY_NS), received)
    period = np.where(by_day, _DAY_NS, _WEEK_NS)
    way_ns = np.mod(received - sent_ns, period) + fine_ns
    named = np.array([name != "" for name in names], dtype=bool)
    reading.refuse(rows.line[whole & known & ~named], "Raw: a satellite without a slot number")
    good = whole & known & named
    carrier = rows.number("carrierfrequencyhz")
    first = np.isnan(carrier) | ((carrier > _L1_HZ[0]) & (carrier < _L1_HZ[1]))
    columns = {
        "time_s": utc_s,
        "satellite": names,
        "signal": np.where(first, "L1", "L5"),
        "pseudorange_m": LIGHT_MPS * way_ns / 1e9,
        "sigma_m": LIGHT_MPS * rows.number("receivedsvtimeuncertaintynanos") / 1e9,
        "rate_mps": rows.number("pseudorangeratemeterspersecond"),
        "cn0_dbhz": rows.number("cn0dbhz"),
    }
    kept = {name: values[good] for name, values in columns.items()}
    reading.add("satellites", kept, rows.line[good])


def satellite_names(system: Ints, svid: Ints) -> np.ndarray:
    """Return names as in RINEX of Android's numbers; "" for satellites without one.

    Examples
    --------
    >>> satellite_names(np.array([1, 4, 3]), np.array([7, 193, 100])).tolist()
    ['G07', 'J01', '']
    """
    names = np.full(len(svid), "", dtype=object)
    shifts = {4: 192, 2: 100}
    for kind, number in {*zip(system.tolist(), svid.tolist(), strict=True)}:
        index = number - shifts.get(kind, 0)
        # GLONASS satellites whose slot is not known have numbers by their frequency.
        if kind in _LETTERS and 1 <= index <= (32 if kind in (1, 3) else 99):
            names[(system == kind) & (svid == number)] = f"{_LETTERS[kind]}{index:02d}"
    return names


FORMAT = Format(
    "gnsslogger",
    "a GnssLogger text log",
    "GnssLogger for Android (versions 1 to 3)",
    "fixes by provider, pseudoranges of all constellations, accelerometer, gyroscope, magnetometer",
    _matches,
    _read,
)
