"""Ranges of recorded values: the last one that is kept, and the first that is not, by hand."""

from pathlib import Path

import numpy as np
import pytest

from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.recorded.tables import RECORDED

START_S = 1_777_629_600.0
USUAL = {
    **dict.fromkeys(("role", "satellite", "technology"), "a"),
    "pseudorange_m": 2.2e7,
    "lat_deg": 60.0,
    "lon_deg": 25.0,
    "pressure_hpa": 1013.0,
}
"""Needed values beside those that are tested; others are 0."""

RANGES = [
    *(("positions", "lat_deg", -90, 90), ("positions", "lon_deg", -180, 180)),
    *(("positions", "altitude_m", -500, 20_000), ("positions", "accuracy_m", 0, 100_000)),
    ("positions", "course_deg", 0, 360),
    *(("places", "east_m", -1e8, 1e8), ("places", "north_m", -1e8, 1e8)),
    *(("truth", "lat_deg", -90, 90), ("truth", "lon_deg", -180, 180)),
    ("truth", "altitude_m", -500, 20_000),
    *(("radio", "level_dbm", -200, 0), ("radio", "timing_advance", 0, 3846)),
    *(("radio", "censored", -1, 1), ("radio", "level_step_db", 0, 60)),
    *(("radio", "mcc", 0, 999), ("radio", "mnc", 0, 999), ("radio", "lac", 0, 16_777_215)),
    *(("radio", "ci", 0, 68_719_476_735), ("radio", "arfcn", 0, 3_279_165)),
    ("radio", "bsic", 0, 1007),
    ("motion", "step_m", -1e6, 1e6),
    *(("odometry", "speed_mps", -120, 120), ("odometry", "yaw_rate_radps", -3.5, 3.5)),
    *(("odometry", "speed_sd_mps", 0, 100), ("odometry", "yaw_rate_sd_radps", 0, 10)),
    *(("poses", "x_m", -1e8, 1e8), ("poses", "qw", -1.01, 1.01)),
    ("orientation", "qx", -1.01, 1.01),
    *(("satellites", "pseudorange_m", 1.5e7, 6e7), ("satellites", "sigma_m", 1e-3, 1e5)),
    *(("satellites", "rate_mps", -2e4, 2e4), ("satellites", "cn0_dbhz", 0, 100)),
    ("satellites", "x_m", -6e7, 6e7),
    *(("accelerometer", "x_mps2", -2000, 2000), ("gravity", "z_mps2", -20, 20)),
    *(("gyroscope", "y_radps", -200, 200), ("magnetometer", "x_ut", -10_000, 10_000)),
    *(("barometer", "pressure_hpa", 300, 1100), ("steps", "count", 0, 1e9)),
    *(("turns", "yaw_rate_radps", -20, 20), ("turns", "turn_rad", -6.3, 6.3)),
    *(("cells", "range_m", 0, 1e6), ("cells", "lac", 0, 16_777_215), ("cells", "mcc", 0, 999)),
]  # fmt: skip


def added(table, clock=None, **columns):
    """Return a reading with rows of a table, in lines 2, 3 and so on."""
    count = max(len(values) for values in columns.values())
    reading = Reading(Path("made.csv"))
    reading.clock = clock or Clock("utc")
    usual = {
        field.name: [USUAL.get(field.name, "a" if field.text else 0.0)] * count
        for field in RECORDED[table]
        if field.required
    }
    usual["time_s"] = START_S + np.arange(count)
    reading.add(table, {**usual, **columns}, 2 + np.arange(count))
    return reading


@pytest.mark.parametrize(("table", "name", "low", "high"), RANGES)
def test_the_ends_of_a_range_are_kept_and_what_is_beside_is_not(table, name, low, high):
    span = high - low
    # Many values in the middle, of which few others say nothing of a wrong unit.
    values = [low, high, low - 1e-6 * span, high + 1e-6 * span, *[(low + high) / 2] * 96]
    reading = added(table, **{name: np.array(values, dtype=float)})
    (rows,) = reading.tables[table]
    required = next(one for one in RECORDED[table] if one.name == name).required
    if required:
        assert rows[name].tolist() == [*values[:2], *values[4:]]
        refused = [line for some in reading._refused.values() for line in some]
        assert sorted(np.concatenate(refused)) == [4, 5]
    else:
        assert rows[name].tolist()[:2] == values[:2]
        assert rows[name].isna().to_numpy().nonzero()[0].tolist() == [2, 3]
        assert any(f"{table}, {name}: 2 values are not" in note for note in reading.notes)


@pytest.mark.parametrize("table", ["motion", "odometry", "places", "true_places"])
def test_headings_are_within_a_turn_to_either_side(table):
    """2π is 6.283; a rounded 6.3 is one, too."""
    field = next(one for one in RECORDED[table] if one.name == "heading_rad")
    assert (field.low, field.high) == (-6.3, 6.3)
    compass = [one for one in RECORDED[table] if one.name == "compass_deg"]
    assert all((one.low, one.high) == (-180, 360) for one in compass)


@pytest.mark.parametrize(
    ("value", "largest", "found"),
    [(-0.49, 2.45, 0.0), (-0.49, 2.44, np.nan), (-0.5, 100.0, np.nan), (0.0, 2.0, 0.0)],
)
def test_speeds_just_below_0_are_noise_where_others_are_five_times_as_large(value, largest, found):
    speeds = np.array([value, largest, *[1.0] * 30])
    (rows,) = added("positions", speed_mps=speeds).tables["positions"]
    assert rows["speed_mps"].iloc[0] == pytest.approx(found, nan_ok=True)
    assert rows["speed_mps"].iloc[1] == largest


@pytest.mark.parametrize(
    ("table", "name", "largest", "hint"),
    [
        ("positions", "lat_deg", 90.1, "latitude and longitude swapped"),
        ("positions", "lat_deg", 180.0, "latitude and longitude swapped"),
        # 60 degrees and 10.2 minutes in one number, as of NMEA: at most 180 degrees, 60 minutes.
        ("positions", "lat_deg", 6010.2, "degrees and minutes as one number (NMEA), or metres"),
        ("positions", "lat_deg", 18_060.1, "metres for degrees"),
        ("positions", "lat_deg", 601_702_000.0, "degrees times 1e6 or 1e7"),
        ("positions", "lon_deg", 180.1, "degrees east of 0 to 360; take 360 from those above 180"),
        ("positions", "lon_deg", 360.1, "degrees and minutes as one number (NMEA), or metres"),
        ("positions", "lon_deg", 2.2e9, ""),
        ("radio", "level_dbm", 4.0, "signal bars; name the column bars"),
        ("radio", "level_dbm", 31.0, "ASU of GSM (dBm = 2 ASU - 113), or raw RXLEV"),
        ("radio", "level_dbm", 63.0, "raw RXLEV (dBm = RXLEV - 110), ASU (LTE: dBm = ASU - 140)"),
        ("radio", "level_dbm", 97.0, "a lost sign (70 for -70 dBm), or ASU"),
        ("radio", "level_dbm", 98.0, "a lost sign (70 for -70 dBm)"),
        ("radio", "level_dbm", 201.0, ""),
        ("motion", "heading_rad", 6.3, "degrees given for radians"),
        ("motion", "heading_rad", 360.0, "degrees given for radians"),
        ("motion", "turn_rad", 360.1, ""),
        # SAE J1939: a speed of 655.35 km/h is 182 m/s, a rate of 327.67 deg/s 5.7 rad/s.
        ("odometry", "speed_mps", 182.0, "what a bus sends where it has no value, such as 655.35"),
        ("odometry", "yaw_rate_radps", 5.72, "degrees for radians, or what a bus sends where it"),
        ("barometer", "pressure_hpa", 101_325.0, "pascal for hPa"),
        ("barometer", "pressure_hpa", 29_999.0, ""),
        ("compass", "magnetic_deg", 361.0, "a step counter: the columns of steps and it are"),
        ("turns", "yaw_rate_radps", 20.1, "degrees for radians per second"),
        ("turns", "yaw_rate_radps", 2001.0, ""),
        ("places", "east_m", 2.5e8, "degrees times 1e7 for metres"),
    ],
)
def test_the_likely_mistake_behind_a_value_out_of_range(table, name, largest, hint):
    field = next(one for one in RECORDED[table] if one.name == name)
    found = field.mistake(largest)
    assert found.startswith(hint)
    assert bool(found) == bool(hint)


def test_a_place_of_two_zeros_is_none():
    degrees = {"lat_deg": np.array([0.0, 0.0, 60.0]), "lon_deg": np.array([0.0, 25.0, 0.0])}
    (rows,) = added("positions", **degrees).tables["positions"]
    assert rows[["lat_deg", "lon_deg"]].to_numpy().tolist() == [[0.0, 25.0], [60.0, 0.0]]


@pytest.mark.parametrize("end_s", [315_964_800.0, 4_102_444_800.0])
def test_dates_are_those_since_gps_began_and_to_the_end_of_2099(end_s):
    """6 January 1980 and 1 January 2100, in UTC; seconds from an unknown start have no date."""
    beyond = -1.0 if end_s < 1e9 else 1.0
    times_s = end_s + beyond * np.array([1.0, 0.0, -1.0, -2.0])
    (rows,) = added("steps", time_s=times_s).tables["steps"]
    assert sorted(rows["time_s"] - end_s) == sorted((times_s - end_s)[1:])
    (rows,) = added("steps", Clock("monotonic"), time_s=times_s).tables["steps"]
    assert len(rows) == 4


@pytest.mark.parametrize(
    ("many", "few", "kept"), [(20, 2, 22), (21, 2, 21), (20, 1, 20), (3, 1, 3)]
)
def test_few_rows_more_than_a_day_from_the_others_are_strays(many, few, kept):
    """Fewer than 2, or than a tenth of the others."""
    away_s = 86_400.0 + many
    times_s = START_S + np.append(np.arange(float(many)), away_s + np.arange(few))
    (rows,) = added("steps", time_s=times_s).tables["steps"]
    assert len(rows) == kept


def test_rows_a_day_away_are_no_strays():
    times_s = START_S + np.append(np.arange(50.0), 49.0 + 86_400.0)
    (rows,) = added("steps", time_s=times_s).tables["steps"]
    assert len(rows) == 51
