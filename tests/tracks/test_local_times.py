"""Local times without a zone are noted, whatever recordings have them."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.clocks.times import parse_times
from mapfilter.errors import InputError

TIMES = pd.Timestamp("2026-05-01 10:00:00") + pd.to_timedelta(range(60), unit="s")
LAT, LON = 60.0, 25.0


def gpx(zone=""):
    points = "".join(
        f'<trkpt lat="{LAT + i / 1e4}" lon="{LON}"><time>{time.isoformat()}{zone}</time></trkpt>'
        for i, time in enumerate(TIMES)
    )
    return f'<gpx version="1.1" creator="a watch"><trk><trkseg>{points}</trkseg></trk></gpx>'


def table(zone="", **columns):
    times = [f"{time.isoformat()}{zone}" for time in TIMES]
    return pd.DataFrame({"time": times, **columns}).to_csv(index=False)


PLACES = {"lat": [LAT + i / 1e4 for i in range(60)], "lon": LON}
CELLS = {"mcc": 206, "mnc": 1, "lac": 7, "ci": 100, "rsrp": -90}
TOLD = "local times that state no zone"


@pytest.fixture
def notes(tmp_path):
    def of(zone="", **files):
        for name, text in files.items():
            path = tmp_path / name.replace("_", ".")
            path.write_text(text)
        log = mf.read_log(tmp_path, zone=zone)
        return [note for note in log.notes if TOLD in note], log

    return of


def test_files_of_a_folder_that_all_have_local_times_are_named(notes):
    found, log = notes(track_gpx=gpx(), cells_csv=table(**CELLS), speed_csv=table(speed_mps=1.0))
    (note,) = found
    assert note.startswith(f"cells.csv, speed.csv, track.gpx: {TOLD}, taken for one zone: ")
    assert "(zone of mf.read_log gives it: that of your place, such as Europe" in note
    assert pd.isna(log.start_utc_s)


@pytest.mark.parametrize("name", ["track_gpx", "places_csv"])
def test_one_file_with_local_times_is_named(notes, name):
    (note,), _ = notes(**{name: gpx() if name == "track_gpx" else table(**PLACES)})
    assert note.startswith(f"{name.replace('_', '.')}: {TOLD}: UTC is unknown")


def test_local_times_that_become_utc_are_not_named(notes):
    assert notes("Europe/Brussels", track_gpx=gpx(), cells_csv=table(**CELLS))[0] == []
    found, log = notes(track_gpx=gpx("Z"), cells_csv=table(**CELLS))
    assert found == []
    assert any("cells.csv: local time is UTC+00:00" in note for note in log.notes)


@pytest.mark.parametrize("style", ["%I:%M:%S %p", "%I:%M %p", "%I:%M:%S.25%p"])
def test_hours_of_half_a_day_are_those_of_the_whole(style):
    times = pd.date_range("2026-05-01 00:07", periods=48, freq="30min")
    whole_s, _ = parse_times(np.array([f"{time:%Y-%m-%d %H:%M:%S}" for time in times], object))
    for texts in (times.strftime(f"%Y-%m-%d {style}"), times.strftime(f"%d.%m.%Y {style}Z")):
        found_s, _ = parse_times(np.array(texts.str.lower().str.replace("z", "Z"), object))
        np.testing.assert_allclose(found_s - whole_s, 0.25 * (".25" in style))


def test_hours_that_no_half_day_has_are_no_times():
    texts = np.array([f"2026-05-01 {hour:02d}:00 PM" for hour in (0, 13, 24)], object)
    assert np.isnan(parse_times(texts)[0]).all()


@pytest.mark.parametrize(
    ("form", "unix"),
    [("{:.5E}", True), ("{:.5e}", True), ("{:.4E}", False), ("{:.1f}", False), ("{:.0f}", False)],
)
@pytest.mark.parametrize("comma", [False, True])
def test_times_that_a_spreadsheet_shortened_are_refused(tmp_path, form, unix, comma):
    """All rows of a walk of minutes share one time, or two."""
    seconds = 1_777_630_000.0 + np.arange(300)
    numbers = seconds if unix else seconds / 86_400 + 25_569
    texts = [form.format(number) for number in numbers]
    rows = pd.DataFrame({"time": texts, "latitude": 60 + 1e-6 * np.arange(300), "longitude": 25.0})
    rows["time"] = rows["time"].str.replace(".", "," if comma else ".")
    rows.to_csv(tmp_path / "walk.csv", index=False, sep=";", decimal="," if comma else ".")
    with pytest.raises(InputError, match="a spreadsheet that shortened numbers") as refused:
        mf.read_log(tmp_path / "walk.csv")
    (fault,) = refused.value.faults
    assert fault.where == f"{tmp_path / 'walk.csv'}, time (time)"
    assert f" in 300 rows, such as {rows['time'][0]}" in fault.got


@pytest.mark.parametrize("form", ["{:.9E}", "{:.0f}"])
def test_times_with_all_their_digits_are_read(tmp_path, form):
    texts = [form.format(1_777_630_000.0 + second) for second in range(300)]
    rows = pd.DataFrame({"time": texts, "latitude": 60 + 1e-6 * np.arange(300), "longitude": 25.0})
    rows.to_csv(tmp_path / "walk.csv", index=False)
    assert mf.read_log(tmp_path / "walk.csv").duration_s == 299.0


@pytest.mark.parametrize("turning", ["yaw_rate_degps", "gyro_z", "acc_x"])
def test_counts_of_milliseconds_are_refused_as_seconds_of_sensors(tmp_path, turning):
    """A sensor whose rows came every 100 s would measure no turn and no step."""
    rows = pd.DataFrame(
        {
            "time": np.arange(0, 30_000, 100),
            "wheel_speed_kmh": 30.0 + np.sin(np.arange(300)),
            turning: np.cos(np.arange(300)),
        }
    )
    rows.to_csv(tmp_path / "drive.csv", index=False)
    with pytest.raises(InputError, match="time_ms for milliseconds") as refused:
        mf.read_log(tmp_path / "drive.csv")
    (fault,) = refused.value.faults
    assert fault.where == f"{tmp_path / 'drive.csv'}, time (time)"
    assert fault.got == "whole numbers, 100 from row to row"


@pytest.mark.parametrize(
    ("header", "each", "turning"),
    [
        ("time_s", 100, "yaw_rate_degps"),
        ("seconds", 100, "yaw_rate_degps"),
        ("time", 9, "yaw_rate_degps"),
        ("time", 100.5, "yaw_rate_degps"),
        ("time", 100, "engine"),
        ("time_ms", 100, "yaw_rate_degps"),
    ],
)
def test_slow_rows_are_read_as_they_are(tmp_path, header, each, turning):
    rows = pd.DataFrame(
        {
            header: each * np.arange(300),
            "wheel_speed_kmh": 30.0 + np.sin(np.arange(300)),
            turning: np.cos(np.arange(300)),
        }
    )
    rows.to_csv(tmp_path / "drive.csv", index=False)
    columns = {"time": header} if header == "seconds" else {}
    log = mf.read_log(tmp_path / "drive.csv", columns=columns)
    assert log.duration_s == pytest.approx(299 * each * (0.001 if header == "time_ms" else 1))


def seldom(**more):
    """Rows of a vehicle's unit, 15 apart."""
    counts = np.arange(300)
    rows = {"time": 15 * counts, "cell": "A", "level_dbm": -80.0 - counts % 5}
    return pd.DataFrame(rows | {"acc_x": np.cos(counts)} | more)


def test_seconds_by_which_positions_move_as_on_a_journey_are_seconds(tmp_path):
    """15 m from row to row: 1 m/s, or 1 km/s if they were milliseconds."""
    rows = seldom(lat=60.17 + 15 / 111_200 * np.arange(300), lon=24.94)
    rows.to_csv(tmp_path / "drive.csv", index=False)
    assert mf.read_log(tmp_path / "drive.csv").gnss["time_s"].iloc[-1] == 15 * 299
    # 15 mm from row to row: 1 m/s if they are milliseconds.
    rows = seldom(lat=60.17 + 0.015 / 111_200 * np.arange(300), lon=24.94)
    rows.to_csv(tmp_path / "drive.csv", index=False)
    with pytest.raises(InputError, match="time_ms for milliseconds"):
        mf.read_log(tmp_path / "drive.csv")


def test_times_of_day_in_one_number_are_no_milliseconds(tmp_path):
    of_day = np.arange(43_200, 43_200 + 15 * 300, 15)
    digits = 10_000 * (of_day // 3600) + 100 * (of_day // 60 % 60) + of_day % 60
    seldom(time=digits).to_csv(tmp_path / "drive.csv", index=False)
    log = mf.read_log(tmp_path / "drive.csv")
    assert np.ptp(log.radio["time_s"]) == 15 * 299
