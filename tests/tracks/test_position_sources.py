"""Positions of one receiver in several files, those that it holds, and columns of times."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError

COUNT = 300
TIME_S = 1_778_666_400.0 + np.arange(float(COUNT))
LAT = 60 + np.arange(COUNT) * 1e-4
LON = 25 + np.arange(COUNT) * 1e-5


def table(time_s=TIME_S, **columns):
    return pd.DataFrame({"time": time_s, **columns})


def test_a_receiver_that_two_files_have_counts_once(read):
    log = read(one=table(lat=LAT, lon=LON), two=table(TIME_S + 0.01, lat=LAT, lon=LON))
    assert len(log.gnss) == COUNT
    assert "two.csv: 300 positions left out beside one.csv, as they are the same" in log.notes
    rng = np.random.default_rng(1)
    other = table(lat=LAT + rng.normal(0, 2e-5, COUNT), lon=LON)
    assert len(read(one=table(lat=LAT, lon=LON), two=other).gnss) == 2 * COUNT


def location(time_s=TIME_S):
    ns = (time_s * 1e9).astype("int64")
    rows = {"time": ns, "seconds_elapsed": time_s - time_s[0], "altitude": 10.0, "speed": -1.0}
    rows |= {"bearing": -1.0, "horizontalAccuracy": 5.0, "latitude": LAT, "longitude": LON + 1e-4}
    return pd.DataFrame(rows)


def test_of_the_providers_of_one_program_gnss_is_taken(read):
    files = {"Location": location(), "LocationNetwork": location()}
    gps = location().assign(longitude=LON)
    log = read(**files, LocationGps=gps)
    assert len(log.gnss) == COUNT
    told = [note for note in log.notes if "of another provider" in note]
    assert [note.split(":")[0] for note in told] == ["Location.csv", "LocationNetwork.csv"]
    # Where it has none of them the next one is.
    assert len(read(Location=location(), LocationGps=location(TIME_S + 1000)).gnss) == 2 * COUNT


@pytest.mark.parametrize("speed_mps", [10.0, 0.1])
def test_positions_that_a_receiver_holds_on_a_drive_are_left_out(read, speed_mps):
    at = np.minimum(np.arange(COUNT), 100)
    motion = {"wheel_speed_mps": speed_mps, "yaw_rate_radps": 0.01}
    log = read(a=table(lat=LAT[at], lon=LON[at], **motion))
    told = [note for note in log.notes if "stay the same for up to 199 s" in note]
    assert len(told) == (speed_mps > 1)
    assert len(log.gnss) == (101 if told else COUNT)


@pytest.mark.parametrize(
    ("columns", "start"),
    [
        ({"time": np.arange(300), "timestamp": (TIME_S * 1000).astype("int64")}, TIME_S[0]),
        ({"time": np.arange(300), "t": "x", "utc": TIME_S}, TIME_S[0]),
        ({"time": "12:00:00", "timestamp": TIME_S}, TIME_S[0]),
        ({"time": TIME_S, "timestamp": np.arange(300)}, TIME_S[0]),
        ({"time": TIME_S, "timestamp": 123_456_000_000_000 + np.arange(300)}, TIME_S[0]),
    ],
)
def test_of_several_columns_of_times_that_in_utc_is_read(read, columns, start):
    log = read(a=pd.DataFrame({**columns, "lat": LAT, "lon": LON}))
    assert log.start_utc_s == start
    assert len(log.gnss) == COUNT


def test_ticks_since_a_phone_was_started_are_no_utc(read):
    ticks = 123_456_000_000_000 + np.arange(COUNT) * 10**9
    log = read(a=table(np.arange(COUNT), timestamp=ticks, lat=LAT, lon=LON))
    assert np.isnan(log.start_utc_s)
    assert len(log.gnss) == COUNT


def test_headings_for_turns_and_degrees_for_radians_are_refused(read):
    rng = np.random.default_rng(1)
    turn = np.where(np.arange(COUNT) % 20 >= 15, 0.3, 0.0) * rng.normal(1, 0.1, COUNT)
    read(a=table(step_m=10.0, turn_rad=turn))
    with pytest.raises(InputError, match=r"headings .* for their changes"):
        read(a=table(step_m=10.0, turn_rad=(np.cumsum(turn) + 1) % 6.28))
    with pytest.raises(InputError, match="degrees given for radians"):
        read(a=table(step_m=10.0, turn_rad=np.degrees(turn)))


@pytest.mark.parametrize("form", ["constant", "minutes"])
def test_a_date_that_tells_no_rows_apart_replaces_no_seconds(read, form):
    dates = pd.to_datetime(TIME_S if form == "minutes" else TIME_S[:1], unit="s")
    texts = dates.strftime("%Y-%m-%d %H:%M").tolist() * (COUNT // len(dates))
    log = read(a=table(np.arange(COUNT), date_time=texts, lat=LAT, lon=LON))
    assert len(log.gnss) == COUNT
    assert (np.diff(log.gnss["time_s"]) == 1).all()
    times = "1 different time" if form == "constant" else f"{len(set(texts))} different times"
    assert f"a.csv: date_time: {times} in 300 rows, not used" in log.notes
    # Beside times that cannot be read it is what there is.
    log = read(a=table("?", date_time=texts, lat=LAT, lon=LON))
    assert log.gnss["time_s"].nunique() == len(set(texts))


@pytest.mark.parametrize("kind", ["part", "sparse", "accurate"])
def test_a_file_of_a_part_of_the_journey_leaves_the_rest_of_another(read, kind):
    whole = table(lat=LAT, lon=LON)
    part = whole[::10] if kind == "sparse" else whole[80:260]
    log = read(one=part.assign(accuracy=4.0) if kind == "accurate" else part, two=whole)
    # Beside those of an accuracy two rows before and two after are left out.
    accurate = kind == "accurate"
    assert len(log.gnss) == COUNT - 4 * accurate
    assert log.gnss["var_east_m2"].notna().sum() == len(part) * accurate
    assert np.diff(log.gnss["time_s"]).max() <= 3
    assert log.gnss["time_s"].is_unique


def test_a_provider_that_pauses_is_followed_by_the_next_one(read):
    gps = location().iloc[np.r_[0:100, 280:300]]
    log = read(Location=location(), LocationGps=gps)
    assert len(log.gnss) == COUNT - 4
    assert (
        "Location.csv: 124 positions left out beside LocationGps.csv, as they are of another "
        "provider" in log.notes
    )


@pytest.mark.parametrize("held", [False, True])
def test_rounded_degrees_of_a_slow_way_are_not_held(read, held):
    lat = np.round(60 + np.arange(COUNT) * 5 / 111_195, 3)
    if held:
        lat[100:200] = lat[100]
    log = read(a=table(lat=lat, lon=LON.round(3), wheel_speed_mps=5.0, yaw_rate_radps=0.01))
    assert len(log.gnss) == COUNT if not held else len(log.gnss) < COUNT - 90
    assert any("held by a receiver" in note for note in log.notes) == held


def wandering(still):
    """Positions of a drive of 10 m/s that a receiver holds for 100 s, with noise of 0.3 m."""
    rng = np.random.default_rng(3)
    north_m = 10.0 * np.arange(COUNT)
    north_m[100:200] = north_m[100] if still else north_m[100:200]
    noise = rng.normal(0, 0.3, (2, COUNT))
    return {"lat": 60 + (north_m + noise[0]) / 111_195, "lon": 25 + noise[1] / 55_600}


def test_positions_that_hardly_move_while_wheels_turn_are_held(read):
    """They were followed, with radii of some 17 m, and what wheels told was rejected."""
    wheels = {"wheel_speed_mps": 10.0, "yaw_rate_radps": 0.0}
    log = read(drive=table(**wandering(still=True), **wheels))
    assert set(np.arange(101.0, 200.0)).isdisjoint(log.gnss["time_s"])
    assert len(log.gnss) == COUNT - 99
    assert any(
        "99 positions left out, as they stay within 3 m for up to 99" in n for n in log.notes
    )
    assert len(read(drive=table(**wandering(still=False), **wheels)).gnss) == COUNT


def test_steps_in_one_place_and_noise_of_wheels_at_rest_hold_nothing(read):
    """A walker may go to and fro, and speeds of 0.2 m/s at rest add up to a way."""
    steps = table(**wandering(still=True), steps=2 * np.arange(COUNT), compass_deg=0.0)
    assert len(read(walk=steps).gnss) == COUNT
    speed = np.where((np.arange(COUNT) > 99) & (np.arange(COUNT) < 200), 0.2, 10.0)
    time_s = TIME_S + np.cumsum(np.where(speed < 1, 10.0, 1.0))
    wheels = {"wheel_speed_mps": speed, "yaw_rate_radps": 0.0}
    assert len(read(drive=table(time_s, **wandering(still=True), **wheels)).gnss) == COUNT


def test_few_positions_of_round_trips_are_not_held(read):
    """A van that is back at its depot each quarter of an hour, with positions there alone."""
    time_s = TIME_S[0] + 900.0 * np.arange(40)
    way = table(np.arange(TIME_S[0], time_s[-1], 1.0), wheel_speed_mps=10.0, yaw_rate_radps=0.1)
    rng = np.random.default_rng(5)
    lat, lon = 60 + rng.normal(0, 3e-6, 40), 25 + rng.normal(0, 5e-6, 40)
    log = read(depot=table(time_s, lat=lat, lon=lon), wheels=way)
    assert len(log.gnss) == 40


def test_fixes_of_one_time_stay_in_order(read):
    """Of two parts, the later one given first, those of each second were shuffled."""
    rows = table(TIME_S[0] + np.arange(COUNT) // 5, lat=LAT, lon=LON)
    assert (np.diff(read(b=rows[150:], a=rows[:150]).gnss["north_m"]) > 0).all()


def test_the_truth_of_one_time_stays_in_order(tmp_path):
    """It was two and a half times as long."""
    rows = table(TIME_S[0] + np.arange(COUNT) // 5, lat=LAT, lon=LON)
    paths = [tmp_path / "b.csv", tmp_path / "a.csv"]
    for path, part in zip(paths, (rows[150:], rows[:150]), strict=True):
        part.to_csv(path, index=False)
    log = mf.read_log(paths, truth=paths)
    assert log.truth_length_m == pytest.approx(np.ptp(log.truth["north_m"]), rel=0.01)


def test_fixes_whose_provider_is_missing_in_some_rows(tmp_path):
    """They ended in a traceback."""
    head = "Provider,LatitudeDegrees,LongitudeDegrees,SpeedMps,AccuracyMeters,UnixTimeMillis"
    rows = [
        f"Fix,{('GPS', 'FLP', '')[k % 3]},{lat:.5f},25,1,5,{1e3 * TIME_S[k]:.0f}"
        for k, lat in enumerate(LAT[:30])
    ]
    path = tmp_path / "gnss_log.txt"
    path.write_text("\n".join(["# Version: v3.0.5.6 Platform: 12", f"# Fix,{head}", *rows]) + "\n")
    log = mf.read_log(path)
    assert len(log.gnss) == 10
    assert "gnss_log.txt: 20 fixes of other providers than gps left out" in log.notes
