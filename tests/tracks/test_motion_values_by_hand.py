"""Units of speeds, steps, counters and sensors of recordings, by hand."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.checks.rounded_degrees import rounding_m, with_rounding
from mapfilter.tracks.checks.speeds import speed_fault, walkers_unit_m
from mapfilter.tracks.joining.position_units import continuous_deg, metres_about_middle, near_deg
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.recorded.odometer_counts import counted_way

START_S = 1_777_629_600.0
NAN = np.nan


def speeds(time_s, count, unit_m=1.0):
    way = counted_way(np.array(time_s, dtype=float), np.array(count, dtype=float), unit_m)
    return way.speed_mps.tolist(), way


def test_speeds_are_those_between_the_rows_beside():
    found, way = speeds([0, 1, 3, 4], [100, 101, 105, 108])
    # Of 1 m in 1 s, 5 m in 3 s, 7 m in 3 s and 3 m in 1 s.
    assert found == pytest.approx([1, 5 / 3, 7 / 3, 3])
    assert (way.wraps, way.resets, way.least_m) == (0, 0, 1.0)
    in_km, _ = speeds([0, 1, 3, 4], [0.100, 0.101, 0.105, 0.108], 1000.0)
    assert in_km == pytest.approx([1, 5 / 3, 7 / 3, 3])


def test_rows_without_a_count_or_a_time_have_no_speed():
    found, _ = speeds([2, NAN, 0, 1, 1], [104, 9, 100, 102, 102])
    assert found == pytest.approx([2, NAN, 2, 2, NAN], abs=1e-6, nan_ok=True)
    assert speeds([0, 1, 2], [7, 7, 7])[0] == [0, 0, 0]
    assert speeds([0], [7])[0] == pytest.approx([NAN], abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    ("end", "unit"),
    [
        # Counters of 8, 16 and 24 bits of their least count, of a tenth and hundredth, and of ten.
        *((256, 1.0), (65_536, 1.0), (2**24, 1.0), (2**32, 1.0), (6553.6, 0.1), (655.36, 0.01)),
        *((100, 1.0), (1000, 1.0), (1_000_000, 1.0), (1e9, 1.0)),
    ],
)
def test_counters_go_on_after_their_end(end, unit):
    count = np.array([end - 4 * unit, end - 2 * unit, 0.0, 2 * unit, 4 * unit])
    found, way = speeds(np.arange(5), count)
    assert found == pytest.approx([2 * unit] * 5, rel=1e-4)
    assert (way.wraps, way.resets) == (1, 0)


def test_a_count_that_begins_anew_is_no_way():
    found, way = speeds(np.arange(6), [5000, 5010, 5020, 0, 10, 20])
    assert (way.wraps, way.resets) == (0, 1)
    assert found == pytest.approx([10] * 6)


@pytest.mark.parametrize(("step_m", "resets"), [(120.0, 0), (120.5, 1)])
def test_counts_faster_than_120_mps_are_jumps(step_m, resets):
    count = np.cumsum([0, 10, 10, step_m, 10, 10])
    _, way = speeds(np.arange(6), count)
    assert way.resets == resets


@pytest.mark.parametrize(("back_m", "resets"), [(10.0, 0), (10.5, 1)])
def test_a_count_that_falls_by_10_mps_backs_up(back_m, resets):
    """A vehicle backs up no faster; a counter that falls so is set anew."""
    count = 5000 + np.cumsum([0, 5, 5, -back_m, -5, -5])
    _, way = speeds(np.arange(6), count)
    assert (way.wraps, way.resets) == (0, resets)


def test_a_rest_begins_three_seconds_after_the_last_count():
    """Counts of 1 m each second; then none for 3 s is a slow way, for 4 s a rest."""
    slow, _ = speeds(np.arange(8), [0, 1, 2, 2, 2, 3, 4, 5])
    assert slow[3] == pytest.approx(1 / 3)
    rest, _ = speeds(np.arange(9), [0, 1, 2, 2, 2, 2, 2, 3, 4])
    assert rest[3:6] == pytest.approx([0, 0, 0])


def test_the_error_of_a_speed_by_coarse_counts():
    """Counts of 100 m at 20 m/s, a row a second: 100 / √6 m over 10 s."""
    time_s = np.arange(100.0)
    way = counted_way(time_s, np.floor(20 * time_s / 100))
    coarse = counted_way(time_s, np.floor(20 * time_s / 100), 100.0)
    assert coarse.speed_sd_mps == pytest.approx(100 / 6**0.5 / 10**0.5)
    assert coarse.least_m == 100.0
    assert np.isnan(coarse.speed_mps[:5]).all()
    assert coarse.speed_mps[10:90] == pytest.approx(20.0)
    assert way.speed_sd_mps == pytest.approx(1 / 6**0.5 / 10**0.5)
    # Errors of 0.05 m/s and less are none.
    fine = counted_way(time_s, np.append(0.0, 0.1 + 20 * time_s[:-1]))
    assert fine.least_m == pytest.approx(0.1)
    assert np.isnan(fine.speed_sd_mps)


def candump(speeds_kmh, form="({}.000000) can0 7E8#03410D{:02X}AAAAAAAA"):
    return "".join(form.format(int(START_S) + i, one) + "\n" for i, one in enumerate(speeds_kmh))


def test_a_reply_of_obd_is_a_byte_of_whole_kilometres_an_hour(tmp_path):
    """SAE J1979, PID 0D: 0 to 255 km/h; 255 is what is sent without a value."""
    path = tmp_path / "bus.log"
    path.write_text(candump([0, 36, 180, 254, 255]))
    found = read_recording(path)
    rows = found.tables["odometry"]
    assert rows["speed_mps"].tolist() == pytest.approx([0, 10, 50, 254 / 3.6])
    # The deviation of an even distribution over 1 km/h.
    assert rows["speed_sd_mps"].tolist() == pytest.approx([1 / 3.6 / 12**0.5] * 4)
    assert (rows["time_s"] - START_S).tolist() == [0, 1, 2, 3]
    assert [one.lines for one in found.unusable] == [(5,)]


@pytest.mark.parametrize(
    ("reply", "is_read"),
    [
        ("7E8#03410D24", True),
        ("7EF#07410D24AAAAAAAA", True),
        ("18DAF110#03410D24", True),
        # Requests, consecutive frames, another service, another PID and another identifier.
        *(("7E7#03410D24", False), ("7F0#03410D24", False), ("7E8#02410D24", False)),
        *(("7E8#08410D24", False), ("7E8#03420D24", False), ("7E8#03410C24", False)),
        *(("18DAF010#03410D24", False), ("7E8#13410D24", False)),
    ],
)
def test_replies_that_hold_the_speed(tmp_path, reply, is_read):
    path = tmp_path / "bus.log"
    path.write_text(candump([72]) + f"({START_S + 1:.6f}) can0 {reply}\n")
    found = read_recording(path)
    # The unit that replies most often, or else the first, is taken.
    assert any("1 line of other frames" in note for note in found.ignored) != is_read


def test_accelerations_of_apple_are_in_g_and_point_down(tmp_path):
    """CMAccelerometerData: -1 in z for a phone on its back; a force is +9.80665 m/s² upward."""
    names = "loggingTime(txt)," + ",".join(f"accelerometerAcceleration{axis}(G)" for axis in "XYZ")
    names += ",altimeterPressure(kPa),pedometerNumberofSteps(N),locationMagneticHeading(°)"
    stamps = [f"2026-05-01 10:00:0{i}.000 +0000" for i in range(3)]
    lines = [f"{stamps[0]},0.5,-0.25,-1.0,101.325,0,359.5", f"{stamps[1]},0,0,-2,99.9,7,0"]
    lines += [f"{stamps[2]},0,0,0,0,-1,-1"]
    path = tmp_path / "sensorlog.csv"
    path.write_text("\n".join([names, *lines]) + "\n")
    found = read_recording(path).tables
    forces = found["accelerometer"][["x_mps2", "y_mps2", "z_mps2"]].to_numpy()
    assert forces == pytest.approx(9.80665 * np.array([[-0.5, 0.25, 1.0], [0, 0, 2.0]]))
    assert found["barometer"]["pressure_hpa"].tolist() == pytest.approx([1013.25, 999.0])
    assert found["steps"]["count"].tolist() == [0, 7]
    assert found["compass"]["magnetic_deg"].tolist() == [359.5, 0]


@pytest.mark.parametrize(
    ("pressures", "factor"),
    [([30.0, 110.0, 101.3], 10.0), ([1013.2, 990.0, 1000.0], 1.0), ([110.5, 300.0, 300.0], 1.0)],
)
def test_pressures_of_30_to_110_are_kilopascals(tmp_path, pressures, factor):
    rows = "".join(f"{int(START_S) + i}000000000,{i},{one}\n" for i, one in enumerate(pressures))
    path = tmp_path / "Barometer.csv"
    path.write_text("time,seconds_elapsed,pressure\n" + rows)
    found = read_recording(path).tables["barometer"]["pressure_hpa"].tolist()
    expected = [factor * one for one in pressures if 300 <= factor * one <= 1100]
    assert found == pytest.approx(expected)


def test_axes_of_sensor_logger_at_rest_tell_the_sensor(tmp_path):
    """8.5 to 11.5 m/s² are an accelerometer, 15 to 90 µT a magnetometer."""
    for norm, table in ((8.5, "accelerometer"), (11.5, "accelerometer"), (15, "magnetometer"),
                        (90, "magnetometer")):  # fmt: skip
        path = tmp_path / "renamed.csv"
        rows = "".join(f"{int(START_S) + i}000000000,{i},{norm},0,0\n" for i in range(3))
        path.write_text("time,seconds_elapsed,z,y,x\n" + rows)
        assert set(read_recording(path).tables) == {table}, norm


@pytest.mark.parametrize(
    ("speed_mps", "unit_m"),
    [
        *((0.59, 1 / 0.3048), (0.6, 1.0), (2.6, 1.0), (2.61, 0.3048), (7.99, 0.3048)),
        *((8.0, 1.0), (9.0, 1.0)),
    ],
)
def test_feet_of_a_walker(speed_mps, unit_m):
    assert walkers_unit_m(speed_mps) == pytest.approx(unit_m)


def test_speeds_are_of_30_rows_that_move_and_follow_within_10_s():
    def rows(count, step_s=1.0, step_m=4.4):
        time_s = step_s * np.arange(count)
        return pd.DataFrame({"time_s": time_s, "step_m": step_m, "heading_rad": 0.0})

    assert speed_fault(rows(31)).startswith("steps of 4.4 m/s, expected 0.6 to 2.6 m/s")
    assert speed_fault(rows(30)) == ""
    assert speed_fault(rows(31, 10.0, 44.0)).startswith("steps of 4.4 m/s")
    assert speed_fault(rows(31, 10.5, 44.0)) == ""
    # Standing: 0.1 m/s and less do not count.
    assert speed_fault(rows(31, 1.0, 0.1)) == ""
    assert "(metres taken for feet?)" in speed_fault(rows(31, 1.0, 0.11))


def test_longitudes_beside_180_degrees():
    assert near_deg([-179.5, 179.5, 0.0], 179.0).tolist() == [180.5, 179.5, 0.0]
    assert near_deg([179.5], -179.5).tolist() == [-180.5]
    assert continuous_deg([NAN, 179.9, -179.9]).tolist() == pytest.approx(
        [NAN, 179.9, 180.1], abs=1e-6, nan_ok=True
    )


def test_metres_of_degrees():
    """A great circle of 6371 km has 111.195 km a degree; at 60 degrees a parallel has half."""
    east_m, north_m = metres_about_middle([24.0, 25.0, 26.0, NAN], [59.0, 60.0, 61.0, 60.0])
    assert east_m.tolist() == pytest.approx([-55_597.5, 0, 55_597.5, NAN], abs=1e-6, nan_ok=True)
    assert north_m[:3].tolist() == pytest.approx([-111_195, 0, 111_195])


@pytest.mark.parametrize(
    ("decimals", "step_m"), [(0, 111_195), (1, 11_119.5), (2, 1111.95), (3, 111.195), (4, 0.0)]
)
def test_steps_of_rounded_degrees(decimals, step_m):
    degrees = np.round(50 + np.arange(12) * 1.1111, decimals)
    rows = pd.DataFrame({"lat_deg": degrees, "lon_deg": 8.0, "accuracy_m": 3.0})
    assert rounding_m(rows) == pytest.approx(step_m)
    found, note = with_rounding(rows)
    # Rounding has the deviation of an even distribution, step / √12; 68 % lie within 1.515 of it.
    by_hand = (3**2 + (1.515 * step_m / 12**0.5) ** 2) ** 0.5 if step_m else 3.0
    assert found["accuracy_m"].to_numpy() == pytest.approx(by_hand)
    assert bool(note) == bool(step_m)
    assert rounding_m(rows[:9]) == 0.0
