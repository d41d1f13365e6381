"""TEMS exports by hand: which files are such, times, repeated rows, cells and their identities."""

from pathlib import Path

import numpy as np
import pytest

from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.tems import FORMAT
from mapfilter.tracks.readers.texts.text import Text

NAN = np.nan
START_S = 1_777_629_600
"""2026-05-01 10:00:00 UTC."""


def read(head, *rows, zone="", reading=None):
    """Read rows of values under names, all separated by bars."""
    reading = reading or Reading(Path("a.txt"))
    data = "\n".join([head, *rows]).replace("|", "\t").encode() + b"\n"
    FORMAT.read(Text(Path("a.txt"), data), reading, ReadOptions(zone=zone))
    return reading


def values(reading, table, *names):
    """Return columns of a table as lists, None where missing."""
    (rows,) = reading.tables[table]
    found = rows[list(names)].astype(object)
    return found.where(found.notna(), None).to_numpy().tolist()


@pytest.mark.parametrize(
    ("head", "is_export"),
    [
        ("Time|MS|Message Type|All-LAC", True),
        ("Timestamp|Message Type|LAC", True),
        ("Time|All-LAC", True),
        ("Message Type|All-LAC", False),
        ("Time|LAC|RxLev Sub (dBm)", False),
        # A column ms may be of milliseconds; beside levels with their unit it is a device.
        ("Time|MS|RxLev Sub (dBm)", True),
        ("Time|EQ|All-Neighbor RxLev (dBm) (Sorted)[2]", True),
        # Positions alone are of many programs.
        ("Time|MS|Message Type|All-Latitude|All-Longitude", False),
        ("Time|MS|Message Type|Event", False),
    ],
)
def test_what_is_an_export(head, is_export):
    text = Text(Path("a.txt"), head.replace("|", "\t").encode() + b"\n")
    assert FORMAT.matches(text) == is_export


@pytest.mark.parametrize(
    ("stamp", "zone", "time_s", "kind"),
    [
        ("01/05/2026 13:00:00.500", "+03:00", START_S + 0.5, "local"),
        ("01.05.2026 13:00:00", "+03:00", START_S, "local"),
        ("2026-05-01 10:00:02", "", START_S + 2, "local"),
        ("2026-05-01T10:00:02Z", "", START_S + 2, "utc"),
        ("2026-05-01T13:00:02+03:00", "+01:00", START_S + 2, "local"),
    ],
)
def test_days_go_before_months(stamp, zone, time_s, kind):
    found = read("Timestamp|All-ARFCN BCCH|All-RxLev Sub (dBm)", f"{stamp}|61|-80", zone=zone)
    assert values(found, "radio", "time_s") == [[time_s]]
    assert found.clock.kind == kind
    assert found.notes == []


def test_times_of_day_count_on_from_part_to_part():
    head = "Time|All-ARFCN BCCH|All-RxLev Sub (dBm)|All-Latitude|All-Longitude"
    found = read(head, "23:59:57|61|-80|60|25", "23:59:59|61|-81||")
    assert found.clock.kind == "monotonic"
    assert found.clock.from_midnight
    read(head, "00:00:01.5|61|-82||", reading=found)
    times = [part["time_s"].tolist() for part in found.tables["radio"]]
    assert times == [[86_397, 86_399], [86_401.5]]
    assert found.notes == ["times of day without a date: they count from an unknown day"]


@pytest.mark.parametrize(("of_day", "kind"), [(2, "local"), (3, "monotonic")])
def test_more_than_half_are_times_of_day(of_day, kind):
    rows = [f"13:00:0{i}|61|-8{i}" for i in range(of_day)]
    rows += [f"2026-05-01 13:00:0{i}|61|-8{i}" for i in range(of_day, 4)]
    found = read("Time|All-ARFCN BCCH|All-RxLev Sub (dBm)", *rows)
    assert found.clock.kind == kind
    assert len(values(found, "radio", "time_s")) == (of_day if kind == "monotonic" else 4 - of_day)


def test_rows_that_repeat_all_cells_are_read_once_a_second():
    """A second after the first of them, or at the same time, they are read."""
    times = [0.5, 0.75, 0.75, 1.25, 1.5, 2.0, 2.5, 2.75, 3.0]
    levels = [*[-80] * 7, -81, -81]
    rows = [f"10:00:{at:05.2f}|61|{level}|x" for at, level in zip(times, levels, strict=True)]
    found = read("Time|All-ARFCN BCCH|All-RxLev Sub (dBm)|Message Type", *rows)
    seconds = [time_s - 36_000 for (time_s,) in values(found, "radio", "time_s")]
    assert seconds == [0.5, 0.75, 1.5, 2.5, 2.75]
    assert {reason: lines[0].tolist() for reason, lines in found._refused.items()} == {
        "radio: repeats the row before within a second": [3, 5, 7, 10]
    }


def test_rows_without_cells_repeat_nothing():
    rows = [f"10:00:0{i}|{level}|Paging" for i, level in enumerate(["", "", "-80", "-80"])]
    found = read("Time|All-Neighbor RxLev (dBm)[1]|Message Type", *rows)
    assert found._refused == {}
    rows = [f"10:00:00.{i}||Paging" for i in range(3)]
    assert read("Time|All-Neighbor RxLev (dBm)[1]|Message Type", *rows)._refused == {}


def test_positions_that_differ_from_the_one_before():
    places = ["60|25", "60|25", "60|25.5", "|", "60|25.5", "60.5|25.5", "60.75|", "60|25"]
    rows = [f"10:00:0{i}|{place}|12.5" for i, place in enumerate(places)]
    found = read("Time|All-Latitude|All-Longitude|All-Altitude (m)", *rows)
    assert values(found, "positions", "time_s", "lat_deg", "lon_deg", "altitude_m") == [
        [36_000, 60, 25, 12.5],
        [36_002, 60, 25.5, 12.5],
        [36_005, 60.5, 25.5, 12.5],
        [36_007, 60, 25, 12.5],
    ]
    assert [lines[0].tolist() for lines in found._refused.values()] == [[8]]


GSM = "Time|All-LAC|All-Cell Id|All-BSIC (Num)|All-ARFCN BCCH|All-RxLev Sub (dBm)"
GSM += "|All-RxLev Full (dBm)"


@pytest.mark.parametrize(
    ("row", "cell"),
    [
        ("3021|117|42|61|-80|-79", [3021, 117, 42, 61, -80]),
        # The level of all frames where that of some is missing.
        ("3021|117|42|61||-79", [3021, 117, 42, 61, -79]),
        ("3021|117|42|61||", None),
        # -1 is none; a level needs a carrier, a code or an identity.
        ("3021|117|-1|-1|-80|", [3021, 117, None, None, -80]),
        ("3021||||-80|", None),
        ("||42||-80|", [None, None, 42, None, -80]),
        ("|||61|-80|", [None, None, None, 61, -80]),
        ("|117|||-80|", [None, 117, None, None, -80]),
    ],
)
def test_serving_cells_of_gsm(row, cell):
    found = read(GSM, f"10:00:00|{row}")
    if cell is None:
        assert found.tables == {}
        return
    assert values(found, "radio", "lac", "ci", "bsic", "arfcn", "level_dbm") == [cell]
    assert values(found, "radio", "technology", "role") == [["GSM", "serving"]]


LTE = "Time|All-Serving Cell DL EARFCN[1]|All-Serving Cell Identity[1]"
LTE += "|All-Serving Cell RSRP (dBm)[1]|All-Cell Identity (eNB Part)|All-Cell Identity (Cell Part)"


def identities(*rows, reading=None):
    """Return the identities of a serving cell, of rows of which no two are equal."""
    lines = [f"10:00:0{i}|{row}" for i, row in enumerate(rows)]
    found = read(LTE, *lines, reading=reading)
    return found, [
        None if np.isnan(ci) else int(ci) for part in found.tables["radio"] for ci in part["ci"]
    ]


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        # 28 bits, of which the cell's part has eight.
        (["1300|435|-80|457|33"], [457 * 256 + 33]),
        (["1300|435|-80|457|255"], [457 * 256 + 255]),
        (["1300|435|-80|457|256"], [None]),
        (["1300|435|-80|0|0"], [0]),
        (["1300|435|-80|457|"], [None]),
        (["1300|435|-80|-1|33"], [None]),
        (["1300|435|-80|457|-1"], [None]),
        # It holds until carrier or code change, and is not that of rows before.
        (["1300|435|-80|1|0", "1300|435|-81||", "1300|436|-81||"], [256, 256, None]),
        (["1300|435|-80|1|0", "1301|435|-81||", "1300|435|-81||"], [256, None, None]),
        (["1300|435|-80||", "1300|435|-81|1|0", "1300|435|-82|2|0"], [None, 256, 512]),
        # A carrier that a row leaves out is the last one.
        (["1300|435|-80|1|0", "|435|-81||", "1300||-82||"], [256, 256, 256]),
    ],
)
def test_an_identity_of_lte_holds_while_the_cell_does(rows, expected):
    assert identities(*rows)[1] == expected


def test_an_identity_of_lte_holds_in_the_next_part():
    found, _ = identities("1300|435|-80|1|0")
    assert identities("1300|435|-81||", "1300|436|-82||", reading=found)[1] == [256, 256, None]
    found, _ = identities("1300|435|-80|1|0", "1300|436|-80||")
    assert identities("1300|435|-81||", reading=found)[1] == [256, None, None]


def test_further_cells():
    """Places 0 to 31 of a list, and the carriers of an aggregation after the first."""
    neighbours = ("Neighbor ARFCN", "Neighbor RxLev (dBm)")
    carriers = ("Serving Cell DL EARFCN", "Serving Cell Identity", "Serving Cell RSRP (dBm)")
    lte = ("Neighbor Cell DL EARFCN", "Neighbor Cell Identity", "Neighbor Cell RSRP (dBm)")
    names = [f"All-{name}[{i}]" for i in (0, 31, 32) for name in neighbours]
    names += [f"All-{name}[2]" for name in (*carriers, *lte)]
    row = "10:00:00|1|-81|2|-82|3|-83|1300|435|-90|1301|436|-91"
    found = [
        part[["technology", "role", "arfcn", "bsic", "level_dbm"]].iloc[0].tolist()
        for part in read("|".join(["Time", *names]), row).tables["radio"]
    ]
    assert [[*one[:3], one[4]] for one in found] == [
        ["GSM", "neighbour", 1, -81],
        ["LTE", "neighbour", 1301, -91],
        ["LTE", "neighbour", 1300, -90],
        ["GSM", "neighbour", 2, -82],
    ]
    assert [one[3] for one in found[1:3]] == [436, 435]
