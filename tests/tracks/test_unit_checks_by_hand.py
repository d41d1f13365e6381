"""Columns of another unit or quantity: the last value that is taken, and the first that is not."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.checks.exchanged import (
    _exchanged,
    _fast_mps,
    _is_heading,
    _negative_share,
    _unsigned,
    check_columns,
    sideways_mps2,
)
from mapfilter.tracks.checks.stated_errors import stated_note
from mapfilter.tracks.joining.gps_dates import _mistakes, _named_s, week_start_s
from mapfilter.tracks.joining.raw_satellites import (
    _between_clocks_m,
    _sane_places,
    log_pseudoranges,
)
from mapfilter.tracks.joining.speed_shift import shift_note
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.plain.places import _within_turn
from mapfilter.tracks.readers.plain.speed_units import speed_unit
from mapfilter.tracks.readers.recorded.held_positions import own_positions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock, Recording
from mapfilter.tracks.readers.texts.columns import Columns

START_S = 1_777_629_600.0
NAN = np.nan
DEGREE_M = 111_195.0


def ended(table, name, values, **columns):
    """Return the recording of a column, in rows a second apart."""
    reading = Reading(Path("made.csv"))
    time_s = START_S + np.arange(len(values))
    reading.add(table, {"time_s": time_s, name: values, **columns}, 2 + np.arange(len(values)))
    return reading.done("csv")


@pytest.mark.parametrize(
    ("table", "name", "good", "bad", "is_read"),
    [
        # Levels and lengths: half of the values, and one number is a mark of missing ones.
        ("radio", "level_dbm", [-80.0] * 5, [70.0, 71, 72, 73, 74], True),
        ("radio", "level_dbm", [-80.0] * 5, [70.0, 71, 72, 73, 74, 75], False),
        ("radio", "level_dbm", [-80.0] * 5, [99.0] * 9, True),
        ("radio", "level_dbm", [-80.0] * 5, [2e9, 2**31, -(2**63)] * 3, True),
        ("radio", "level_dbm", [-80.0] * 5, [1.9e9, -1.9e9] * 3, False),
        ("radio", "level_dbm", [-80.0] * 5, [998.0, 9998] * 3, False),
        *(
            ("radio", "level_dbm", [-80.0] * 5, [mark, -mark] * 3, True)
            for mark in (999.0, 9999, 99_999, 999_999, 32_767, 32_768, 65_535)
        ),
        # Turns: a twentieth, and three numbers.
        ("motion", "turn_rad", [0.1] * 95, [7.0, 8, 9, 10, 11], True),
        ("motion", "turn_rad", [0.1] * 94, [7.0, 8, 9, 10, 11, 12], False),
        ("motion", "turn_rad", [0.1] * 90, [7.0, 8, 9] * 3, True),
        # Speeds of a bus: half of them. Yaw rates: a tenth.
        ("odometry", "speed_mps", [10.0] * 5, [121.0, 122, 123, 124, 125], True),
        ("odometry", "speed_mps", [10.0] * 5, [121.0, 122, 123, 124, 125, 126], False),
        ("odometry", "yaw_rate_radps", [0.1] * 36, [4.0, 5, 6, 7], True),
        ("odometry", "yaw_rate_radps", [0.1] * 36, [4.0, 5, 6, 7, 8], False),
    ],
)
def test_files_are_refused_most_of_whose_values_are_out_of_range(table, name, good, bad, is_read):
    beside = {"role": "serving", "cell": "A"} if table == "radio" else {"step_m": 1.0}
    values = np.array([*good, *bad], dtype=float)
    if not is_read:
        with pytest.raises(InputError, match=f"{name}: .*values outside"):
            ended(table, name, values, **beside)
        return
    found = ended(table, name, values, **beside).tables[table][name]
    assert found.dropna().tolist() == good


def test_tyres_hold_20_mps2_sideways():
    """Of 60 rows that move, 20 beyond it are too many."""
    speed = np.full(60, 10.0)
    assert sideways_mps2(speed, np.full(60, 2.01)) == pytest.approx(20.1)
    assert sideways_mps2(speed, np.full(60, 2.0)) == 0.0
    assert sideways_mps2(-speed, np.repeat([-2.1, 1.0], [20, 40])) == pytest.approx(21)
    assert sideways_mps2(speed, np.repeat([2.1, 1.0], [19, 41])) == 0.0
    assert sideways_mps2(speed[1:], np.full(59, 2.1)) == 0.0
    # Of 800 rows 5 % are 40.
    many = np.full(800, 10.0)
    assert sideways_mps2(many, np.repeat([2.1, 1.0], [42, 758])) == pytest.approx(21)
    assert sideways_mps2(many, np.repeat([2.1, 1.0], [38, 762])) == 0.0
    # At 1 m/s and less a vehicle stands.
    assert sideways_mps2(np.full(60, 1.0), np.full(60, 30.0)) == 0.0


def test_vehicles_are_slower_than_70_mps_most_of_the_time():
    assert _fast_mps(np.full(60, 70.0)) == 0.0
    assert _fast_mps(np.full(60, -70.5)) == 70.5
    assert _fast_mps(np.full(59, 90.0)) == 0.0
    assert _fast_mps(np.repeat([90.0, 20.0], [3, 97])) == 0.0


def test_headings_stand_for_turns_of_steps_alone():
    """Rates of 1 rad/s that hardly change are those of a vehicle in a circle, at 2 m/s."""
    steady = 1.0 + 0.01 * np.sin(np.arange(100.0))
    of_steps = ended("motion", "step_m", np.full(100, 2.0), turn_rad=steady)
    with pytest.raises(InputError) as raised:
        check_columns(of_steps)
    assert str(raised.value) == (
        "made.csv, motion, turn_rad: expected changes of heading in each interval, found 1.0 rad "
        "in the median, changing slowly (likely: headings (heading_rad, or compass_deg) for their "
        "changes)"
    )
    (note,) = check_columns(
        ended("odometry", "speed_mps", np.full(100, 2.0), yaw_rate_radps=steady)
    )
    assert "yaw_rate_radps: all of one sign" in note


@pytest.mark.parametrize(
    ("back", "left", "still", "exchanged"),
    [
        *((10, 0, 0, True), (9, 0, 0, False), (90, 0, 0, True), (91, 0, 0, False)),
        *((50, 1, 0, True), (50, 2, 0, False), (50, 100, 0, True), (50, 98, 0, False)),
        # Turns in three tenths of all rows.
        *((50, 0, 233, True), (50, 0, 234, False)),
    ],
)
def test_speeds_of_both_signs_beside_turns_of_one_are_exchanged(back, left, still, exchanged):
    along = np.repeat([-1.0, 1.0], [back, 100 - back])
    turn = np.repeat([0.1, -0.1, 0.0], [left, 100 - left, still])
    assert _exchanged(np.append(along, np.ones(still) * NAN), turn) == exchanged
    assert not _exchanged(along[:59], turn[:59])


def test_headings_given_for_turns_are_large_and_change_slowly():
    assert _is_heading(np.full(60, 0.5))
    assert _is_heading(np.full(60, -3.1))
    assert not _is_heading(np.full(60, 0.49))
    assert not _is_heading(np.full(59, 0.5))
    # A fifth of 1.1 rad is 0.22 rad.
    assert _is_heading(np.tile([1.0, 1.2], 30))
    assert not _is_heading(np.tile([1.0, 1.25], 30))


def test_rates_of_one_sign_and_speeds_of_two():
    assert _unsigned(np.full(60, 0.1))
    assert _unsigned(np.append(np.full(60, -0.1), [0.0, NAN]))
    assert not _unsigned(np.append(np.full(60, -0.1), 0.1))
    assert not _unsigned(np.full(59, 0.1))
    # A fifth negative, in rows that change their sign in a twentieth.
    assert _negative_share(np.tile([-1.0, 1, 1, 1, 1], 20)) == 0.2
    assert _negative_share(np.tile([-1.0, 1, 1, 1, 1, 1], 20)) == 0.0
    assert _negative_share(np.tile([1.0, -1, -1, -1, -1], 20)) == 0.8
    assert _negative_share(np.repeat([-1.0, 1.0], [20, 80])) == 0.0


def test_courses_to_the_west_are_those_of_a_whole_turn():
    west = np.array([-180.0, -90, -0.5, -10, 180, 5])
    assert _within_turn(west).tolist() == [180, 270, 359.5, 350, 180, 5]
    # Three different ones may be marks, and of -181 or 181 none is within half a turn.
    for other in ([-180.0, -90, -1, -1], [*west, 180.5], [*west, -180.5]):
        assert _within_turn(np.array(other)).tolist() == other


def test_a_dilution_of_precision_is_four_metres_of_each(tmp_path):
    lines = [f"{START_S + i},{60 + i / 1e4},24.9,{h},{a}" for i, (h, a) in
             enumerate([(1.0, ""), (0.9, ""), (2.5, 3.5)])]  # fmt: skip
    (tmp_path / "a.csv").write_text("\n".join(["time,lat,lon,hdop,accuracy", *lines]) + "\n")
    found = read_recording(tmp_path / "a.csv").tables["positions"]["accuracy_m"]
    assert found.tolist() == pytest.approx([4.0, 3.6, 3.5])


@pytest.mark.parametrize(
    ("speeds", "unit"),
    [
        *(([70.0] * 20, ""), ([70.5] * 20, "km/h"), ([-70.5] * 20, "km/h"), ([NAN] * 20, "")),
        *(([120.0] * 1 + [20.0] * 29, ""), ([120.0] * 3 + [20.0] * 27, "km/h")),
    ],
)
def test_speeds_beyond_70_in_a_twentieth_of_rows_are_kmh(speeds, unit):
    reading, time_s = Reading(Path("a.csv")), np.arange(float(len(speeds)))
    rows = Columns(reading, ("speed",), 2 + np.arange(len(speeds)))
    texts = ["" if np.isnan(one) else str(one) for one in speeds]
    rows._columns[0] = pa.chunked_array([pa.array(texts)])
    assert speed_unit(Mapped(rows, {}, {}), "speed", time_s) == unit


def places(lat_deg, time_s=None, **columns):
    time_s = np.arange(float(len(lat_deg))) if time_s is None else time_s
    rows = {"time_s": time_s, "lat_deg": lat_deg, "lon_deg": 8.123_456_7, "accuracy_m": 3.0}
    return pd.DataFrame({**rows, **columns})


@pytest.mark.parametrize(
    ("away_m", "before_s", "left_out"), [(2050, 1, 1), (1950, 1, 0), (2200, 6, 1), (2050, 6, 0)]
)
def test_a_first_position_farther_than_2_km_and_350_mps_is_of_before(away_m, before_s, left_out):
    lat_deg = 50.123_456_7 + np.append(-away_m / DEGREE_M, 1e-5 * np.arange(30))
    time_s = np.append(-float(before_s), np.arange(30.0))
    rows, notes = own_positions(places(lat_deg, time_s))
    assert len(rows) == 31 - left_out
    assert bool(notes) == bool(left_out)
    if left_out:
        assert f"the first row lies {away_m / 1000:.1f} km from the next one" in notes[0]


@pytest.mark.parametrize(("pause_s", "noted"), [(21_600.0, False), (21_601.0, True)])
def test_a_pause_of_more_than_six_hours_parts_journeys(pause_s, noted):
    time_s = np.append(np.arange(10.0), 9 + pause_s + np.arange(10.0))
    _, notes = own_positions(places(50.123_456_7 + 1e-5 * np.arange(20), time_s))
    assert bool(notes) == noted


def test_dates_of_gps_that_are_misread():
    """1024 weeks are 619 315 200 s; GPS began 315 964 800 s after 1970, and is 18 s ahead."""
    first, second, third = _mistakes(START_S - 315_964_800 + 18)
    assert (first.late_s, second.late_s) == (619_315_200, 1_238_630_400)
    assert third.late_s == 315_964_800 - 18
    assert _named_s("drive_2026-05-01_2026-05-02.csv") is None
    assert _named_s("20260501.csv") == START_S - 36_000


@pytest.mark.parametrize(
    ("begin_s", "apart_s", "found"),
    [
        *((468_018.0, 0, True), (468_018.0, 50, True), (468_018.0, 51, False)),
        # Recordings from an unknown start begin within an hour.
        *((3599.0, 0, False), (3600.0, 0, True), (604_799.0, 0, True), (604_800.0, 0, False)),
    ],
)
def test_seconds_of_the_week_have_half_of_a_file_in_common(begin_s, apart_s, found):
    """Week 2416 began on 26 April 2026, 18 s before midnight in UTC."""
    week_s = 1_777_161_582.0

    def recording(first_s, clock):
        rows = pd.DataFrame({"time_s": first_s + np.arange(0.0, 101.0)})
        return Recording(Path("a.csv"), "csv", "", clock, {"steps": rows}, 101)

    other = recording(week_s + begin_s + apart_s, Clock("utc"))
    of_week = recording(begin_s, Clock("monotonic"))
    assert week_start_s(of_week, other) == (week_s if found else None)
    of_day = recording(begin_s, Clock("monotonic", from_midnight=True))
    assert week_start_s(of_day, other) is None


@pytest.mark.parametrize(
    ("shift_s", "told"),
    [
        *((1.0, None), (1.5, False), (16.5, False), (17.0, True), (19.0, True), (19.5, False)),
        *((-18.0, True), (59.5, False), (60.0, None)),
    ],
)
def test_shifts_of_clocks_by_speeds_and_what_18_s_are(shift_s, told):
    time_s = np.arange(0.0, 600.0, 0.5)
    speed = 10 + np.random.default_rng(1).normal(0.0, 3.0, time_s.size)
    note = shift_note("gps.csv", (time_s, speed), (time_s + shift_s, speed))
    assert bool(note) == (told is not None)
    if note:
        assert f"best {-shift_s:+.1f} s shifted" in note
        assert ("GPS time for UTC" in note) == told


@pytest.mark.parametrize(
    ("off_m", "radius_m", "is_noted"),
    [
        *((8.0, 0.41, True), (8.0, 0.39, False), (8.0, 1.99, True), (8.0, 2.01, False)),
        *((3.0, 0.8, True), (2.9, 0.8, False)),
        # Three times 1.177 deviations: the radius of a half, and that of 68 % is 1.515 of them.
        *((4.7, 2.0 - 1e-9, True), (4.6, 2.0 - 1e-9, False)),
    ],
)
def test_stated_errors_like_hdop_of_positions_that_lie_apart(off_m, radius_m, is_noted):
    time_s = np.arange(60.0)
    true = pd.DataFrame({"time_s": time_s, "east_m": 5 * time_s, "north_m": 0.0})
    stated = {"north_m": off_m * (-1.0) ** time_s, "var_east_m2": (radius_m / 1.515) ** 2}
    assert bool(stated_note(true.assign(**stated), true, "the truth")) == is_noted
    few = true.assign(**stated)[:19]
    assert stated_note(few, true, "the truth") == ""


@pytest.mark.parametrize(
    ("shift_s", "is_noted"), [(-4.0, True), (-3.0, False), (0.0, False), (3.0, False), (4.0, True)]
)
def test_clocks_may_differ_by_3_s_before_stated_errors_are_too_small(shift_s, is_noted):
    time_s = np.arange(60.0)
    true = pd.DataFrame({"time_s": time_s, "east_m": 5 * time_s, "north_m": 0.0})
    fixes = true.assign(time_s=time_s + shift_s, var_east_m2=0.3)
    assert bool(stated_note(fixes, true, "the truth")) == is_noted


def satellites(**columns):
    rows = {"time_s": 0.0, "satellite": "G07", "signal": "L1", "pseudorange_m": 2.2e7}
    rows |= {"sigma_m": 5.0, "x_m": 2.6e7, "y_m": 0.0, "z_m": 0.0}
    return pd.DataFrame({**rows, **columns})


def test_the_first_signal_of_a_satellite_is_kept():
    rows = satellites(signal=["L5", "L1", "L5"], satellite=["G07", "G07", "G08"], sigma_m=[1, 2, 3])
    notes = []
    kept = log_pseudoranges([], rows, notes)
    assert dict(zip(kept["satellite"], kept["sigma_m"], strict=True)) == {"G07": 2, "G08": 3}
    assert notes == ["pseudoranges: 1 of second signals left out"]


def test_satellites_are_20_000_to_55_000_km_from_the_centre():
    """GLONASS is at 25 500 km, the highest of QZSS and BeiDou at 46 000."""
    away_m = np.array([1.99e7, 2.0e7, 5.5e7, 5.51e7])
    notes = []
    kept = _sane_places(satellites(x_m=away_m), notes)
    assert kept["x_m"].isna().tolist() == [True, False, False, True]
    assert kept["y_m"].isna().tolist() == [True, False, False, True]
    assert notes == ["pseudoranges: 2 places of satellites are none, left out"]


@pytest.mark.parametrize(
    ("epochs", "off_m", "taken_m"), [(10, 3.5, 3.5), (9, 3.5, 0), (10, 3.0, 0), (10, -50, -50)]
)
def test_clocks_of_constellations_differ_by_more_than_3_m_in_10_epochs(epochs, off_m, taken_m):
    # Straight above a receiver at 0 degrees, whose distance from the centre is 6378137 m.
    of_gps = satellites(time_s=np.repeat(np.arange(epochs), 2), satellite=["G01", "G02"] * epochs)
    other = satellites(time_s=np.arange(epochs), satellite="E01")
    rows = pd.concat([of_gps, other.assign(pseudorange_m=2.2e7 + off_m)], ignore_index=True)
    notes = []
    raw = np.ones(len(rows), dtype=bool)
    found = _between_clocks_m(rows, raw, (0.0, 0.0, 0.0), notes)
    assert found[: 2 * epochs].tolist() == [0.0] * 2 * epochs
    assert found[2 * epochs :] == pytest.approx([taken_m] * epochs)
    assert bool(notes) == bool(taken_m)
