"""Values of recordings: units, codes, identities, and what programs get wrong."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_recordings import COUNT, LEVEL_DBM, MADE, gnettrack
from made_satellites import nmea, sentence

from mapfilter.clocks.times import parse_times
from mapfilter.errors import InputError
from mapfilter.tracks.joining.combine import combine
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.recorded.recorded_values import duplicates


def test_cells_of_lte_keep_their_carriers_codes_and_identities(written):
    rows = read_recording(written("gnettrack")).tables["radio"]
    serving, neighbour = (rows[rows["role"] == role] for role in ("serving", "neighbour"))
    assert serving["cell"].unique().tolist() == ["244-91-2124-102764173"]
    assert serving["technology"].unique().tolist() == ["LTE"]
    assert serving["bsic"].unique().tolist() == [435.0]
    assert serving["level_dbm"].to_numpy() == pytest.approx(LEVEL_DBM)
    assert neighbour["arfcn"].unique().tolist() == [2850.0]
    assert neighbour["cell"].isna().all()


def test_levels_given_as_asu_become_dbm(written):
    recording = read_recording(written("opencellid/mls"))
    assert recording.tables["radio"]["level_dbm"].unique().tolist() == [-83.0]
    assert any("ASU" in note for note in recording.notes)


def test_a_bound_of_a_level_is_censored(written):
    rows = read_recording(written("antennas")).tables["radio"]
    assert rows[rows["role"] == "serving"]["censored"].unique().tolist() == [1.0]
    assert rows[rows["role"] == "neighbour"]["censored"].unique().tolist() == [0.0]


def test_pseudoranges_are_light_times(written):
    rows = read_recording(written("gnsslogger")).tables["satellites"]
    way_s = rows[rows["satellite"] == "G07"]["pseudorange_m"] / 299_792_458.0
    assert way_s.to_numpy() == pytest.approx(0.071, abs=1e-12)
    assert rows["sigma_m"].to_numpy() == pytest.approx(20e-9 * 299_792_458.0)


def test_bias_is_taken_off_sensors_that_are_not_calibrated(written):
    rows = read_recording(written("gnsslogger")).tables["accelerometer"]
    assert rows[["x_mps2", "y_mps2", "z_mps2"]].iloc[0].tolist() == pytest.approx([0.1, 0.2, 9.8])


def test_sensor_logger_axes_are_not_in_the_order_of_the_columns(written):
    rows = read_recording(written("sensorlogger")).tables["accelerometer"]
    assert rows[["x_mps2", "y_mps2", "z_mps2"]].iloc[0].tolist() == [0.2, 0.1, 9.7]


def test_accuracy_of_nmea_comes_from_gst(written):
    rows = read_recording(written("nmea")).tables["positions"]
    assert rows["accuracy_m"].to_numpy() == pytest.approx(1.515 * np.sqrt((9 + 16) / 2))
    assert rows["speed_mps"].to_numpy() == pytest.approx(2.2, abs=1e-3)


def test_nmea_passes_midnight_and_a_leap_second(written):
    place = "6010.20000,N,02456.40000,E"
    rows = [
        f"GPRMC,{clock},A,{place},4.2,30.0,{day},,,A"
        for clock, day in (
            ("235958.00", "311216"),
            ("235959.00", "311216"),
            ("235960.00", "311216"),
            ("000000.00", "010117"),
            ("000001.00", "010117"),
        )
    ]
    rows.insert(2, f"GPGGA,235959.50,{place},1,12,0.8,12.5,M,17.0,M,,")
    rows.insert(4, f"GPGGA,000000.50,{place},1,12,0.8,12.5,M,17.0,M,,")
    found = read_recording(written("nmea", "\r\n".join(map(sentence, rows)))).tables["positions"]
    new_year = 1_483_228_800.0
    assert (found["time_s"] - new_year).tolist() == [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0]


def test_wrong_checksums_are_left_out_unless_all_are(written):
    lines = nmea().split("\r\n")
    lines[4] = lines[4][:-2] + "00"
    recording = read_recording(written("nmea", "\r\n".join(lines)))
    assert [(u.reason, u.count, u.lines) for u in recording.unusable] == [
        ("checksum is wrong", 1, (5,))
    ]
    every = "\r\n".join(line[:-2] + "00" if "RMC" in line else line for line in lines)
    recording = read_recording(written("nmea", every))
    assert len(recording.tables["positions"]) == COUNT
    assert any("checksums are wrong; taken" in note for note in recording.notes)


def test_readings_that_a_program_repeats_are_left_out(written):
    head, *rows = gnettrack().splitlines()
    first = rows[0].split("\t")
    frozen = []
    for row in rows:
        fields = row.split("\t")
        frozen.append("\t".join([*fields[:3], *first[3:]]))
    recording = read_recording(written("gnettrack", "\n".join([head, *frozen])))
    assert len(recording.tables["positions"]) == COUNT
    assert len(recording.tables["radio"]) == 2
    assert recording.unusable[0].count == COUNT - 1
    assert "not renewed" in recording.unusable[0].reason


def test_of_several_network_codes_of_a_cell_the_commonest_is_taken(written):
    """Rows 1 to 4 have 244-05, row 5 none, and others 244-91; another cell has one code alone."""
    head, *rows = gnettrack().splitlines()
    for i in (1, 2, 3, 4, 20):
        rows[i] = rows[i].replace("\t24491\t", "\t24405\t")
    rows[5] = rows[5].replace("\t24491\t", "\t\t")
    rows[20] = rows[20].replace("102764173", "102764999")
    recording = read_recording(written("gnettrack", "\n".join([head, *rows])))
    radio = recording.tables["radio"]
    serving = radio[radio["role"] == "serving"]
    assert len(serving) == COUNT
    known = serving.groupby("ci")[["mcc", "mnc"]].agg(set)
    assert known.loc[102_764_173].tolist() == [{244}, {91}]
    assert known.loc[102_764_999].tolist() == [{244}, {5}]
    notes = [note for note in recording.notes if "network codes" in note]
    assert notes == ["radio: cell 102764173 with 2 network codes, 244-91 taken"]


def test_ephemerides_of_all_constellations_are_on_one_time(written):
    rows = read_recording(written("rinex-nav/3")).tables["ephemerides"]
    assert rows["satellite"].tolist() == ["G07", "E12", "C20"]
    assert rows["toe_s"].tolist() == [2416 * 604_800 + 468_000.0] * 3
    assert rows["toc_s"].tolist() == [2416 * 604_800 + 468_000.0] * 3
    recording = read_recording(written("rinex-nav/3"))
    assert recording.tables["ionosphere"].iloc[0].tolist()[:2] == [4.657e-9, 1.49e-8]
    assert recording.notes == ("1 message of GLONASS, SBAS or NavIC is not used",)


@pytest.mark.parametrize("coefficient", ["            ", "  4.657*D-09"])
def test_an_ionosphere_of_which_a_coefficient_is_missing_is_none(written, coefficient):
    text = MADE["rinex-nav/3"][1].replace("  4.6570D-09", coefficient)
    recording = read_recording(written("rinex-nav/3", text))
    assert set(recording.tables) == {"ephemerides"}
    assert recording.unusable == ()


def test_what_is_no_whole_number_is_missing(written):
    text = MADE["opencellid"][1]
    for i, word in enumerate(("1170250.0", "+1170250", "7.0.0", "1_0", "9" * 25)):
        lines = text.splitlines()
        lines[i + 1] = lines[i + 1].replace("1170250", word)
        text = "\n".join(lines)
    recording = read_recording(written("opencellid", text))
    cells = recording.tables["radio"]["ci"].iloc[:6].tolist()
    assert cells[:2] == [1170250.0, 1170250.0]
    assert np.isnan(cells[2:5]).all()
    assert cells[5] == 1170250.0
    assert any("3 values are no numbers" in note for note in recording.notes)


def test_a_damaged_nanosecond_loses_only_its_row(written):
    lines = MADE["gnsslogger"][1].splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("Raw,"))
    lines[at] = lines[at].replace(",,,-", ",,,-x")
    recording = read_recording(written("gnsslogger", "\n".join(lines)))
    assert len(recording.tables["satellites"]) == 2 * COUNT - 1
    assert recording.unusable[0].reason == "Raw: a time is missing"
    assert recording.unusable[0].lines == (at + 1,)


@pytest.mark.parametrize(("state", "is_decoded"), [(8, True), (16384, True), (39, False)])
def test_a_satellite_whose_time_is_not_decoded_has_no_pseudorange(written, state, is_decoded):
    """Bit 3 is of a decoded time of the week, bit 14 of one that is known otherwise."""
    lines = MADE["gnsslogger"][1].splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("Raw,"))
    lines[at] = lines[at].replace(",16431,", f",{state},")
    recording = read_recording(written("gnsslogger", "\n".join(lines)))
    assert len(recording.tables["satellites"]) == 2 * COUNT - (not is_decoded)
    refused = [] if is_decoded else [("Raw: the satellite's time is not decoded", (at + 1,))]
    assert [(one.reason, one.lines) for one in recording.unusable] == refused


def test_bars_are_levels_of_their_technology(tmp_path):
    path = tmp_path / "bars.csv"
    path.write_text(
        "time,ci,technology,bars,rsrp\n"
        "1777629600,7,LTE,0,\n1777629601,7,LTE,1,\n1777629602,7,LTE,4,\n"
        "1777629603,7,GSM,2,\n1777629604,7,,3,\n1777629605,7,LTE,3,-91\n1777629606,7,NR,9,\n"
    )
    radio = read_recording(path).tables["radio"]
    assert radio["level_dbm"].tolist()[:6] == [-115, -110, -85, -100, -90, -91]
    assert np.isnan(radio["level_dbm"].iloc[6])
    assert radio["level_step_db"].fillna(-1).tolist() == [0, 10, 0, 6, 10, -1, -1]
    assert radio["censored"].fillna(0).tolist() == [-1, 0, 1, 0, 0, 0, 0]


def test_compass_and_turn_degrees(tmp_path):
    path = tmp_path / "walk.csv"
    path.write_text(
        "time,step_m,compass_deg,turn_deg\n1777629600,0.7,90,0\n1777629601,0.7,0,90\n"
        "1777629602,0.7,400,-180\n"
    )
    motion = combine([read_recording(path)]).log.motion
    assert motion["heading_rad"].tolist()[:2] == pytest.approx([0.0, np.pi / 2])
    assert np.isnan(motion["heading_rad"].iloc[2])
    assert motion["turn_rad"].tolist() == pytest.approx([0.0, np.pi / 2, -np.pi])


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([0.0, -0.0, 1.0, np.nan, -np.nan]),
            st.sampled_from(["a", "b", None]),
            st.sampled_from([2.0, 3.0]),
        ),
        max_size=30,
    )
)
def test_duplicates_are_those_of_pandas(rows):
    table = pd.DataFrame(rows, columns=["x", "word", "y"])
    table["word"] = pd.Categorical(table["word"], categories=["a", "b"])
    table = table.astype({"x": float, "y": float})
    assert duplicates(table).tolist() == table.duplicated().tolist()


TIMES = [
    ["2026-05-01T10:00:00.000Z", "2026-05-01 10:00:00.123456+02:00"],
    ["2026-05-01T10:00:00", " 2026-05-01 10:00:01.5 "],
    ["2026-05-01", "2026-05-02"],
    ["1850-01-01T00:00:00", "2026-05-01T00:00:00"],
    ["2026-05-01T10:00:60Z", "2026-05-01T10:00:00Z"],
    ["2026-05-01T10:00:00Z", "2026-05-01T10:00:00"],
    ["2026-05-01T10:00Z", "2026-13-01T10:00Z"],
    ["2026-05-01T10:00:00Z", ""],
    ["2026-05-01 10:00:00+03", "2026-05-01T10:00:01.5-03"],
    ["2026-05-01 10:00:00 +03", ""],
]


@pytest.mark.parametrize("texts", TIMES)
@pytest.mark.parametrize("zone", ["", "Europe/Brussels"])
def test_plain_times_are_those_of_the_slow_reader(texts, zone, tmp_path):
    path = tmp_path / "times.csv"
    rows = [f'"{text}",60.17{i},24.94' for i, text in enumerate(texts)]
    path.write_text("\n".join(["time,lat,lon", *rows]))
    expected, zoned = parse_times(np.array(texts, dtype=object), zone)
    try:
        found = read_recording(path, "csv", ReadOptions(zone))
    except InputError:
        assert not np.isfinite(expected).any()
        return
    known = np.sort(expected[np.isfinite(expected)])
    assert found.tables["positions"]["time_s"].to_numpy() == pytest.approx(known, abs=1e-6)
    assert found.clock.absolute == zoned


def test_places_of_satellites_are_those_at_the_moment_of_reception(written):
    rows = read_recording(written("smartloc")).tables["satellites"]
    sent = np.array([float(x) for x in MADE["smartloc"][1].splitlines()[1].split()[4:7]])
    first = rows.iloc[0]
    place = first[["x_m", "y_m", "z_m"]].to_numpy(dtype=float)
    receiver = np.array([2884500.0, 1341500.0, 5509900.0])
    # The effect of the earth's turn on the range, as receivers add it to the plain distance.
    sagnac_m = 7.2921151467e-5 * (sent[0] * receiver[1] - sent[1] * receiver[0]) / 299_792_458
    plain_m = np.linalg.norm(sent - receiver)
    assert np.linalg.norm(place - receiver) == pytest.approx(plain_m + sagnac_m, abs=0.3)
    assert abs(sagnac_m) > 5
    assert np.linalg.norm(place) == pytest.approx(np.linalg.norm(sent))


def test_a_quoted_separator_in_a_file_of_blanks(written):
    lines = MADE["smartloc"][1].splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("point3"))
    words = lines[at].split(" ")
    lines[at] = " ".join([*words[:8], '"', *words[9:]])
    lines[at + 1] += ' "a b"'
    whole = read_recording(written("smartloc")).tables
    found = read_recording(written("smartloc", "\n".join(lines))).tables
    for name, rows in whole.items():
        assert len(found[name]) >= len(rows) - 5, name


def test_an_older_log_of_gnettrack_has_no_raw_identity(written):
    lines = [line.split("\t") for line in gnettrack().splitlines()]
    at = lines[0].index("RAWCELLID")
    text = "\n".join("\t".join(line[:at] + line[at + 1 :]) for line in lines)
    rows = read_recording(written("gnettrack", text)).tables["radio"]
    serving = rows[rows["role"] == "serving"]
    # Base station 401, its cell 141; the network is LTE.
    assert set(serving["ci"]) == {401 * 256 + 141}


@pytest.mark.parametrize("mark", ["", "-", "2147483647"])
def test_a_row_of_gnettrack_without_a_raw_identity(written, mark):
    """Its cell had no identity."""
    rows = read_recording(written("gnettrack", gnettrack().replace("102764173", mark)))
    serving = rows.tables["radio"].query("role == 'serving'")
    assert len(serving) == COUNT
    assert set(serving["ci"]) == {401 * 256 + 141}


def test_a_cell_id_of_0_is_no_identity_for_gnettrack(written):
    text = gnettrack().replace("\t102764173\t", "\t0\t", 3)
    recording = read_recording(written("gnettrack", text))
    rows = recording.tables["radio"]
    serving = rows[rows["role"] == "serving"]
    assert len(serving) == COUNT
    assert serving["cell"].isna().sum() == 3
    assert serving["level_dbm"].notna().all()
    assert any("3 rows have a cell id of 0" in note for note in recording.notes)


@pytest.mark.parametrize("names", ["gyr_{}", "gyro_{}", "gyroscope{}", "gyro_{}_radps"])
def test_sensors_have_several_usual_names(names, tmp_path):
    head = ["time", "acc_x", "acc_y", "acc_z", *(names.format(axis) for axis in "xyz"), "mood"]
    rows = [[str(i / 50), "0.1", "0.2", "9.8", "0.01", "0.02", "0.03", "7"] for i in range(20)]
    path = tmp_path / "sensors.csv"
    path.write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n")
    recording = read_recording(path)
    assert recording.tables["gyroscope"][["x_radps", "y_radps", "z_radps"]].iloc[0].tolist() == [
        0.01, 0.02, 0.03,
    ]  # fmt: skip
    assert any("columns not used: mood" in note for note in recording.notes)
