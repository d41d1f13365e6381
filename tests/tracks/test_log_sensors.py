"""Raw sensors beside a log, and reports by technology."""

from decimal import Decimal

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mapfilter.errors import InputError, OutputError, StoreError
from mapfilter.positioning.log_options import LogStatement
from mapfilter.tracks.log import make_log
from mapfilter.tracks.sensors import SENSOR_COLUMNS, read_sensors
from mapfilter.tracks.store import read_log, write_log

UTM = "EPSG:32635"


@pytest.fixture
def log():
    return make_log(UTM, motion=pd.DataFrame({"time_s": [0.0, 1.0], "step_m": [1.0, 1.2]}))


@pytest.fixture
def sensors():
    return {
        name: pd.DataFrame({column: [0.5 * i, 0.5 * i + 1] for i, column in enumerate(columns)})
        for name, columns in SENSOR_COLUMNS.items()
    }


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_sensors_are_read_as_they_were_written(form, log, sensors, tmp_path):
    folder = tmp_path / "log"
    write_log(log, folder, form, sensors)
    found = read_sensors(folder)
    assert set(found) == set(sensors)
    for name, rows in sensors.items():
        pd.testing.assert_frame_equal(found[name], rows)
    assert read_log(folder).notes == ()
    write_log(log, folder, form, {})
    assert read_sensors(folder) == {}
    assert not (folder / "sensors").exists()


@pytest.mark.parametrize(
    ("sensors", "told"),
    [
        ({"barometr": {"time_s": [0.0], "pressure_hpa": [1e3]}}, "'barometr' .likely: barometer"),
        ({"barometer": {"time_s": [0.0]}}, "sensors, barometer: .* found no pressure_hpa"),
        ({"barometer": {"time_s": ["x"], "pressure_hpa": [1e3]}}, "barometer, time_s: .* numbers"),
        ({"barometer": {"time_s": pd.to_datetime(["2026-05-01 12:00Z"])}}, "barometer, time_s: "),
    ],
)
def test_sensors_that_are_no_tables_of_a_log_are_refused(log, tmp_path, sensors, told):
    """One of another name was not written, others ended in a traceback."""
    tables = {name: pd.DataFrame(rows) for name, rows in sensors.items()}
    with pytest.raises(InputError, match=told):
        write_log(log, tmp_path / "log", sensors=tables)
    assert not (tmp_path / "log").exists()


def test_a_log_without_sensors_has_none(log, tmp_path):
    write_log(log, tmp_path / "log")
    assert read_sensors(tmp_path / "log") == {}
    assert read_sensors(tmp_path / "absent") == {}


def test_sensors_that_were_changed_are_refused(log, sensors, tmp_path):
    write_log(log, tmp_path / "log", sensors=sensors)
    path = tmp_path / "log" / "sensors" / "gyroscope.parquet"
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(StoreError, match="changed or cut off"):
        read_sensors(tmp_path / "log")


def test_sensors_made_by_hand_need_their_columns(log, tmp_path):
    folder = tmp_path / "log"
    (folder / "sensors").mkdir(parents=True)
    (folder / "log.json").write_text('{"crs": "EPSG:32635"}')
    path = folder / "sensors" / "barometer.csv"
    path.write_text("time_s,pressure\n0,1013\n")
    with pytest.raises(InputError, match="no pressure_hpa"):
        read_sensors(folder)
    path.write_text("time_s,pressure_hpa\n0,1013\n")
    assert read_sensors(folder)["barometer"]["pressure_hpa"].tolist() == [1013]
    path.rename(path.with_suffix(".parquet"))
    with pytest.raises(InputError, match="a readable table"):
        read_sensors(folder)
    with pytest.raises(OutputError, match="other files"):
        write_log(log, folder)


def test_a_sensor_table_that_a_log_lists_and_lacks_is_named(log, sensors, tmp_path):
    write_log(log, tmp_path / "log", sensors=sensors)
    (tmp_path / "log" / "sensors" / "gyroscope.parquet").unlink()
    with pytest.raises(StoreError, match=r"gyroscope\.parquet: expected a table of the log"):
        read_sensors(tmp_path / "log")


@pytest.fixture
def barometer(tmp_path):
    """Return the path of a sensor table in a log made by hand, without its suffix."""
    (tmp_path / "sensors").mkdir()
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32635"}')
    return tmp_path / "sensors" / "barometer"


def test_a_sensor_table_with_two_columns_of_a_name_is_refused(log, sensors, tmp_path):
    write_log(log, tmp_path / "log", sensors=sensors)
    path = tmp_path / "log" / "sensors" / "gyroscope.parquet"
    table = pq.read_table(path)
    pq.write_table(table.append_column(table.column_names[0], table[0]), path)
    # A log made by hand lists no checksums.
    (tmp_path / "log" / "log.json").write_text('{"crs": "EPSG:32635"}')
    with pytest.raises(InputError, match="each column once, found a name of two columns"):
        read_sensors(tmp_path / "log")


def test_sensor_tables_are_numbers(barometer):
    path = barometer.with_suffix(".csv")
    path.write_text("time_s,pressure_hpa\n0,1013\n1_0,1013\n")
    with pytest.raises(InputError, match=r"barometer\.csv, time_s: expected numbers"):
        read_sensors(path.parents[1])
    path.unlink()
    path.symlink_to("/dev/zero")
    with pytest.raises(InputError, match="pipe, socket or device"):
        read_sensors(path.parents[1])


def test_damaged_metadata_and_decimals_of_sensor_tables_are_read(barometer):
    path = barometer.with_suffix(".parquet")
    pressures = pa.array([Decimal("1013.5")])
    table = pa.table({"time_s": [0.0], "pressure_hpa": pressures})
    strange = {b"pandas": b'{"index_columns": ["zz"], "columns": [1]}'}
    pq.write_table(table.replace_schema_metadata(strange), path)
    assert read_sensors(path.parents[1])["barometer"]["pressure_hpa"].tolist() == [1013.5]


def report(**columns):
    return pd.DataFrame({"time_s": [0.0], "role": ["neighbour"], "level_dbm": [-90.0], **columns})


def test_carriers_and_codes_are_checked_by_technology():
    lte = make_log(UTM, radio=report(technology="LTE", arfcn=66_486, bsic=503))
    assert lte.radio["arfcn"].tolist() == [66_486]
    nr = make_log(UTM, radio=report(technology="NR", arfcn=636_666, bsic=1007, ci=2**36 - 1))
    assert nr.radio["ci"].tolist() == [2**36 - 1]
    for technology, column, value, expected in (
        ("GSM", "arfcn", 1024, "0..1023 in GSM"),
        ("GSM", "bsic", 64, "0..63 in GSM"),
        ("UMTS", "bsic", 512, "0..511 in UMTS"),
        ("LTE", "bsic", 504, "0..503 in LTE"),
        ("LTE", "timing_advance", 1283, "0..1282 in LTE"),
    ):
        with pytest.raises(InputError, match=rf"{column}: expected {expected}, found {value}"):
            make_log(UTM, radio=report(technology=technology, **{column: value}))
    make_log(UTM, radio=report(arfcn=66_486, bsic=503))


@pytest.mark.parametrize(
    ("word", "name", "notes"),
    [
        ("4G", "LTE", 0),
        ("lte", "LTE", 0),
        ("NR", "NR", 0),
        ("WIFI", "WIFI", 0),
        ("6G", "6G", 1),
    ],
)
def test_words_for_technologies_are_understood_and_others_noted(word, name, notes):
    log = make_log(UTM, radio=report(technology=word, timing_advance=12))
    assert log.radio["technology"].tolist() == [name]
    stated = LogStatement.of_log(log).technology
    assert stated == (name if name == "LTE" else None)
    found = [note for note in log.notes if "technology: '6G' not known, taken for none" in note]
    assert len(found) == len(log.notes) == notes


def test_columns_of_identity_are_only_where_they_were_given(tmp_path):
    assert "technology" not in make_log(UTM, radio=report()).radio
    log = make_log(UTM, radio=report(technology="LTE", mcc=244, mnc=91, lac=3021, ci=1170250))
    for form in ("parquet", "csv"):
        write_log(log, tmp_path / form, form)
        again = read_log(tmp_path / form)
        pd.testing.assert_frame_equal(again.radio, log.radio)
