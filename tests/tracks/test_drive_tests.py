"""Drive tests of Nemo and TEMS: cells by system, identities, midnights, and damaged lines."""

import numpy as np
import pandas as pd
import pytest
from made_drive_tests import COUNT
from made_recordings import LEVEL_DBM, MADE, START_UTC_S

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import events
from mapfilter.tracks.readers.texts import lines as line_reader

START = '#START,23:59:58.000,,"1.5.2026"\n'
LTE = "CELLMEAS,{at},,7,0,1,9,0,70001,1300,435,-60.6,-89.1,-10.1,302060,118.0\n"


@pytest.fixture
def read(tmp_path):
    def of(text, name="", zone=""):
        path = tmp_path / "drive.txt"
        path.write_text(text)
        return read_recording(path, name, ReadOptions(zone=zone))

    return of


def cells(recording, technology):
    rows = recording.tables["radio"]
    return rows[rows["technology"] == technology].reset_index(drop=True)


def test_nemo_cells_by_system(read):
    recording = read(MADE["nemo"][1], zone="+03:00")
    assert recording.program == "Nemo Outdoor 7.8.0.8"
    lte = cells(recording, "LTE")
    serving = lte[lte["role"] == "serving"]
    assert serving["cell"].unique().tolist() == ["244-91-174-117025"]
    assert serving["level_dbm"].tolist() == pytest.approx(LEVEL_DBM - 0.5)
    assert serving[["arfcn", "bsic"]].drop_duplicates().to_numpy().tolist() == [[1300, 435]]
    other = lte[lte["role"] == "neighbour"]
    assert other["bsic"].unique().tolist() == [365]
    assert other["cell"].isna().all()
    umts = cells(recording, "UMTS")
    assert umts["role"].value_counts().to_dict() == {"serving": 10, "neighbour": 10}
    assert umts["cell"].dropna().unique().tolist() == ["244-91-3021-4464"]
    gsm = cells(recording, "GSM")
    assert gsm["cell"].dropna().unique().tolist() == ["244-91-3021-117"]
    # RxLev sub where it is given, as of the serving cell.
    assert gsm["level_dbm"].tolist() == [
        level for i in range(1, COUNT, 3) for level in (LEVEL_DBM[i] + 1, LEVEL_DBM[i] - 7)
    ]
    assert cells(recording, "WIFI")["cell"].unique().tolist() == ["0a:74:9c:2e:af:01"]
    positions = recording.tables["positions"]
    assert positions["speed_mps"].to_numpy() == pytest.approx(8 / 3.6)
    assert positions["time_s"].iloc[0] == START_UTC_S + 0.25


def test_a_nemo_identity_is_of_the_cell_that_has_it(read):
    at = "CELLMEAS,00:00:01.000,,7,0,1,9,0,70001,1300,436,-60.6,-89.1,-10.1,,\n"
    text = MADE["nemo"][1].replace("PRODUCT", "PRODUCT", 1)
    head = text[: text.index("GPS,")]
    assert cells(read(head + at), "LTE")["cell"].isna().all()
    chi = "CHI,00:00:00.500,,7,70001,2,25,1300,436,9,174\n"
    assert cells(read(head + chi + at), "LTE")["cell"].tolist() == ["244-91-174-9"]
    # The active set of a call in UMTS changes without a word.
    umts = "CELLMEAS,00:00:01.000,,5,0,0,3,1,7,0,50001,10588,24,-11.0,,-80\n"
    assert cells(read(head + umts), "UMTS")["cell"].tolist() == ["244-91-3021-4464"]
    call = "CHI,00:00:00.500,,5,50001,5,10588,4464,3021\n"
    assert cells(read(head + call + umts), "UMTS")["cell"].isna().all()
    two = "CELLMEAS,00:00:01.000,,5,0,0,3,2,7,0,50001,10588,24,-11.0,,-80,"
    two += "0,50001,10588,25,-11.0,,-82\n"
    rows = cells(read(head + two), "UMTS")
    assert rows["cell"].isna().all()
    assert rows["role"].tolist() == ["serving", "neighbour"]


def test_nemo_times_pass_midnight(read):
    text = START + "".join(LTE.format(at=at) for at in ("23:59:59.500", "00:00:00.500"))
    time_s = read(text, zone="UTC").tables["radio"]["time_s"]
    midnight_s = pd.Timestamp("2026-05-02", tz="UTC").timestamp()
    assert (time_s - midnight_s).tolist() == [-0.5, 0.5]
    undated = read(text.replace('"1.5.2026"', '""'))
    assert undated.clock.kind == "monotonic"
    assert np.diff(undated.tables["radio"]["time_s"]).tolist() == [1.0]
    assert any("no date" in note for note in undated.notes)


def test_nemo_contexts_and_header_parameters_move_places(read):
    plain = LTE.format(at="13:00:00.000")
    moved = plain.replace(",,7,0,1,9,", ",2,11,12,7,1,99,1,9,")
    expected = read(START + plain).tables["radio"]
    assert read(START + moved).tables["radio"].equals(expected)


def test_bad_nemo_lines_are_counted_and_located(read):
    good = "".join(LTE.format(at=f"13:00:0{i}.000") for i in range(5))
    bad = [
        LTE.format(at="13:00:05.000").rpartition(",")[0].rpartition(",")[0] + "\n",
        LTE.format(at="13:61:05.000"),
        LTE.format(at="13:00:05.000").replace(",1,9,", ",,9,"),
        "a line of another program\n",
        "GPS,13:00:05.000,,24.94,160.17,13\n",
    ]
    recording = read(START + good + "".join(bad) + good.replace("13:00", "13:01"))
    assert len(recording.tables["radio"]) == 10
    found = {line: unusable.reason for unusable in recording.unusable for line in unusable.lines}
    assert set(found) == {7, 8, 9, 10, 11}
    assert "cut off" in found[7]
    assert "time_s" in found[8]
    assert "numbers of cells" in found[9]
    assert "no line of this format" in found[10]
    assert "latitude and longitude swapped" in found[11]


def test_what_nemo_events_are_not_read_is_told(read):
    other = "OFDMSCAN,13:00:00.000,,7,1\nCELLMEAS,13:00:00.000,,9,0,1,9\nRRCSM,13:00:00.000,,7\n"
    notes = read(START + LTE.format(at="13:00:00.000") + other).notes
    assert "1 row of scanners is not read" in notes
    assert "1 CELLMEAS of other systems (NR, CDMA, …) is not read" in notes
    assert "1 event of 1 other kind is not used" in notes


@pytest.mark.parametrize("name", ["nemo", "tems", "tems/lte"])
@pytest.mark.parametrize("separator", [";", "\t", ","])
def test_other_separators_and_decimal_commas(name, separator, read):
    text = MADE[name][1].replace('"Shop, 2"', '"Shop"').replace('"Qualcomm, 1"', '"Qualcomm"')
    own = "," if name == "nemo" else "\t"
    plain = read(text).tables
    other = text.replace(own, separator)
    for table, rows in read(other).tables.items():
        assert rows.equals(plain[table])
    if separator != ",":
        # Dates keep their points.
        commas = pd.Series(other.split("\n")).str.replace(
            r"(?<![\d.])(-?\d+)\.(\d+)(?![\d.])", r"\1,\2", regex=True
        )
        for table, rows in read("\n".join(commas)).tables.items():
            assert rows["time_s"].equals(plain[table]["time_s"])
            for column in rows:
                assert rows[column].equals(plain[table][column]), column


@pytest.mark.parametrize("name", ["tems", "tems/lte"])
def test_swapped_columns_change_nothing(name, read):
    text = MADE[name][1]
    turned = "\n".join("\t".join(reversed(line.split("\t"))) for line in text.splitlines())
    plain = read(text).tables
    for table, rows in read(turned).tables.items():
        assert rows.equals(plain[table])


def test_nemo_is_read_block_by_block(read, monkeypatch):
    text = MADE["nemo"][1]
    whole = read(text)
    monkeypatch.setattr(line_reader, "_BLOCK_BYTES", 300)
    parts = read(text)
    assert parts.notes == whole.notes
    for table, rows in whole.tables.items():
        same = ["time_s", "level_dbm", "lat_deg"]
        keys = [name for name in same if name in rows]
        one, other = (
            of.sort_values(keys).reset_index(drop=True) for of in (rows, parts.tables[table])
        )
        assert other.equals(one)


def test_quoted_separators_do_not_separate():
    block = b'A,"x,y",1\nB,"never closed,2\nC,3,4'
    assert events._lines(block, ",").to_pylist() == ['A,"x y",1', 'B,"never closed 2', "C,3,4"]


def test_tems_cells(read):
    recording = read(MADE["tems"][1], zone="+03:00")
    rows = recording.tables["radio"]
    serving = rows[rows["role"] == "serving"]
    assert serving["technology"].unique().tolist() == ["GSM"]
    assert serving["cell"].tolist() == [f"3021-1170{i // 10}" for i in range(COUNT)]
    assert serving["level_dbm"].tolist() == LEVEL_DBM.tolist()
    assert serving["time_s"].iloc[0] == START_UTC_S + 0.5
    other = rows[rows["role"] == "neighbour"]
    assert other["cell"].unique().tolist() == ["3021-4464"]
    assert other[["arfcn", "bsic"]].drop_duplicates().to_numpy().tolist() == [[77, 13]]


def test_a_tems_identity_holds_while_carrier_and_pci_do(read):
    text = MADE["tems/lte"][1]
    lines = text.splitlines()
    for i in range(12, 20):
        lines[3 + i] = lines[3 + i].replace("\t435\t", "\t436\t")
    rows = read("\n".join(lines)).tables["radio"]
    serving = rows[rows["role"] == "serving"]
    identity = 457 * 256 + 33
    assert serving["bsic"].iloc[[0, 12, 20]].tolist() == [435, 436, 435]
    assert serving["ci"].iloc[:12].unique().tolist() == [identity]
    assert serving["ci"].iloc[12:].isna().all()


def test_tems_times_of_day_count_on_over_midnight(read):
    text = MADE["tems/lte"][1].replace("13:00:0", "23:59:5").replace("13:00:1", "00:00:0")
    recording = read("\n".join(text.splitlines()[:13]))
    assert recording.clock.kind == "monotonic"
    assert np.diff(recording.tables["positions"]["time_s"]).tolist() == [2.0] * 9
    assert any("without a date" in note for note in recording.notes)


def test_an_export_without_cells_and_positions_is_no_recording(read):
    text = "Time\tMS\tMessage Type\tAll-LAC\n" + "13:00:00\tMS1\tPaging\t3021\n" * 3
    with pytest.raises(InputError, match="usable row of tems"):
        read(text)


def test_a_column_map_goes_before_the_names_of_tems(tmp_path):
    path = tmp_path / "drive.txt"
    path.write_text(MADE["tems"][1].replace("01/05/2026", "2026-05-01"))
    own = {"time": "Timestamp", "lat_deg": "All-Latitude", "lon_deg": "All-Longitude"}
    assert read_recording(path, options=ReadOptions(columns=own)).format == "csv"
    other = {"time": "Zeit", "lat_deg": "Breite"}
    assert read_recording(path, options=ReadOptions(columns=other)).format == "tems"


def test_nemo_times_are_utc_where_the_log_states_its_offset(read):
    ahead = '#UT,,,180,180\n#START,23:59:58.000,,"1.5.2026"\n'
    recording = read(ahead + LTE.format(at="23:59:59.500"), zone="Asia/Tokyo")
    assert recording.clock.kind == "utc"
    moment = pd.Timestamp("2026-05-01T20:59:59.5Z").timestamp()
    assert recording.tables["radio"]["time_s"].tolist() == [moment]
    assert "local times are those of UTC+3, by #UT" in recording.notes
    # Of an offset of more than 14 hours nothing is known.
    assert read(ahead.replace("180", "1440") + LTE.format(at="13:00:00.0")).clock.kind == "local"


def test_a_nemo_position_without_fix_is_left_out(read):
    lines = [
        f"GPS,13:00:0{i}.000,,24.94,60.17,13,0,{fix},{satellites},1\n"
        for i, (fix, satellites) in enumerate([(1, 9), (0, 0), (0, ""), (0, 5), ("", "")])
    ]
    recording = read(START + "".join(lines))
    assert (recording.tables["positions"]["time_s"] % 60).tolist() == [0, 3, 4]
    assert [(one.reason, one.lines) for one in recording.unusable] == [
        ("positions: no fix and no satellites", (3, 4))
    ]


def test_tems_rows_that_repeat_the_row_before_are_read_once_a_second(read):
    head, first, *_ = MADE["tems"][1].splitlines()
    clock = first.split("\t")[0]
    day = clock.split(" ")[0]

    def row(at, level):
        return first.replace(clock, f"{day} 13:00:{at}").replace("\t-", f"\t-{level}", 1)

    levels = [("00.0", 7), ("00.2", 7), ("00.9", 7), ("01.1", 7), ("01.2", 8), ("01.3", 7)]
    recording = read("\n".join([head, *(row(*one) for one in levels)]))
    radio = recording.tables["radio"]
    serving = radio[radio["role"] == "serving"]
    assert (serving["time_s"] % 60).round(1).tolist() == [0.0, 1.1, 1.2, 1.3]
    assert len(radio) == 2 * len(serving)
    assert recording.unusable[0].lines == (3, 4)
