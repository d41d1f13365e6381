"""Recordings become one log: clocks, frames, motion, sensors, and the command."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_recordings import COUNT, LAT_DEG, LON_DEG, MADE, START_UTC_S, STEP_S, TIMES_S

from mapfilter.errors import ConfigError, InputError, OutputError
from mapfilter.geodesy import project
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.sensors import read_sensors
from mapfilter.tracks.store import read_log
from mapfilter.workflows.convert import report_lines, run_convert

UTM = "EPSG:32635"


@pytest.fixture
def made(tmp_path):
    """Write made recordings, by format, and return their paths."""

    def write(*names, **changed):
        paths = []
        for name in names:
            file, text = MADE[name]
            path = tmp_path / file
            path.write_text(changed.get(name, text))
            paths.append(path)
        return paths

    return write


def converted(paths, out, **combine):
    options = OpenOptions(combine=CombineOptions(**combine))
    return run_convert(paths, out, options)


LISTS = ("opencellid-cells", "rinex-nav", "rinex-nav/3")


@pytest.mark.parametrize("name", [name for name in MADE if name not in (*LISTS, "smartloc")])
def test_every_recording_makes_a_log_that_is_read_back(name, made, tmp_path):
    result = converted(made(name), tmp_path / "log")
    log, sensors = read_log(tmp_path / "log"), read_sensors(tmp_path / "log")
    tables = ("motion", "radio", "gnss", "pseudoranges", "tdoa", "truth")
    rows = {table: len(getattr(log, table)) for table in tables}
    rows |= {f"sensors/{sensor}": len(table) for sensor, table in sensors.items()}
    assert {k: v for k, v in rows.items() if v} == {k: v for k, v in result.rows.items() if v}
    of_files = {f"{Path(file.file).name}: {note}" for file in result.files for note in file.notes}
    told = {
        f"{Path(file.file).name}: not used: {one}" for file in result.files for one in file.where
    }
    assert of_files | told | set(result.notes) <= set(log.notes)
    others = set(log.notes) - set(result.notes) - of_files - told
    assert all("no use" in note for note in others)
    again = converted(made(name), tmp_path / "again")
    assert again.rows == result.rows
    for one in sorted((tmp_path / "log").rglob("*.parquet")):
        other = tmp_path / "again" / one.relative_to(tmp_path / "log")
        assert one.read_bytes() == other.read_bytes()


def test_a_log_keeps_what_was_sorted_of_each_recording(tmp_path):
    time_s = np.arange(300)[::-1] + 1.78e9
    walk = pd.DataFrame({"time": time_s, "latitude": 60 + 1e-5 * time_s % 1, "longitude": 25.0})
    walk.to_csv(tmp_path / "walk.csv", index=False)
    run_convert([tmp_path / "walk.csv"], tmp_path / "log")
    note = "walk.csv: positions: times go backwards in 299 places; sorted"
    assert note in read_log(tmp_path / "log").notes


def test_cells_from_one_sensors_from_another_truth_from_a_third(made, tmp_path):
    paths = made("towercollector", "sensorlogger", "gpx")
    result = converted(paths, tmp_path / "log", truth=[paths[2]])
    log = read_log(tmp_path / "log")
    assert log.crs == UTM
    assert log.start_utc_s == START_UTC_S
    assert len(log.radio) == 2 * COUNT
    assert len(log.truth) == len(log.gnss) == COUNT
    east, north = project(UTM, LON_DEG, LAT_DEG)
    assert log.truth["east_m"].to_numpy() == pytest.approx(east, abs=0.1)
    assert log.truth["north_m"].to_numpy() == pytest.approx(north, abs=0.1)
    assert log.gnss["var_east_m2"].to_numpy() == pytest.approx((6.4 / 1.515) ** 2)
    acceleration = read_sensors(tmp_path / "log")["accelerometer"]
    assert acceleration["time_s"].tolist() == (TIMES_S - START_UTC_S).tolist()
    assert result.unused == {}
    text = "\n".join(report_lines(result))
    assert "TotalAcceleration.csv: Sensor Logger, UTC" in text
    assert "accelerometer: 30 rows, every 2 s" in text


def test_radio_keeps_identities_by_technology(made, tmp_path):
    converted(made("gnettrack"), tmp_path / "log")
    radio = read_log(tmp_path / "log").radio
    serving = radio[radio["role"] == "serving"]
    assert serving["ci"].unique().tolist() == [102764173]
    assert serving["technology"].unique().tolist() == ["LTE"]
    assert radio[radio["role"] == "neighbour"]["arfcn"].unique().tolist() == [2850]


def test_a_local_clock_is_aligned_by_positions(made, tmp_path):
    paths = made("gnettrack", "gpx")
    result = converted(paths, tmp_path / "log", truth=[paths[1]])
    log = read_log(tmp_path / "log")
    assert any("UTC+03:00 (by positions" in note for note in result.notes)
    assert log.gnss["time_s"].tolist() == log.truth["time_s"].tolist()


def test_a_clock_without_a_start_is_aligned_by_positions(made, tmp_path):
    east = "\n".join(f"{STEP_S * i},{LAT_DEG[i]},{LON_DEG[i]},1013" for i in range(5, COUNT))
    (own,) = made("csv", csv="time,lat,lon,pressure\n" + east)
    (truth,) = made("gpx")
    result = converted([own], tmp_path / "log", truth=[truth])
    assert any("by positions" in note for note in result.notes)
    log = read_log(tmp_path / "log")
    assert log.gnss["time_s"].to_numpy() == pytest.approx(STEP_S * np.arange(5, COUNT), abs=0.11)


def test_a_clock_without_a_start_is_aligned_by_speeds(tmp_path):
    time_s = np.arange(0.0, 300.0, 0.5)
    speed = 8 + 5 * np.sin(time_s / 17) + 3 * np.sin(time_s / 5.3)
    moved = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) / 2)])
    lat = 60.17 + moved / 111_195
    truth = pd.DataFrame({"time": START_UTC_S + time_s, "lat": lat, "lon": 24.94})
    wheels = pd.DataFrame({"time": time_s[:400] + 7.0, "wheel_speed": speed[100:500]})
    truth.to_csv(tmp_path / "truth.csv", index=False)
    wheels.assign(yaw_rate=0.0).to_csv(tmp_path / "wheels.csv", index=False)
    paths = [tmp_path / "wheels.csv", tmp_path / "truth.csv"]
    result = converted(paths, tmp_path / "log", truth=[paths[1]])
    log = read_log(tmp_path / "log")
    assert any("by speeds" in note for note in result.notes)
    assert log.motion["time_s"].iloc[0] == pytest.approx(50.0, abs=0.3)
    assert log.motion["step_m"].sum() == pytest.approx(moved[499] - moved[100], rel=1e-3)


def test_a_clock_that_cannot_be_aligned_needs_an_offset(made, tmp_path):
    paths = made("phyphox", "gpx")
    with pytest.raises(InputError, match=r"--offset Accelerometer\.csv=SECONDS"):
        converted(paths, tmp_path / "log")
    assert not (tmp_path / "log").exists()
    converted(paths, tmp_path / "log", offsets_s={paths[0]: START_UTC_S + 1.0})
    assert read_sensors(tmp_path / "log")["accelerometer"]["time_s"].iloc[0] == 1.0


def test_clocks_that_disagree_are_told(made, tmp_path):
    late = MADE["gpx"][1].replace("T10:00", "T10:01").replace("T10:00", "T10:01")
    late = MADE["gpx"][1]
    for second in range(0, 60, 2):
        late = late.replace(f"T10:00:{second:02d}Z", f"T1x:00:{second:02d}Z")
    for second in range(0, 60, 2):
        at = second + 8
        late = late.replace(f"T1x:00:{second:02d}Z", f"T10:{at // 60:02d}:{at % 60:02d}Z")
    paths = made("opencellid", "gpx", gpx=late)
    result = converted(paths, tmp_path / "log", truth=[paths[1]])
    assert any("agree best -8.0 s shifted" in note for note in result.notes)


def test_metres_of_a_frame_of_their_own(made, tmp_path):
    result = converted(made("indoor"), tmp_path / "log")
    assert any("frame of its own" in note for note in result.notes)
    result = converted(made("indoor"), tmp_path / "log", origin_deg=(30.29, 120.07))
    log = read_log(tmp_path / "log")
    assert not any("frame of its own" in note for note in result.notes)
    assert log.truth["east_m"].iloc[0] == pytest.approx(100.0)
    with pytest.raises(InputError, match="--origin LAT,LON"):
        converted(made("indoor", "gpx"), tmp_path / "other")


def test_satellites_are_placed_by_ephemerides(made, tmp_path):
    result = converted(made("rinex-obs/2", "rinex-nav"), tmp_path / "log")
    rows = read_log(tmp_path / "log").pseudoranges
    assert any("60 placed by broadcast ephemerides" in note for note in result.notes)
    away_m = np.sqrt((rows[["x_m", "y_m", "z_m"]] ** 2).sum(axis=1))
    assert away_m.between(2.63e7, 2.69e7).all()
    # The satellite's clock is 10 µs ahead, and some relativity.
    first = rows[rows["satellite"] == "G07"]["pseudorange_m"].iloc[0]
    assert first == pytest.approx(21_300_000.5 + 299_792_458.0 * 1e-5, abs=8.0)


def test_course_and_speed_make_motion_on_request(made, tmp_path):
    assert converted(made("nmea"), tmp_path / "log").rows["motion"] == 0
    result = converted(made("nmea"), tmp_path / "moved", course_motion=True)
    log = read_log(tmp_path / "moved")
    assert result.rows["motion"] == COUNT
    assert log.motion["step_m"].iloc[1:].to_numpy() == pytest.approx(4.4, abs=0.01)
    # 30.1 degrees clockwise from north, and the convergence of the grid.
    assert np.degrees(log.motion["heading_rad"]).to_numpy() == pytest.approx(59.9 - 1.78, abs=0.2)
    assert any("motion comes from GNSS: speed and course" in note for note in result.notes)
    # Positions have but four decimals of a minute.
    assert log.imu.sigma_orient_deg < 10
    with pytest.raises(InputError, match="expected positions"):
        converted(made("sensorlogger"), tmp_path / "none", course_motion=True)


def test_positions_make_motion_where_there_is_no_course(made, tmp_path):
    result = converted(made("gnettrack"), tmp_path / "log", course_motion=True)
    log = read_log(tmp_path / "log")
    assert any("motion comes from GNSS: its positions" in note for note in result.notes)
    moved = log.motion.iloc[1:]
    east, north = (np.diff(log.gnss[name]) for name in ("east_m", "north_m"))
    # Positions every 2 s, steps of 1 s.
    assert moved["step_m"].to_numpy() == pytest.approx(np.repeat(np.hypot(east, north) / 2, 2))
    assert moved["heading_rad"].to_numpy() == pytest.approx(np.repeat(np.arctan2(north, east), 2))
    assert log.imu.sigma_trans_m < 0.5


@pytest.mark.parametrize("name", ["kitti", "tum"])
def test_poses_make_steps_and_turns(name, made, tmp_path):
    converted(made(name), tmp_path / "log")
    motion = read_log(tmp_path / "log").motion
    assert motion["step_m"].iloc[1:].to_numpy() == pytest.approx(2.202, abs=0.05)
    expected = -0.02 if name == "kitti" else 0.02
    assert motion["turn_rad"].iloc[1:].to_numpy() == pytest.approx(expected, abs=1e-5)
    assert read_log(tmp_path / "log").vehicle is None


def test_odometry_makes_steps_and_turns(made, tmp_path):
    text = MADE["smartloc"][1]
    text = "\n".join(line for line in text.splitlines() if not line.startswith("point3"))
    converted(made("smartloc", smartloc=text), tmp_path / "log")
    motion = read_log(tmp_path / "log").motion
    assert motion["step_m"].iloc[1:].to_numpy() == pytest.approx(4.4)
    assert motion["turn_rad"].iloc[1:].to_numpy() == pytest.approx(0.02)


def test_lists_alone_are_no_journey(made, tmp_path):
    with pytest.raises(InputError, match="give it as"):
        converted(made("opencellid-cells"), tmp_path / "log")
    result = converted(made("opencellid-cells", "opencellid"), tmp_path / "log")
    assert any("a list of 30 cells" in note for note in result.notes)


def test_every_file_that_cannot_be_read_is_told_at_once(made, tmp_path):
    paths = made("gpx", "nmea", gpx="hello\nworld", nmea="")
    with pytest.raises(InputError) as caught:
        converted(paths, tmp_path / "log")
    assert len(caught.value.faults) == 2
    assert not (tmp_path / "log").exists()


def test_inputs_are_never_written_to(made, tmp_path):
    (path,) = made("gpx")
    before = path.read_bytes()
    with pytest.raises(OutputError):
        converted([path], path)
    with pytest.raises(OutputError, match=r"other files \(watch.gpx\)"):
        converted([path], tmp_path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_truth_must_have_positions(made, tmp_path):
    paths = made("gpx", "phyphox")
    with pytest.raises(InputError, match="positions, as the truth"):
        converted(paths, tmp_path / "log", truth=[paths[1]], offsets_s={paths[1]: START_UTC_S})


def test_a_format_that_does_not_exist_is_refused(made, tmp_path):
    with pytest.raises(ConfigError, match="--format"):
        run_convert(made("gpx"), tmp_path / "log", OpenOptions(format="kml"))


def test_a_folder_is_all_recordings_in_it(made, tmp_path):
    (tmp_path / "export").mkdir()
    (path,) = made("sensorlogger")
    text = path.read_text()
    for name in ("TotalAcceleration", "AccelerometerUncalibrated", "Gyroscope", "Gravity"):
        (tmp_path / "export" / f"{name}.csv").write_text(text)
    (tmp_path / "export" / "Metadata.csv").write_text("version,device name\n3,phone\n")
    (tmp_path / "export" / "Annotation.csv").write_text("time,seconds_elapsed,text\n1,2,a\n")
    result = converted([tmp_path / "export"], tmp_path / "log")
    assert set(read_sensors(tmp_path / "log")) == {"accelerometer", "gyroscope", "gravity"}
    assert any("Annotation.csv, Metadata.csv left out" in note for note in result.notes)
    assert any("AccelerometerUncalibrated.csv: accelerometer not used" in n for n in result.notes)
    (tmp_path / "none").mkdir()
    with pytest.raises(InputError, match="none in a known format") as error:
        converted([tmp_path / "none"], tmp_path / "other")
    assert not error.value.faults[0].hint


def test_a_folder_of_exported_folders_names_them(tmp_path):
    (tmp_path / "exports" / "2026-05-01").mkdir(parents=True)
    (tmp_path / "exports" / "empty").mkdir()
    walk = "time,latitude,longitude\n1777629600,60.1,24.9\n1777629601,60.1,24.9\n"
    (tmp_path / "exports" / "2026-05-01" / "walk.csv").write_text(walk)
    with pytest.raises(InputError, match="none in a known format") as error:
        converted([tmp_path / "exports"], tmp_path / "log")
    named = f"name {tmp_path / 'exports' / '2026-05-01'}"
    assert error.value.faults[0].hint == f"they are in folders in it, each of a journey: {named}"


def test_parts_of_one_sensor_are_joined(made, tmp_path):
    (path,) = made("sensorlogger")
    head, *rows = path.read_text().splitlines()
    for i, some in enumerate((rows[:10], rows[10:])):
        (tmp_path / f"TotalAcceleration{i}.csv").write_text("\n".join([head, *some]))
    paths = [tmp_path / f"TotalAcceleration{i}.csv" for i in (1, 0)]
    converted(paths, tmp_path / "log")
    assert len(read_sensors(tmp_path / "log")["accelerometer"]) == COUNT


def test_places_where_no_satellite_can_be_are_left_out(made, tmp_path):
    text = MADE["smartloc"][1].replace("14056711.07", "14056.71", 2)
    text = "\n".join(line for line in text.splitlines() if not line.startswith("point3"))
    (path,) = made("smartloc", smartloc=text.replace("4819715.57", "x", 1))
    result = converted([path], tmp_path / "log")
    assert "pseudoranges: 1 place of a satellite is none, left out" in result.notes
    assert read_log(tmp_path / "log").pseudoranges["x_m"].isna().sum() == 1


@pytest.mark.parametrize(("hours", "is_noted"), [(1, True), (2, True), (0.5, False), (0, False)])
def test_a_recording_by_the_time_of_another_zone_is_named(tmp_path, hours, is_noted):
    for name, shift_s in (("phone", 0.0), ("watch", 60.0 + 3600 * hours)):
        rows = "".join(f"{1_777_629_600 + shift_s + k},60.1{k:03},24.9\n" for k in range(600))
        (tmp_path / f"{name}.csv").write_text(f"time,lat,lon\n{rows}")
    files = [tmp_path / "phone.csv", tmp_path / "watch.csv"]
    noted = [note for note in run_convert(files, tmp_path / "log").notes if " h apart" in note]
    assert bool(noted) == is_noted
    assert all("(likely: a wrong time zone; or several journeys" in note for note in noted)


def test_recordings_of_several_journeys_are_named(tmp_path):
    for number, day_s in enumerate([0, 300, 86_400]):
        rows = "".join(f"{1_777_629_600 + day_s + k},60.1{k},24.9\n" for k in range(9))
        (tmp_path / f"{number}.csv").write_text(f"time,lat,lon\n{rows}")
    files = [tmp_path / f"{number}.csv" for number in range(3)]
    notes = run_convert(files, tmp_path / "log").notes
    assert any("lie up to 23.9 h apart (likely: a wrong time zone" in note for note in notes)
    assert not any("apart" in note for note in run_convert(files[:2], tmp_path / "two").notes)


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("a.mat", b"MATLAB 5.0 MAT-file, Platform: GLNXA64\0\1", "found a MATLAB file"),
        ("a.pbf", b"\0\0\0\r\n\tOSMHeader", "an OpenStreetMap extract (likely: a map; use it as"),
        ("a.tif", b"II*\0", "found a TIFF raster (likely: roads.raster, or [rasters] path)"),
        ("a.16n", MADE["rinex-nav"][1], "found only orbits of satellites (likely: name them toge"),
        ("a.csv", MADE["opencellid-cells"][1], "only a list of cells (likely: give it as [cells] "),
    ],
)
def test_what_is_no_recording_of_a_journey_is_named(name, content, told, tmp_path):
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        run_convert([tmp_path / name], tmp_path / "log")
    assert told in str(caught.value)


@pytest.mark.parametrize("speed", ["speed_mps", "speed_kmh"])
@pytest.mark.parametrize("rate", ["yaw_rate_radps", "yaw_rate_degps"])
def test_a_speed_and_a_yaw_rate_are_odometry(speed, rate, tmp_path):
    """Ten seconds at 9 m/s, turning by 0.1 rad/s: 90 m and 1 rad."""
    told = 9.0 if speed == "speed_mps" else 32.4
    turned = 0.1 if rate == "yaw_rate_radps" else np.degrees(0.1)
    rows = "".join(f"{k},{told},{turned}\n" for k in range(11))
    (tmp_path / "drive.csv").write_text(f"time,{speed},{rate}\n{rows}")
    run_convert([tmp_path / "drive.csv"], tmp_path / "log")
    log = read_log(tmp_path / "log")
    assert log.motion["step_m"].sum() == pytest.approx(90.0)
    assert log.motion["turn_rad"].sum() == pytest.approx(1.0)
    assert log.vehicle is True
    # Beside positions it is the speed of their receiver, and no motion unless asked for.
    rows = "".join(f"{k},{told},{turned},60.1{k},24.9\n" for k in range(11))
    (tmp_path / "drive.csv").write_text(f"time,{speed},{rate},lat,lon\n{rows}")
    result = run_convert([tmp_path / "drive.csv"], tmp_path / "log")
    assert read_log(tmp_path / "log").motion.empty
    unused = "speed and yaw rate not used beside positions; where wheels measured it: --column "
    unused += f"wheel_{speed}={speed}"
    assert unused in result.files[0].notes
    rows = "".join(f"{k},{told},{turned},{9 * k},0\n" for k in range(11))
    (tmp_path / "drive.csv").write_text(f"time,{speed},{rate},east_m,north_m\n{rows}")
    result = run_convert([tmp_path / "drive.csv"], tmp_path / "log")
    assert read_log(tmp_path / "log").motion.empty
    assert unused in result.files[0].notes


def test_odometry_of_many_journeys_is_refused_at_the_first_gap(tmp_path):
    """Sixty rows over eleven months."""
    moments = pd.date_range("2026-01-01T00:00:00", "2026-11-30T00:00:00", 60)
    rows = "".join(f"{moment.isoformat()}Z,9,1\n" for moment in moments)
    (tmp_path / "year.csv").write_text(f"time,speed_mps,yaw_rate_degps\n{rows}")
    told = r"year\.csv, odometry: expected rows at most 1 h apart, found 135\.5 h from 2026-01-01 "
    with pytest.raises(InputError, match=rf"{told}00:00:00 \(row 1\) to .* \(row 2\); 59 such"):
        run_convert([tmp_path / "year.csv"], tmp_path / "log")
    assert not (tmp_path / "log").exists()


def test_dates_of_a_plain_table(tmp_path):
    path = tmp_path / "drive.csv"

    def converted_of(*times):
        rows = "".join(f"{when};60,17{k};24,94\n" for k, when in enumerate(times))
        path.write_text(f"time;lat;lon\n{rows}")
        return run_convert([path], tmp_path / "log", OpenOptions(zone="Europe/Helsinki"))

    converted_of("2.11.2026 10:00:00,5", "2.11.2026 10:00:03,5", "2.11.2026 10:00:06.5")
    log = read_log(tmp_path / "log")
    # 10:00 in Helsinki is 8:00 in UTC in winter.
    start_s = pd.Timestamp("2026-11-02T08:00:00.5Z").timestamp()
    assert (log.start_utc_s + log.gnss["time_s"] - start_s).tolist() == [0.0, 3.0, 6.0]
    # Noon and midnight have the hour 12.
    converted_of(*(f"2026-11-02 {when}" for when in ("11:59:59 AM", "12:00:03 p.m.", "1:00:06 pm")))
    log = read_log(tmp_path / "log")
    start_s = pd.Timestamp("2026-11-02T09:59:59Z").timestamp()
    assert (log.start_utc_s + log.gnss["time_s"] - start_s).tolist() == [0.0, 4.0, 3607.0]
    for given, hint in (
        ("2026-11-02 14:00:00 PM", "AM and PM go with hours of 1 to 12"),
        ("2026-11-02 0:30 AM", "AM and PM go with hours of 1 to 12"),
        ("11/02/2026 10:00:00", "day or month first? Write 2021-03-04, or 4.3.2021 with dots"),
        ("04-03-2021 10:00:00", "day or month first? Write 2021-03-04, or 4.3.2021 with dots"),
        ("4-3-21", "which number is the day, the month, the year? Write 2026-05-13"),
        ("yesterday", "found 'yesterday'"),
        ("32.13.2026 10:00", "found '32.13.2026 10:00'"),
    ):
        with pytest.raises(InputError, match="ISO 8601 such as 2026-05-01T10:00:00") as caught:
            converted_of(given, given)
        assert hint in str(caught.value)


def test_files_of_other_sensors_in_an_export_are_left_out(tmp_path):
    """As phyphox writes them: light, and sound, beside the accelerometer."""
    folder = tmp_path / "export"
    folder.mkdir()
    (folder / "Accelerometer.csv").write_text(MADE["phyphox"][1])
    (folder / "Light.csv").write_text('"Time (s)","Illuminance (lx)"\n0.1,30\n0.2,31\n')
    result = run_convert([folder], tmp_path / "log")
    assert [Path(file.file).name for file in result.files] == ["Accelerometer.csv"]
    assert "export: Light.csv left out, no recordings" in result.notes
    with pytest.raises(InputError, match="a recording in a known format"):
        run_convert([folder / "Light.csv"], tmp_path / "log")


@pytest.mark.parametrize(
    ("speed", "rate", "shown_mps", "shown_radps"),
    [
        ("Vehicle speed (km/h)", "Yaw rate (deg/s)", 3.6, 57.29578),
        ("vehicle_speed_mps", "yaw_rate_rad_s", 1.0, 1.0),
        ("wheel speed (m/s)", "yaw_rate_dps", 1.0, 57.29578),
    ],
)
def test_names_with_units_are_known(speed, rate, shown_mps, shown_radps, tmp_path):
    rows = "".join(f"{k},{9 * shown_mps},{0.1 * shown_radps}\n" for k in range(11))
    (tmp_path / "can.csv").write_text(f"Time,{speed},{rate}\n{rows}")
    run_convert([tmp_path / "can.csv"], tmp_path / "log")
    motion = read_log(tmp_path / "log").motion
    assert motion["step_m"].sum() == pytest.approx(90.0)
    assert motion["turn_rad"].sum() == pytest.approx(1.0)


def test_sentences_of_apps_for_android_are_nmea(made, tmp_path):
    """Each in a line of its own, with what wrote it before and the time after it."""
    lines = MADE["nmea"][1].splitlines()
    text = "".join(f"NMEA,{line.strip()},1777618800{k:03d}\n" for k, line in enumerate(lines))
    (tmp_path / "app.txt").write_text(text)
    plain = run_convert(made("nmea"), tmp_path / "a")
    result = run_convert([tmp_path / "app.txt"], tmp_path / "b")
    assert result.files[0].format == "nmea"
    assert result.rows["gnss"] == plain.rows["gnss"] > 0
