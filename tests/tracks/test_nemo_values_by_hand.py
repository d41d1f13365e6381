"""Places and units of the parameters of Nemo logs, and the ends of their counts, by hand."""

from datetime import UTC, datetime

import numpy as np
import pytest

from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.nemo import _ahead_s, _midnight_s

START = '#START,13:00:00.000,,"1.5.2026"'
AT = "13:00:0{}.000"
DAY_S = datetime(2026, 5, 1, tzinfo=UTC).timestamp()
NAN = np.nan


@pytest.fixture
def read(tmp_path):
    def of(*lines, zone="UTC"):
        (tmp_path / "drive.nmf").write_text("\n".join([START, *lines]) + "\n")
        return read_recording(tmp_path / "drive.nmf", options=ReadOptions(zone=zone))

    return of


def cells(system, *parameters, second=0, headers=()):
    """Return a CELLMEAS whose cells have the same number of parameters."""
    counts = [len(headers), *headers, len(parameters), len(parameters[0])]
    words = [system, *counts, *(one for some in parameters for one in some)]
    return f"CELLMEAS,{AT.format(second)},," + ",".join(map(str, words))


def rows_of(recording):
    return recording.tables["radio"].to_dict("records")


@pytest.mark.parametrize("context", ["", "1,77", "3,77,78,79"])
def test_a_position_of_gps_after_any_context(read, context):
    """Longitude, latitude, height, distance, fix, satellites, speed in km/h."""
    position = f"GPS,{AT.format(1)},{context},24.94,60.17,13.5,250,1,9,36,2.0"
    (row,) = read(position).tables["positions"].to_dict("records")
    assert (row["lat_deg"], row["lon_deg"], row["altitude_m"]) == (60.17, 24.94, 13.5)
    assert row["speed_mps"] == pytest.approx(10.0)
    assert row["time_s"] == DAY_S + 13 * 3600 + 1


@pytest.mark.parametrize(
    ("fix", "satellites", "is_used"),
    [("0", "0", False), ("0", "1", True), ("1", "0", True), ("", "0", True), ("0", "", False)],
)
def test_a_position_without_fix_and_satellites_is_none(read, fix, satellites, is_used):
    lines = [f"GPS,{AT.format(i)},,24.94,60.17,13,0,{a},{b},8" for i, (a, b) in
             enumerate([("1", "9"), (fix, satellites)])]  # fmt: skip
    assert len(read(*lines).tables["positions"]) == 1 + is_used


def test_cells_of_lte_by_place(read):
    """Kind (0 serves), band, carrier, PCI, RSSI, RSRP, RSRQ; systems 7 (FDD) and 8 (TDD)."""
    serving = [0, 70001, 1300, 435, -60.6, -89.1, -10.1]
    other = [1, 70001, 1300, 436, -61.0, -95.5, -12.0]
    for system in (7, 8):
        one, two = rows_of(read(cells(system, serving, other, headers=(5, 6))))
        assert (one["role"], two["role"]) == ("serving", "neighbour")
        assert (one["arfcn"], one["bsic"], one["level_dbm"]) == (1300, 435, -89.1)
        assert (two["arfcn"], two["bsic"], two["level_dbm"]) == (1300, 436, -95.5)
        assert one["technology"] == two["technology"] == "LTE"


def test_cells_of_gsm_by_place(read):
    """Kind (1 serves), band, ARFCN, BSIC, RxLev full and sub, six others, CI, LAC."""
    six = [20, 20, "", "", "", ""]
    serving = [1, 10900, 61, 42, -70, -72, *six, 117, 3021]
    other = [0, 10900, 77, 13, -80, "", *six, 118, 3022]
    network = f"SEI,{AT.format(0)},,1,1,3021,244,91"
    one, two = rows_of(read(network, cells(1, serving, other, second=1)))
    assert (one["role"], one["cell"], one["level_dbm"]) == ("serving", "244-91-3021-117", -72)
    assert (one["arfcn"], one["bsic"]) == (61, 42)
    # A neighbour's identity is not that of a cell that serves.
    assert (two["role"], two["level_dbm"], two["bsic"]) == ("neighbour", -80, 13)
    assert np.isnan(two["ci"])


def test_cells_of_umts_after_their_channels(read):
    """Two channels of three parameters; kind (0 of the active set), band, UARFCN, PSC, Ec/N0,
    STTD, RSCP.
    """
    one = "0,50001,10588,24,-11.0,0,-80.5"
    other = "1,50001,10588,248,-12.0,0,-85.5"
    channels = "2,3,10588,-69.6,50001,10612,-70.1,50001"
    line = f"CELLMEAS,{AT.format(1)},,5,0,{channels},2,7,{one},{other}"
    first, second = rows_of(read(line))
    assert (first["role"], first["bsic"], first["level_dbm"]) == ("serving", 24, -80.5)
    assert (second["role"], second["bsic"], second["level_dbm"]) == ("neighbour", 248, -85.5)
    assert first["arfcn"] == second["arfcn"] == 10_588


def test_access_points_by_place(read):
    """Kind, band, quality, channel, RSSI, SSID, MAC; one of zeros is none."""
    point = [1, 200001, "", 1, -55, "Shop", "0a:74:9c:2e:af:01"]
    none = [0, 200001, "", 6, -60, "x", "00:00:00:00:00:00"]
    (row,) = rows_of(read(cells(20, point, none)))
    assert (row["cell"], row["level_dbm"], row["role"]) == ("0a:74:9c:2e:af:01", -55, "neighbour")
    assert row["technology"] == "WIFI"


LTE_CELL = [0, 70001, 1300, 435, -60.6, -89.1, -10.1]
UMTS_CELL = "0,50001,10588,24,-11.0,0,-80.5"


@pytest.mark.parametrize(
    ("network", "identity", "line", "cell"),
    [
        # CHI of LTE: system, band, state, bandwidth, carrier, PCI, identity, TAC.
        ("7,1,,244,91", "7,70001,2,25,1300,435,117025,174", "lte", "244-91-174-117025"),
        ("7,1,,244,91", "7,70001,2,25,1300,436,117025,174", "lte", None),
        ("7,1,,244,91", "7,70001,2,25,1300,434,117025,174", "lte", None),
        ("7,1,,244,91", "7,70001,2,25,1301,435,117025,174", "lte", None),
        ("7,1,,244,91", "7,70001,2,25,1299,435,117025,174", "lte", None),
        # Of UMTS: system, band, state (5 is a call), carrier, identity, LAC.
        ("5,1,3021,244,91", "5,50001,1,10588,4464,3021", "umts", "244-91-3021-4464"),
        ("5,1,3021,244,91", "5,50001,5,10588,4464,3021", "umts", None),
        ("5,1,3021,244,91", "5,50001,4,10588,4464,3021", "umts", "244-91-3021-4464"),
        ("5,1,3021,244,91", "5,50001,1,10589,4464,3021", "umts", None),
        # The network of another system is not that of the cell.
        ("5,1,3021,244,91", "7,70001,2,25,1300,435,117025,174", "lte", "174-117025"),
        ("7,1,,,91", "7,70001,2,25,1300,435,117025,174", "lte", "174-117025"),
    ],
)
def test_identities_that_events_state(read, network, identity, line, cell):
    measured = cells(7, LTE_CELL, second=3)
    if line == "umts":
        measured = f"CELLMEAS,{AT.format(3)},,5,0,0,3,1,7,{UMTS_CELL}"
    events = [f"SEI,{AT.format(1)},1,9,{network}", f"CHI,{AT.format(2)},1,9,{identity}"]
    (row,) = rows_of(read(*events, measured))
    assert row["cell"] == cell or (cell is None and row["cell"] != row["cell"])


def test_an_identity_holds_from_its_event_on(read):
    def chi(second, ci):
        return f"CHI,{AT.format(second)},,7,70001,2,25,1300,435,{ci},174"

    lines = [cells(7, LTE_CELL, second=0), chi(1, 5), cells(7, LTE_CELL, second=2), chi(3, 6)]
    found = rows_of(read(*lines, cells(7, LTE_CELL, second=4)))
    assert [one["ci"] for one in found] == pytest.approx([NAN, 5, 6], abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(("count", "kept"), [(500, 500), (501, 0)])
def test_more_than_500_cells_are_a_damaged_count(read, count, kept):
    many = [[1, 70001, 1300, i % 504, -60.6, -70.0 - i / 10, -10.1] for i in range(count)]
    found = read(cells(7, *many, second=1), cells(7, LTE_CELL, second=2))
    assert len(found.tables["radio"]) == kept + 1


@pytest.mark.parametrize(("count", "is_read"), [(64, True), (65, False)])
def test_more_than_64_parameters_are_a_damaged_count(read, count, is_read):
    for line in (
        cells(7, [*LTE_CELL, *[0] * (count - 7)], second=1),
        cells(7, LTE_CELL, second=1, headers=[0] * count),
    ):
        found = read(line, cells(7, LTE_CELL, second=2))
        assert len(found.tables["radio"]) == 1 + is_read


def test_the_last_field_of_a_cell_may_be_the_last_of_its_line(read):
    line = cells(7, LTE_CELL, second=1)
    found = read(line, line.rpartition(",")[0], cells(7, LTE_CELL, second=2))
    assert len(found.tables["radio"]) == 2
    assert [one.lines for one in found.unusable] == [(3,)]


@pytest.mark.parametrize(
    ("minutes", "ahead_s"),
    [("420", 25_200), ("-210", -12_600), ("+60", 3600), ("0", 0), ("840", 50_400), ("841", None)],
)
def test_minutes_ahead_of_utc_are_14_hours_at_most(read, minutes, ahead_s):
    found = _ahead_s(f"#UT,13:00:00.000,,{minutes}")
    assert found == ahead_s
    assert _ahead_s(f"#UT,13:00:00.000,,-{minutes.lstrip('+-')}") == (
        None if ahead_s is None else -abs(ahead_s)
    )
    recording = read(f"#UT,13:00:00.000,,{minutes}", cells(7, LTE_CELL), zone="")
    expected_s = DAY_S + 13 * 3600 - (ahead_s or 0)
    assert recording.tables["radio"]["time_s"].tolist() == [expected_s]
    assert recording.clock.kind == ("local" if ahead_s is None else "utc")


@pytest.mark.parametrize(
    ("date", "moment"),
    [("1.5.2026", (2026, 5, 1)), ("31.12.2018", (2018, 12, 31)), ("31.2.2018", None), ("", None)],
)
def test_days_of_a_start_come_before_months(date, moment):
    expected = None if moment is None else datetime(*moment, tzinfo=UTC).timestamp()
    assert _midnight_s(f'#START,13:00:00.000,,"{date}"') == expected
