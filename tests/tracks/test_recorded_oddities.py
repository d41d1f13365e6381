"""Plain tables as programs write them: what looks usual and would be read wrongly."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

COUNT = 300
START = pd.Timestamp("2026-05-13 10:00:00")
TIME_S = START.timestamp() + np.arange(float(COUNT))
METRES_PER_DEGREE = 111_195.0
EAST_M = np.cumsum(10 * np.cos(np.arange(COUNT) / 40))
NORTH_M = np.cumsum(10 * np.sin(np.arange(COUNT) / 40))
LAT, LON = 60 + NORTH_M / METRES_PER_DEGREE, 25 + 2 * EAST_M / METRES_PER_DEGREE


@pytest.fixture
def read(tmp_path):
    def of(rows=None, written="", **columns):
        path = tmp_path / "a.csv"
        path.write_text(written)
        if not written:
            (pd.DataFrame(columns) if rows is None else rows).to_csv(path, index=False)
        return read_recording(path)

    return of


def places(found):
    return found.tables["positions"]


def test_positions_that_a_faster_program_repeats_are_those_of_the_receiver(read):
    at = np.repeat(np.arange(COUNT), 10)
    # A rest of 20 s.
    at = np.where((at >= 100) & (at < 120), 100, at)
    time_s = TIME_S[0] + np.arange(COUNT * 10) / 10
    found = read(time=time_s, lat=LAT[at], lon=LON[at])
    (note,) = found.ignored
    assert note == (
        "positions: 2700 rows repeat those of a receiver that measures every 1 s, left out"
    )
    assert len(places(found)) == COUNT
    np.testing.assert_allclose(places(found)["time_s"], TIME_S, rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", ["each second", "at rest", "by distance"])
def test_other_positions_are_not_left_out(read, kind):
    at = np.arange(COUNT)
    if kind == "at rest":
        at = np.minimum(at, 100)
    if kind == "by distance":
        at = at // 12 * 12
    found = read(time=TIME_S, lat=LAT[at], lon=LON[at])
    assert len(places(found)) == COUNT
    assert not found.ignored


@pytest.mark.parametrize("count", [1, 4])
def test_the_last_position_of_before_is_left_out(read, count):
    first = np.arange(COUNT) < count
    found = read(time=TIME_S, lat=LAT + np.where(first, 1.0, 0.0), lon=LON)
    assert len(places(found)) == COUNT - count
    (note,) = found.ignored
    assert "lies 111.2 km from" in note or "lie 111.2 km from" in note


def test_positions_that_move_away_later_or_for_good_stay(read):
    late = np.arange(COUNT) >= 150
    found = read(time=TIME_S, lat=LAT + np.where(late, 1.0, 0.0), lon=LON)
    assert len(places(found)) == COUNT


@pytest.mark.parametrize(("decimals", "sd_m"), [(3, 32.1), (2, 321.0), (4, None)])
def test_degrees_of_few_decimals_have_their_error(read, decimals, sd_m):
    rows = {"time": TIME_S, "lat": LAT.round(decimals), "lon": LON.round(decimals)}
    accuracy_m = places(read(**rows, accuracy=4.0))["accuracy_m"]
    expected = 4.0 if sd_m is None else np.hypot(4.0, 1.515 * sd_m)
    np.testing.assert_allclose(accuracy_m, expected, rtol=1e-3)


def test_hemispheres_in_columns_of_their_own(read):
    found = read(time=TIME_S, latitude=LAT, ns="S", longitude=LON, ew="W", rating="E5")
    assert (places(found)["lat_deg"] < 0).all()
    assert (places(found)["lon_deg"] < 0).all()
    assert "lon_deg: 300 values of W by column ew: negative" in found.notes
    assert len(found.unread) == 1
    found = read(time=TIME_S, latitude=LAT, ns="N", longitude=LON, ew="E")
    np.testing.assert_allclose(places(found)["lon_deg"], LON)
    found = read(time=TIME_S, latitude=LAT, longitude=LON, lon_dir="W")
    assert (places(found)["lon_deg"] < 0).all()
    found = read(time=TIME_S, latitude=LAT, longitude=LON, state="S")
    np.testing.assert_allclose(places(found)["lat_deg"], LAT)
    # A sign that is there already stays.
    found = read(time=TIME_S, latitude=-LAT, ns="S", longitude=-LON, ew="W")
    np.testing.assert_allclose(places(found)["lat_deg"], -LAT)


def test_hemispheres_of_a_receiver_without_a_fix_for_long(read):
    """Behind 1000 rows without a letter they did not count: west of Greenwich was east."""
    rows = pd.DataFrame({"time": TIME_S, "lat": LAT, "ns": "N", "lon": LON, "ew": "W"})
    before = pd.DataFrame({"time": TIME_S[0] - np.arange(1200.0, 0.0, -1.0)})
    found = read(pd.concat([before, rows]))
    np.testing.assert_allclose(places(found)["lon_deg"], -LON)


@pytest.mark.parametrize("mark", ["-", "N/A", "unknown"])
def test_hemispheres_beside_marks_of_missing_ones(read, mark):
    """One mark among them, and they did not count."""
    letters = np.where(np.arange(COUNT) < 20, mark, "W")
    lon = np.where(np.arange(COUNT) < 10, np.nan, LON)
    found = read(time=TIME_S, lat=LAT, lon=lon, ew=letters)
    np.testing.assert_allclose(places(found)["lon_deg"][-COUNT + 20 :], -LON[20:])


@pytest.mark.parametrize("names", [("platform", ""), ("relation", ""), ("serving", "mode")])
def test_letters_of_another_meaning_are_no_hemispheres(read, names):
    letters = np.where(np.arange(COUNT) % 3 == 0, "S", "N")
    columns = {name: values for name, values in zip(names, (letters, "E"), strict=True) if name}
    found = read(time=TIME_S, latitude=LAT, longitude=LON, **columns)
    np.testing.assert_allclose(places(found)["lat_deg"], LAT)


def test_hemispheres_that_change_on_a_steady_way_are_refused(read):
    letters = np.where(np.arange(COUNT) % 3 == 0, "S", "N")
    with pytest.raises(InputError, match=r"a.csv row 3, ns: .* between N and S on a way without"):
        read(time=TIME_S, latitude=LAT, longitude=LON, ns=letters)
    # A way over the equator.
    north_m = LAT - LAT.mean()
    signs = np.where(north_m < 0, "S", "N")
    found = read(time=TIME_S, latitude=np.abs(north_m), longitude=LON, lat_ref=signs)
    np.testing.assert_allclose(places(found)["lat_deg"], north_m)


def test_courses_of_half_turns(read):
    course = np.linspace(-179, 180, COUNT)
    found = read(time=TIME_S, lat=LAT, lon=LON, bearing=course)
    np.testing.assert_allclose(places(found)["course_deg"], course % 360)
    # -1 is no course.
    found = read(time=TIME_S, lat=LAT, lon=LON, bearing=np.where(course > 0, 90.0, -1.0))
    assert places(found)["course_deg"].isna().sum() == np.sum(course <= 0)


def test_courses_in_radians_are_refused(read, tmp_path):
    course = (np.pi / 2 - np.arctan2(np.gradient(NORTH_M), np.gradient(EAST_M))) % (2 * np.pi)
    rows = {"time": TIME_S, "lat": LAT, "lon": LON, "speed_mps": 10.0}
    read(**rows, course=np.degrees(course))
    mf.read_log(tmp_path / "a.csv")
    read(**rows, course=course)
    with pytest.raises(InputError, match=r"radians for degrees: call the column course \[rad\]"):
        mf.read_log(tmp_path / "a.csv")


@pytest.mark.parametrize("name", ["time", "timestamp"])
def test_days_of_a_spreadsheet(read, name):
    days = TIME_S / 86_400 + 25_569
    found = read(**{name: days, "lat": LAT, "lon": LON})
    assert found.clock.kind == "local"
    np.testing.assert_allclose(places(found)["time_s"], TIME_S, atol=2e-3)
    seconds = read(time=40_000 + np.arange(COUNT) / 100, lat=LAT, lon=LON)
    assert seconds.clock.kind == "monotonic"


def test_a_date_that_stays_over_midnight(read):
    times = [(START + pd.Timedelta(50_300 + i, "s")).strftime("%H:%M:%S") for i in range(COUNT)]
    found = read(date="2026-05-13", time=times, lat=LAT, lon=LON)
    np.testing.assert_allclose(places(found)["time_s"], TIME_S + 50_300, rtol=0, atol=1e-6)
    assert any("the date stays the same over midnight" in note for note in found.notes)


@pytest.mark.parametrize("rows", [20, 100, 150])
def test_a_date_that_stays_over_midnight_in_a_file_read_in_parts(read, monkeypatch, rows):
    """Parts after that of midnight were a day early."""
    time_s = 50_250 + np.arange(COUNT)
    times = [(START + pd.Timedelta(at, "s")).strftime("%H:%M:%S") for at in time_s.tolist()]
    lines = [f"2026-05-13,{at},{60 + i / 1e5:.5f},25.0" for i, at in enumerate(times)]
    monkeypatch.setattr(text, "_PART_BYTES", rows * (len(lines[0]) + 1))
    found = read(written="\n".join(["date,time,lat,lon", *lines]))
    np.testing.assert_allclose(
        places(found)["time_s"], START.timestamp() + time_s, rtol=0, atol=1e-6
    )
    dates = np.where(np.arange(COUNT) < 150, "2026-05-13", "2026-05-14")
    lines = [f"{date}{line[10:]}" for date, line in zip(dates, lines, strict=True)]
    found = read(written="\n".join(["date,time,lat,lon", *lines]))
    np.testing.assert_allclose(
        places(found)["time_s"], START.timestamp() + time_s, rtol=0, atol=1e-6
    )


def parted_drive(read, monkeypatch, rows, kept=(), **columns):
    """Read a drive over parts of some rows; in rows 100 to 199 most columns are empty."""
    fixed = (np.arange(COUNT) < 100) | (np.arange(COUNT) >= 200)
    table = pd.DataFrame({**columns, "lat": LAT.round(5), "lon": LON.round(5)}).astype(object)
    table.loc[~fixed, table.columns.drop(list(kept))] = np.nan
    written = table.to_csv(index=False)
    sizes = np.cumsum([len(line) + 1 for line in written.splitlines()[1:]])
    monkeypatch.setattr(text, "_PART_BYTES", int(sizes[rows - 1]) - 1)
    return read(written=written)


@pytest.mark.parametrize("rows", [COUNT, 60])
def test_a_receivers_times_that_a_later_part_lacks(read, monkeypatch, rows):
    """That part had the seconds of another column: a log of 56 years."""
    columns = {"time": 100.0 + np.arange(COUNT), "utc": TIME_S}
    fixed = np.r_[0:100, 200:COUNT]
    found = parted_drive(read, monkeypatch, rows, ("time",), **columns)
    assert found.clock.kind == "utc"
    np.testing.assert_allclose(places(found)["time_s"], TIME_S[fixed])


@pytest.mark.parametrize("form", ["unix", "seconds", "dates"])
@pytest.mark.parametrize("rows", [COUNT, 5])
def test_a_part_without_a_time_loses_no_other_one(read, monkeypatch, rows, form):
    """The whole file was refused."""
    stamps = START + pd.to_timedelta(np.arange(COUNT), "s")
    columns = {
        "unix": {"time": TIME_S},
        "seconds": {"time": 100.5 + np.arange(COUNT)},
        "dates": {"date": stamps.strftime("%Y-%m-%d"), "time": stamps.strftime("%H:%M:%S")},
    }[form]
    found = parted_drive(read, monkeypatch, rows, **columns)
    assert len(places(found)) == 200
    assert found.clock.kind == {"unix": "utc", "seconds": "monotonic", "dates": "local"}[form]


def test_seconds_in_fewer_than_half_of_the_rows(read):
    """The file was refused, as if these were no numbers."""
    time = np.where(np.arange(COUNT) % 3, np.nan, np.arange(COUNT))
    assert len(places(read(time=time, lat=LAT, lon=LON))) == COUNT / 3


@pytest.mark.parametrize("mark", ["", "-", "unknown"])
def test_a_date_beside_no_time_of_day_is_no_midnight(read, mark):
    """Rows of a receiver without a fix were some hours before the others."""
    times = (START + pd.to_timedelta(np.arange(COUNT), "s")).strftime("%H:%M:%S").to_numpy(object)
    times[:20] = mark
    found = read(date="2026-05-13", time=times, lat=LAT, lon=LON)
    np.testing.assert_allclose(places(found)["time_s"], TIME_S[20:])


@pytest.mark.parametrize("mark", ["", "-", "unknown"])
def test_a_date_that_stays_over_midnight_beside_rows_without_one(read, mark):
    """Rows after midnight were a day early."""
    times = START + pd.to_timedelta(50_300 + np.arange(COUNT), "s")
    given = np.arange(COUNT) % 10 > 0
    date = np.where(given, "2026-05-13", mark)
    time = np.where(given, times.strftime("%H:%M:%S"), mark)
    found = read(date=date, time=time, lat=LAT, lon=LON)
    np.testing.assert_allclose(places(found)["time_s"], TIME_S[given] + 50_300)


def test_days_of_a_spreadsheet_whose_last_part_is_a_row(read, monkeypatch):
    """It counted as seconds, and so the whole file."""
    lines = [f"{day:.8f},{60 + i / 1e5:.5f},25.0" for i, day in enumerate(TIME_S / 86_400 + 25_569)]
    monkeypatch.setattr(text, "_PART_BYTES", (COUNT - 1) * (len(lines[0]) + 1) - 1)
    found = read(written="\n".join(["time,lat,lon", *lines, ""]))
    assert found.clock.kind == "local"
    np.testing.assert_allclose(places(found)["time_s"], TIME_S, atol=2e-3)


@pytest.mark.parametrize("line", ["s,deg,deg", "time,lat,lon"])
def test_a_line_of_units_or_a_second_header_leaves_unix_times_utc(read, line):
    lines = pd.DataFrame({"time": TIME_S, "lat": LAT, "lon": LON}).to_csv(index=False).splitlines()
    at = 1 if line.startswith("s") else 100
    found = read(written="\n".join([*lines[:at], line, *lines[at:]]))
    assert found.clock.kind == "utc"
    np.testing.assert_allclose(places(found)["time_s"], TIME_S)


def test_utc_written_behind_times(read):
    texts = [f"{START + pd.Timedelta(i, 's')} UTC" for i in range(COUNT)]
    found = read(time=texts, lat=LAT, lon=LON)
    assert found.clock.kind == "utc"
    np.testing.assert_allclose(places(found)["time_s"], TIME_S)


def test_unix_times_with_decimal_commas(read):
    rows = pd.DataFrame({"time": TIME_S + 0.5, "lat": LAT, "lon": LON})
    found = read(written=rows.to_csv(index=False, sep=";", decimal=","))
    np.testing.assert_allclose(places(found)["time_s"], TIME_S + 0.5)


def test_columns_of_one_name_are_noted(read):
    lines = pd.DataFrame({"time": TIME_S, "lat": LAT, "lon": LON}).to_csv(index=False).splitlines()
    found = read(written="\n".join([f"{lines[0]},lat", *(f"{line},0" for line in lines[1:])]))
    np.testing.assert_allclose(places(found)["lat_deg"], LAT)
    assert "several columns lat: the first one is read" in found.ignored


def test_seconds_of_gps_are_named_beside_unix_times(read):
    gps = TIME_S - 315_964_800 + 18
    notes = read(gps_time=gps, lat=LAT, lon=LON).notes
    assert any("would be of 2026-05-13: --offset a.csv=315964782" in note for note in notes)
    assert not any("GPS" in note for note in read(gps_time=TIME_S, lat=LAT, lon=LON).notes)


def test_degrees_of_a_whole_turn_are_named(read):
    with pytest.raises(InputError, match="degrees east of 0 to 360"):
        read(time=TIME_S, lat=LAT, lon=LON + 260)


def test_positions_of_one_time_are_those_of_an_export(read):
    found = read(time=np.full(COUNT, TIME_S[0]), lat=LAT, lon=LON)
    assert any("all 300 rows have 1 time (likely: those of an export" in n for n in found.ignored)


def test_positions_of_two_days_are_noted(read):
    found = read(time=TIME_S + np.where(np.arange(COUNT) < 150, 0, 86_400), lat=LAT, lon=LON)
    assert any(note.startswith("positions pause for 24.0 h") for note in found.ignored)


@pytest.mark.parametrize("ci", [2**28 - 1, 2**36 - 1, 2**31 - 1])
def test_identities_with_all_bits_set_are_of_no_cell(read, ci):
    found = read(time=TIME_S, mcc=206, mnc=1, tac=7, ci=ci, rsrp=-90)
    assert found.tables["radio"]["cell"].isna().all()


def test_yaw_rates_without_their_sign_are_noted(read, tmp_path):
    rate = np.random.default_rng(1).normal(0, 0.1, COUNT)
    for values, told in ((rate, False), (np.abs(rate), True)):
        read(time=TIME_S, wheel_speed_mps=10.0, yaw_rate_radps=values)
        notes = mf.read_log(tmp_path / "a.csv").notes
        assert any("all of one sign" in note for note in notes) == told


def test_a_gyroscope_in_degrees_makes_no_motion(read, tmp_path):
    time_s = TIME_S[0] + np.arange(3000) / 50
    rng = np.random.default_rng(2)
    rate = rng.normal(0, 0.6, (3000, 3))
    swing = 9.8 + 2 * np.sin(2 * np.pi * 1.8 * time_s)
    for factor, told in ((1.0, False), (180 / np.pi, True)):
        columns = {f"gyr_{axis}": factor * rate[:, i] for i, axis in enumerate("xyz")}
        read(time=time_s, acc_x=0.1, acc_y=0.1, acc_z=swing, **columns)
        log = mf.read_log(tmp_path / "a.csv")
        assert any("degrees for radians per second" in note for note in log.notes) == told
        assert log.motion.empty == told


def test_dead_reckoning_of_a_receiver_is_no_position(tmp_path):
    def sentence(i, mode):
        body = f"GNRMC,1000{i:02d}.00,A,6000.{i:03d}00,N,02500.00000,E,10.0,0.0,130526,,,{mode}"
        total = 0
        for letter in body:
            total ^= ord(letter)
        return f"${body}*{total:02X}"

    modes = "AAAAADDDDDEEEEEEEEEE"
    lines = [sentence(i, mode) for i, mode in enumerate(modes)]
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    found = read_recording(tmp_path / "a.nmea")
    assert len(found.tables["positions"]) == 10
    (refused,) = found.unusable
    assert refused.count == 10
    assert refused.reason.startswith("RMC: mode E, M, S or N")
    (tmp_path / "a.nmea").write_text("\n".join(sentence(i, "S") for i in range(20)))
    with pytest.raises(InputError, match=r"20 rows: RMC: mode E, M, S or N .*simulated"):
        read_recording(tmp_path / "a.nmea")
    # Old receivers state no mode.
    old = [line.rsplit(",,,", 1)[0] + ",,*00" for line in lines]
    (tmp_path / "a.nmea").write_text("\n".join(line.replace("*00", "") for line in old))
    assert len(read_recording(tmp_path / "a.nmea").tables["positions"]) == 20


@pytest.mark.parametrize(("unit", "scale"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_ticks_since_a_phone_was_started_need_their_unit(read, unit, scale):
    ticks = ((123_456 + np.arange(COUNT)) * scale).astype("int64")
    with pytest.raises(InputError, match="ticks since a phone was started"):
        read(timestamp=ticks, lat=LAT, lon=LON)
    found = read(**{f"timestamp_{unit}": ticks, "lat": LAT, "lon": LON})
    assert found.clock.kind == "monotonic"
    np.testing.assert_allclose(places(found)["time_s"], 123_456 + np.arange(COUNT))


@pytest.mark.parametrize("other", ["", "2026-05-13T07:00:00Z"])
def test_whole_hours_of_a_zone_beside_a_time_of_another_form(read, tmp_path, other):
    """As databases write them; they were local times, and shifted once more."""
    texts = [f"{START + pd.Timedelta(i, 's')}+03" for i in range(COUNT)]
    read(time=[other, *texts[1:]], lat=LAT, lon=LON)
    found = read_recording(tmp_path / "a.csv", options=ReadOptions("Europe/Helsinki"))
    assert found.clock.kind == "utc"
    np.testing.assert_allclose(places(found)["time_s"][-COUNT + 1 :], TIME_S[1:] - 3 * 3600)


@pytest.mark.parametrize(
    "header", ["# timestamp tx ty tz qw qx qy qz", "time,x,y,z,q_w,q_x,q_y,q_z", "t x y z"]
)
def test_parts_of_quaternions_are_in_the_order_of_the_header(read, header):
    """The scalar that is first by it was that of x."""
    lines = [f"{time} {i} 0 0 0.8 0 0 0.6" for i, time in enumerate(TIME_S)]
    rows = read(written="\n".join([header, *lines])).tables["poses"]
    assert rows.loc[0, ["qx", "qy", "qz", "qw"]].tolist() == (
        [0.8, 0, 0, 0.6] if header == "t x y z" else [0, 0, 0.6, 0.8]
    )


@pytest.mark.parametrize("rows", [COUNT, 200])
def test_times_of_day_in_one_number(read, monkeypatch, rows):
    """They were seconds, with 40 of them between minutes."""
    second = 86_400 - 200 + np.arange(COUNT)
    texts = [f"{at // 3600 % 24:02d}{at // 60 % 60:02d}{at % 60:02d}.50" for at in second.tolist()]
    lines = [f"{at},{60 + i / 1e5:.5f},25.0" for i, at in enumerate(texts)]
    monkeypatch.setattr(text, "_PART_BYTES", rows * (len(lines[0]) + 1) - 1)
    found = read(written="\n".join(["utc,lat,lon", *lines, ""]))
    np.testing.assert_allclose(places(found)["time_s"], second + 0.5)


@pytest.mark.parametrize("step", [0.5, 1, 7, 20])
def test_seconds_are_no_times_of_day_in_one_number(read, step):
    time = 100_000 + step * np.arange(COUNT)
    np.testing.assert_allclose(places(read(time=time, lat=LAT, lon=LON))["time_s"], time)
    # Two runs of less than a minute.
    time = np.append(np.arange(150) / 3, 50_000 + np.arange(150) / 3)
    np.testing.assert_allclose(places(read(time=time, lat=LAT, lon=LON))["time_s"], time)


@pytest.mark.parametrize("odd", ["", "-", "unknown"])
def test_unix_times_with_decimal_commas_beside_a_row_without_one(read, odd):
    """The file was refused."""
    lines = [f"{time:.2f};{60 + i / 1e5:.5f};25,0" for i, time in enumerate(TIME_S + 0.25)]
    written = "\n".join(["time;lat;lon", f"{odd};60,1;25,0", *lines, ""]).replace(".", ",")
    np.testing.assert_allclose(places(read(written=written))["time_s"], TIME_S + 0.25)


@pytest.mark.parametrize("comments", [[0], [0, 3, 8]], ids=str)
def test_poses_below_comments_have_the_times_of_their_frames(comments, tmp_path):
    poses = [f"1 0 0 0 0 1 0 0 0 0 1 {k}" for k in range(12)]
    for line in comments:
        poses.insert(line, "# left camera")
    (tmp_path / "00.txt").write_text("\n".join(poses))
    (tmp_path / "times.txt").write_text("\n".join(f"{0.25 * k}" for k in range(12)))
    found = read_recording(tmp_path / "00.txt")
    assert found.notes == ("times by times.txt",)
    assert found.tables["poses"]["time_s"].tolist() == (0.25 * np.arange(12)).tolist()


@pytest.mark.parametrize(
    ("columns", "tables"),
    [
        ({"lat": LAT, "lon": LON, "altitude": 20.0}, {"positions", "orientation"}),
        ({"lat (deg)": LAT, "lon (deg)": LON, "alt (m)": 20.0}, {"positions", "orientation"}),
        ({"x": EAST_M, "y": NORTH_M, "z": 0.0}, {"poses"}),
        ({"X (m)": EAST_M, "Y (m)": NORTH_M, "Z (m)": 0.0}, {"poses"}),
        (
            {f"{sensor}_{axis}": 0.1 for sensor in ("acc", "gyr") for axis in "xyz"} | {"id": 1},
            {"accelerometer", "gyroscope", "orientation"},
        ),
    ],
    ids=lambda given: "-".join(sorted(given)),
)
def test_as_many_columns_as_a_pose_has_are_a_plain_table_by_their_names(read, columns, tables):
    """Positions beside an attitude were a trajectory in degrees."""
    attitude = {"qx": 0.0, "qy": 0.0, "qz": 0.6, "qw": 0.8}
    found = read(time=TIME_S, **columns, **attitude)
    assert set(found.tables) == tables
