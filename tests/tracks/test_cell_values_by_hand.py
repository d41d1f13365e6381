"""Identities, codes and timing advances of cells at the ends of their ranges, by hand."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain.identities import _networks
from mapfilter.tracks.readers.recorded.identities import (
    add_radio,
    available,
    cell_names,
    parse_identities,
)
from mapfilter.tracks.readers.recorded.reading import Reading

START_S = 1_777_629_600.0
NAN = np.nan


def added(**columns):
    """Return the rows and the notes of reported cells of -80 dBm, in lines 2, 3 and so on."""
    count = max(len(values) for values in columns.values())
    reading = Reading(Path("made.csv"))
    usual = {"time_s": START_S + np.arange(count), "role": "serving", "level_dbm": [-80.0] * count}
    add_radio(reading, {**usual, **columns}, 2 + np.arange(count))
    return reading.tables["radio"][0], reading.notes


@pytest.fixture
def read(tmp_path):
    """Read columns of a plain CSV, each row with a time and -80 dBm."""

    def of(**columns):
        table = pd.DataFrame(columns)
        table.insert(0, "time", START_S + np.arange(len(table)))
        table.assign(level_dbm=-80).to_csv(tmp_path / "cells.csv", index=False)
        return read_recording(tmp_path / "cells.csv").tables["radio"]

    return of


@pytest.mark.parametrize(
    ("lac", "value"),
    [
        # Hexadecimal digits in all that have a digit, and a letter in half of them at least.
        (["1A", "10"], 0x1A),
        (["1A", "2B"], 0x1A),
        (["26", "2B", "10"], 26),
        (["26", "unknown"], 26),
        (["26", "2B.5"], 26),
        (["unknown", "none"], NAN),
        (["", "-"], NAN),
    ],
)
def test_hexadecimal_codes_without_a_mark(tmp_path, lac, value):
    lines = [f"{START_S + i:.0f},{code},7,-80" for i, code in enumerate(lac)]
    path = tmp_path / "cells.csv"
    path.write_text("\n".join(["time,lac,ci,level_dbm", *lines]) + "\n")
    found = read_recording(path)
    assert found.tables["radio"]["lac"].tolist()[:1] == pytest.approx([value], nan_ok=True)
    told = "lac: taken for hexadecimal numbers"
    assert (told in found.notes) == (lac[0] == "1A")


# TS 45.005 and 45.010: ARFCN of 10 bits, BSIC of 6, timing advances to 219 (GSM 400). TS 25.101
# and 25.213: UARFCN of 14 bits, 512 scrambling codes. TS 36.101, 36.211 and 36.213: EARFCN of 18
# bits, 504 PCI, 1282 steps. TS 38.104, 38.211 and 38.213: NR-ARFCN to 3279165, 1008 PCI, 3846
# steps. TS 23.003: LAC and TAC of 16 bits, of 24 in NR; CI of 16, ECI of 28, NCI of 36.
@pytest.mark.parametrize(
    ("family", "name", "most"),
    [
        ("GSM", "arfcn", 1023),
        ("GSM", "bsic", 63),
        ("GSM", "lac", 65_535),
        ("GSM", "ci", 65_535),
        ("GSM", "timing_advance", 219),
        ("UMTS", "arfcn", 16_383),
        ("UMTS", "bsic", 511),
        ("UMTS", "lac", 65_535),
        ("LTE", "arfcn", 262_143),
        ("LTE", "bsic", 503),
        ("LTE", "lac", 65_535),
        ("LTE", "timing_advance", 1282),
        ("NR", "arfcn", 3_279_165),
        ("NR", "bsic", 1007),
        ("NR", "lac", 16_777_215),
        ("NR", "timing_advance", 3846),
        (None, "arfcn", 3_279_165),
        (None, "bsic", 1007),
        (None, "lac", 16_777_215),
        (None, "timing_advance", 3846),
        (None, "mcc", 999),
        (None, "mnc", 999),
    ],
)
def test_the_largest_value_of_a_technology_is_kept_and_the_next_is_not(family, name, most):
    values = [0.0, most, most + 1.0, -1.0]
    rows, notes = added(technology=np.full(4, family, dtype=object), **{name: values})
    assert rows[name].tolist() == pytest.approx([0.0, most, NAN, NAN], abs=1e-6, nan_ok=True)
    (note,) = notes
    assert f"{name}: 2 values are not 0..{most}" in note or family is None
    assert "first in line 4" in note


@pytest.mark.parametrize(("family", "bits"), [("UMTS", 28), ("LTE", 28), ("NR", 36), (None, 36)])
def test_an_identity_of_all_bits_is_of_no_cell(family, bits):
    values = [0.0, 2.0**bits - 2, 2.0**bits - 1, 2.0**bits]
    rows, _ = added(technology=np.full(4, family, dtype=object), ci=values)
    assert rows["ci"].tolist() == pytest.approx([*values[:2], NAN, NAN], abs=1e-6, nan_ok=True)
    assert rows["cell"].tolist()[:2] == ["0", f"{2**bits - 2}"]
    assert rows["cell"].isna().tolist()[2]


def test_an_identity_of_28_bits_and_more_is_one_of_nr():
    rows, notes = added(technology=np.array(["NR", "NR"], dtype=object), ci=[2.0**28, 2.0**36 - 2])
    assert rows["ci"].tolist() == [2.0**28, 2.0**36 - 2]
    assert notes == []


def test_each_technology_has_its_own_limits_in_one_file():
    families = np.array(["GSM", "LTE", "NR", "UMTS"], dtype=object)
    rows, _ = added(technology=families, bsic=[504.0] * 4, timing_advance=[1000.0] * 4)
    assert rows["bsic"].tolist() == pytest.approx([NAN, NAN, 504, 504], abs=1e-6, nan_ok=True)
    # No advance of UMTS is known: it has no limit of its own.
    assert rows["timing_advance"].tolist() == pytest.approx(
        [NAN, 1000, 1000, 1000], abs=1e-6, nan_ok=True
    )


def test_a_row_needs_an_identity_a_level_or_a_timing_advance():
    reading = Reading(Path("made.csv"))
    columns = {
        "time_s": START_S + np.arange(5),
        "role": "serving",
        "ci": [7.0, NAN, NAN, NAN, NAN],
        "level_dbm": [NAN, -80.0, NAN, NAN, NAN],
        "timing_advance": [NAN, NAN, 0.0, NAN, NAN],
        "bsic": [NAN, NAN, NAN, 12.0, NAN],
    }
    add_radio(reading, columns, 2 + np.arange(5))
    (rows,) = reading.tables["radio"]
    assert (rows["time_s"] - START_S).tolist() == [0, 1, 2]
    assert reading._refused["radio: neither a cell nor a level"][0].tolist() == [5, 6]


def test_marks_of_android_are_no_numbers():
    """Integer.MAX_VALUE and Long.MAX_VALUE are CellInfo.UNAVAILABLE; -1 is of older versions."""
    values = np.array([-1, 0, 1, 2**31 - 2, 2**31 - 1, 2**31, 2**63 - 2, 2**63 - 1, 5, -2])
    there = np.array([True] * 8 + [False, True])
    expected = [NAN, 0, 1, 2**31 - 2, NAN, 2**31, 2**63 - 2, NAN, NAN, -2]
    assert available(values, there).tolist() == pytest.approx(expected, abs=1e-6, nan_ok=True)


def test_names_hold_the_known_parts_of_each_cell():
    mcc, mnc, lac, ci = (
        np.array(part, dtype=float)
        for part in (
            [244, 244, 244, NAN, 244, 244],
            [91, 0, 91, NAN, 91, 91],
            [7, 7, NAN, NAN, 7, 0],
            [5, 5, 5, 5, NAN, 0],
        )
    )
    names = cell_names(mcc, mnc, lac, ci).tolist()
    assert names == ["244-91-7-5", "244-0-7-5", "244-91-5", "5", None, "244-91-0-0"]


def test_parts_of_an_identity_in_one_text():
    texts = ["262-01-1234-5678", "26201-1234-5678", "302:720:9751830", "26201", "", "1-2-3-4-5"]
    found = parse_identities(np.array(texts, dtype=object))
    expected = {
        "mcc": [262, 262, 302, NAN, NAN, NAN],
        "mnc": [1, 1, 720, NAN, NAN, NAN],
        "lac": [1234, 1234, NAN, NAN, NAN, NAN],
        "ci": [5678, 5678, 9751830, NAN, NAN, NAN],
    }
    for name, values in expected.items():
        assert found[name].tolist() == pytest.approx(values, abs=1e-6, nan_ok=True), name


def test_a_network_in_one_number_is_three_digits_and_the_rest():
    number = np.array([999.0, 1000, 9999, 10_000, 26_201, 99_999, 100_000, 310_410, 26_201])
    mnc = np.array([NAN] * 8 + [2.0])
    found = _networks(number, mnc)
    mcc = [999, 100, 999, 100, 262, 999, 100, 310, 26_201]
    assert found["mcc"].tolist() == mcc
    rest = [NAN, 0, 9, 0, 1, 99, 0, 410, 2]
    assert found["mnc"].tolist() == pytest.approx(rest, abs=1e-6, nan_ok=True)


def test_an_identity_of_lte_is_256_times_the_node_and_its_cell(read):
    """TS 36.413: 20 bits of the eNB ID and 8 of the cell."""
    node = [1, 1, 1, 0, 2**20 - 1, 5, 5, 5, 5, 5]
    sector = [0, 255, 256, 3, 254, NAN, NAN, NAN, 3, 3]
    own = [NAN, NAN, NAN, NAN, NAN, 255, 256, 0, 255, 256]
    radio = read(enodeb=node, sector=sector, cellid=own)
    expected = [256, 511, NAN, NAN, 2**28 - 2, 5 * 256 + 255, 256, 5 * 256, 5 * 256 + 3, 256]
    assert radio["ci"].tolist() == pytest.approx(expected, abs=1e-6, nan_ok=True)


def test_a_small_number_of_a_cell_gives_way_to_a_whole_identity_alone(read):
    radio = read(cid=[255, 256, 3, 0], eci=[256, 512, 255, 70_000])
    assert radio["ci"].tolist() == [256, 256, 3, 70_000]


def test_half_of_different_numbers_with_letters_are_hexadecimal(read):
    assert read(cid=["10", "11", "1A", "1B"])["ci"].tolist() == [16, 17, 26, 27]
    fewer = read(cid=["10", "11", "12", "13", "1A"])["ci"].tolist()
    assert fewer == pytest.approx([10, 11, 12, 13, NAN], abs=1e-6, nan_ok=True)


def test_a_level_with_a_known_cell_serves_unless_it_is_stated_otherwise(read):
    radio = read(cid=[7, 7, 7, NAN, NAN], role=["", "n", "s", "", "1"])
    expected = ["serving", "neighbour", "serving", "neighbour", "serving"]
    assert radio["role"].tolist() == expected


def gnettrack(rows, names="Node CellID LACHEX NetworkMode Level ARFCN PSC TA Operator Speed"):
    head = ["Timestamp", "Longitude", "Latitude", *names.split()]
    lines = [
        "\t".join([f"2026.05.01_10.00.{i:02d}", f"24.94{i}", "60.17", *row.split("|")])
        for i, row in enumerate(rows)
    ]
    return "\n".join(["\t".join(head), *lines]) + "\n"


def test_cells_of_gnettrack(tmp_path):
    path = tmp_path / "walk.txt"
    rows = [
        "401|141|1A2B|LTE|-81|1300|435|3|24491|36",
        "0|7|0|LTE|-82|1300|436|0|310410|0",
        "12|117|ffff|GSM|-83|61|42|63|2449|18",
        "401|255|FFFE|LTE|-84|1300|503|1282|24405|3.6",
    ]
    path.write_text(gnettrack(rows))
    found = read_recording(path).tables
    radio = found["radio"]
    assert radio["ci"].tolist() == [401 * 256 + 141, 7, 117, 401 * 256 + 255]
    assert radio["lac"].tolist() == [0x1A2B, 0, 65_535, 65_534]
    assert radio["mcc"].tolist() == pytest.approx([244, 310, NAN, 244], abs=1e-6, nan_ok=True)
    assert radio["mnc"].tolist() == pytest.approx([91, 410, NAN, 5], abs=1e-6, nan_ok=True)
    assert radio["timing_advance"].tolist() == [3, 0, 63, 1282]
    assert radio["arfcn"].tolist() == [1300, 1300, 61, 1300]
    assert radio["bsic"].tolist() == [435, 436, 42, 503]
    assert radio["level_dbm"].tolist() == [-81, -82, -83, -84]
    # Speeds are km/h.
    assert found["positions"]["speed_mps"].tolist() == pytest.approx([10, 0, 5, 1])


def test_a_cell_of_gnettrack_without_node_and_identity_has_none(tmp_path):
    path = tmp_path / "walk.txt"
    names = "Node CellID RAWCELLID NetworkMode Level"
    path.write_text(gnettrack(["0|7|-|LTE|-81", "1|7|-|LTE|-82", "1|7|300|LTE|-83"], names))
    found = read_recording(path).tables["radio"]["ci"].tolist()
    assert found == pytest.approx([NAN, 263, 300], abs=1e-6, nan_ok=True)


def test_neighbours_of_gnettrack_up_to_the_eighteenth(tmp_path):
    path = tmp_path / "walk.txt"
    names = "Node CellID NetworkMode Level" + "".join(
        f" NTech{i} NCell{i} NARFCN{i} NRxLev{i}" for i in (1, 18, 19)
    )
    row = "401|141|LTE|-81|4G|100|1300|-91|2G|17|61|-95|4G|102|1300|-99"
    path.write_text(gnettrack([row], names))
    radio = read_recording(path).tables["radio"]
    other = radio[radio["role"] == "neighbour"]
    columns = ["technology", "bsic", "arfcn", "level_dbm"]
    assert other[columns].to_numpy().tolist() == [["LTE", 100, 1300, -91], ["GSM", 17, 61, -95]]


def test_identities_of_lte_in_tems(tmp_path):
    names = ["Time", "EQ", "Message Type"]
    names += [f"All-Serving Cell {name}[1]" for name in ("DL EARFCN", "Identity", "RSRP (dBm)")]
    names += [f"All-Cell Identity ({part} Part)" for part in ("eNB", "Cell")]
    parts = [(457, 0), (457, 255), (457, 256), (0, 0), (2**20 - 1, 254)]
    lines = ["\t".join(names)]
    for i, (node, cell) in enumerate(parts):
        lines.append(f"10:00:0{i}.500\tEQ1\tML1\t1300\t{100 + i}\t-8{i}.5\t{node}\t{cell}")
    path = tmp_path / "drive.txt"
    path.write_text("\n".join(lines) + "\n")
    radio = read_recording(path).tables["radio"]
    expected = [116_992, 117_247, NAN, 0, 2**28 - 2]
    assert radio["ci"].tolist() == pytest.approx(expected, abs=1e-6, nan_ok=True)
    assert radio["level_dbm"].tolist() == [-80.5, -81.5, -82.5, -83.5, -84.5]
    assert radio["bsic"].tolist() == [100, 101, 102, 103, 104]
    assert radio["time_s"].tolist() == [36_000.5 + i for i in range(5)]


def test_levels_of_gsm_in_tems_are_sub_and_else_full(tmp_path):
    names = ["Time", "MS", "Message Type", "All-LAC", "All-Cell Id", "All-BSIC (Num)"]
    names += ["All-ARFCN BCCH", "All-RxLev Sub (dBm)", "All-RxLev Full (dBm)"]
    lines = ["\t".join(names)]
    for i, (sub, full) in enumerate([("-70", "-60"), ("", "-61"), ("-72", ""), ("", "")]):
        lines.append(f"10:00:0{i}.000\tMS1\tReport\t3021\t{117 + i}\t42\t61\t{sub}\t{full}")
    path = tmp_path / "drive.txt"
    path.write_text("\n".join(lines) + "\n")
    radio = read_recording(path).tables["radio"]
    assert radio["level_dbm"].tolist() == [-70, -61, -72]
    assert radio["cell"].tolist() == ["3021-117", "3021-118", "3021-119"]
