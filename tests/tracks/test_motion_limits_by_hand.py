"""Times and motion of a log by hand: where rows are cut, doubled, weeks apart, or scaled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import Faults, InputError
from mapfilter.tracks.checks.clock_notes import apart_note, week_fault, zoneless_note
from mapfilter.tracks.checks.cut_times import cut_times
from mapfilter.tracks.checks.second_deliveries import once_each
from mapfilter.tracks.checks.turn_noise import turns_at_standstill
from mapfilter.tracks.joining.position_units import continuous_deg, metres_about_middle, near_deg
from mapfilter.tracks.motion_factors import check_factors, scaled_motion
from mapfilter.tracks.readers.recorded.recording import Clock, Recording

NAN = np.nan
EXPORT = "(likely: those of an export, not of the positions)"


@pytest.mark.parametrize(
    ("times", "told"),
    [
        # Whole seconds of which most have three rows or more, at five times or more.
        (np.repeat(np.arange(5), 3), "10 of 15 rows have the time of another one"),
        (np.repeat(np.arange(4), 3), ""),
        (np.repeat(np.arange(5), 2), ""),
        (np.repeat(np.arange(5), [3, 3, 3, 1, 1]), "6 of 11 rows have the time of another one"),
        (np.repeat(np.arange(5), [3, 3, 1, 1, 1]), ""),
        (np.append(np.repeat(np.arange(5), 3), 7.5), ""),
        (np.append(np.repeat(np.arange(5), 3), NAN), "10 of 15 rows have the time of another one"),
        # One or two times of ten rows or more.
        (np.zeros(10), f"all 10 rows have 1 time {EXPORT}"),
        (np.zeros(9), ""),
        (np.repeat([0, 1], [15, 5]), f"all 20 rows have 2 times {EXPORT}"),
        (np.repeat([0, 1], [14, 5]), ""),
        (np.repeat([0, 1, 2], 10), ""),
        (np.full(20, NAN), ""),
    ],
)
def test_times_that_were_cut(times, told):
    found = cut_times(np.asarray(times, dtype=float))
    assert found.startswith(told)
    assert bool(found) is bool(told)


def pairs(count, within_s=0.1, single=0, **columns):
    """Rows of which each comes twice, a second apart, and after them some that come once."""
    time_s = np.repeat(np.arange(float(count)), 2) + np.tile([0.0, within_s], count)
    time_s = np.append(time_s, count + np.arange(float(single)))
    step_m = np.append(np.repeat(1 + 0.01 * np.arange(count), 2), 5 + 0.01 * np.arange(single))
    return pd.DataFrame({"time_s": time_s, "step_m": step_m} | columns)


@pytest.mark.parametrize(
    ("motion", "left"),
    [
        # Eight pairs and more, which are four fifths of the rows that move.
        (pairs(8), 8),
        (pairs(7), 14),
        (pairs(7, single=2), 16),
        (pairs(20, single=10), 30),
        (pairs(20, single=11), 51),
        # Sooner than four fifths of the interval before them, which is 1 s less that.
        (pairs(20, 0.44), 20),
        (pairs(20, 0.45), 40),
        # Alike in all that is known.
        (pairs(20, heading_rad=np.repeat(np.arange(20.0), 2)), 20),
        (pairs(20, turn_rad=NAN), 20),
        (pairs(20, turn_rad=np.tile([0.1, 0.2], 20)), 40),
        (pairs(20, turn_rad=np.tile([0.1, NAN], 20)), 40),
        (pairs(20, other=np.tile([0.1, 0.2], 20)), 20),
    ],
)
def test_rows_that_come_twice(motion, left):
    found = once_each(motion)
    assert len(found) == left
    if left < len(motion):
        kept = motion.drop_duplicates("step_m")
        pd.testing.assert_frame_equal(found, kept)
    else:
        assert found is motion


def test_rows_at_rest_and_a_third_of_one_kind_are_no_pairs():
    still = pd.concat([pairs(10), pairs(10).assign(step_m=0.0)], ignore_index=True)
    still["time_s"] = pairs(20)["time_s"]
    # Of those that move all come twice; those at rest stay.
    assert len(once_each(still)) == 30
    thrice = pairs(20).iloc[np.sort(np.append(np.arange(40), np.arange(1, 40, 2)))]
    thrice = thrice.assign(time_s=np.repeat(np.arange(20.0), 3) + np.tile([0.0, 0.1, 0.15], 20))
    assert once_each(thrice) is thrice


WEEKS_S = 1024 * 604_800


@pytest.mark.parametrize(
    ("gap_s", "offset"),
    [
        (WEEKS_S, WEEKS_S),
        (WEEKS_S + 86_399, WEEKS_S),
        (WEEKS_S - 86_399, WEEKS_S),
        (WEEKS_S + 86_400, None),
        (2 * WEEKS_S + 5, 2 * WEEKS_S),
        (5.0, None),
        (0.0, None),
    ],
)
def test_a_week_number_that_began_anew(gap_s, offset):
    told = week_fault(float(gap_s))
    assert told.endswith(f"--offset FILE={offset}") if offset else told == ""


def lasting(begin_s, end_s, name="a.csv", clock="utc"):
    rows = pd.DataFrame({"time_s": [float(begin_s), float(end_s)]})
    tables = {"positions": rows.assign(lat_deg=50.0, lon_deg=8.0)}
    return Recording(Path(name), "csv", "", Clock(clock), tables, 2, (), (), "")


NOW_S, HOUR_S = 1_777_629_600.0, 3600.0


@pytest.mark.parametrize(
    ("spans", "hours"),
    [
        # Up to an hour apart, unless it is the same time an hour or more later.
        ([(0.0, 0.45), (1.45, 1.55)], None),
        ([(0.0, 0.45), (1.46, 1.56)], 1.0),
        ([(0.0, 1.0), (2.0, 3.0)], 1.0),
        ([(0.0, 0.5), (1.0, 1.5)], 0.5),
        ([(0.0, 0.5), (1.24, 1.74)], 0.7),
        ([(0.0, 0.5), (1.26, 1.76)], None),
        ([(0.0, 0.2), (0.3, 0.5)], None),
        # The widest gap, whatever the order, and after what lasts longest.
        ([(9.0, 10.0), (0.0, 1.0), (4.0, 5.0)], 4.0),
        ([(0.0, 8.0), (1.0, 2.0), (8.5, 9.0)], None),
        ([(0.0, 8.0), (1.0, 2.0), (10.0, 11.0)], 2.0),
    ],
)
def test_recordings_that_lie_hours_apart(spans, hours):
    recordings = [lasting(*(NOW_S + HOUR_S * np.array(one))) for one in spans]
    told = apart_note(recordings, [0.0] * len(spans))
    assert len(told) == (hours is not None)
    if hours is not None:
        assert told[0].startswith(f"recordings lie up to {hours:.1f} h apart (likely: a wrong time")
    # Offsets bring them together.
    begins = [HOUR_S * begin for begin, _ in spans]
    assert apart_note(recordings, [-one for one in begins]) == []


def test_recordings_that_lie_weeks_apart():
    both = [lasting(NOW_S, NOW_S + 9), lasting(NOW_S - WEEKS_S, NOW_S - WEEKS_S + 9)]
    assert "week number began anew" in apart_note(both, [0.0, 0.0])[0]


def test_recordings_without_a_zone_are_named():
    local, utc = lasting(0, 9, "b.csv", "local"), lasting(0, 9, "u.csv")
    assert zoneless_note([utc]) == []
    assert zoneless_note([utc, local])[0].startswith("b.csv: local times that state no zone: UTC")
    told = zoneless_note([local, lasting(0, 9, "c.csv", "local")])[0]
    assert told.startswith("b.csv, c.csv: local times that state no zone, taken for one zone: UTC")


def standing(count=20, every_s=1.0, bias_radps=0.01, noise=0.002):
    turned = bias_radps * every_s + noise * np.sqrt(every_s) * np.resize([1.0, 0.0, -1.0], count)
    rows = {"time_s": every_s * np.arange(count + 1.0), "step_m": 0.0}
    return pd.DataFrame({**rows, "turn_rad": np.append(NAN, turned)})


@pytest.mark.parametrize(
    ("count", "every_s", "shown"),
    [(20, 1.0, True), (19, 2.0, False), (20, 0.99, False), (20, 5.0, True), (20, 5.01, False)],
)
def test_turns_at_standstill_show_noise_in_twenty_rows_and_seconds(count, every_s, shown):
    found = turns_at_standstill(standing(count, every_s))
    assert (found is not None) is shown
    if shown:
        assert found.bias_radps == pytest.approx(0.01, rel=0.2)


def test_turns_that_are_held_at_standstill_show_nothing():
    rows = standing(40)
    assert turns_at_standstill(rows.assign(step_m=0.1)) is None
    assert turns_at_standstill(standing(40, noise=0.0)) is None
    for held, shown in ((19, True), (20, False)):
        turned = rows["turn_rad"].mask((rows.index > 0) & (rows.index <= held), 0.0)
        assert (turns_at_standstill(rows.assign(turn_rad=turned)) is not None) is shown


MOTION = pd.DataFrame(
    {"step_m": [0.0, 2.0], "heading_rad": [1.0, -2.0], "turn_rad": [NAN, 0.5],
     "sampling_sd_m": [0.1, 0.2]}
)  # fmt: skip


@pytest.mark.parametrize(
    ("column", "factor", "changed"),
    [
        ("step_m", -2.0, {"step_m": [0, -4], "sampling_sd_m": [0.2, 0.4]}),
        ("heading_rad", -1.0, {"heading_rad": [-1, 2]}),
        ("heading_rad", 2.0, {"heading_rad": [2, 2 * np.pi - 4]}),
        ("turn_rad", 0.5, {"turn_rad": [NAN, 0.25]}),
        ("turn_rad", 1.0, {}),
    ],
)
def test_columns_of_motion_times_their_factor(column, factor, changed):
    found, notes = scaled_motion(MOTION, {column: factor}, "drive")
    told = f"motion, {column}: times {factor:g}, as given"
    assert notes == ((told,) if changed else ())
    for name in MOTION:
        expected = changed.get(name, MOTION[name].tolist())
        assert found[name].tolist() == pytest.approx(expected, nan_ok=True)
    bare = MOTION[["step_m"]]
    assert scaled_motion(bare, {"step_m": 3.0}, "drive")[0]["step_m"].tolist() == [0.0, 6.0]


def test_factors_of_what_is_not_there_and_of_none():
    for motion in (None, MOTION.drop(columns="turn_rad"), MOTION.assign(turn_rad=NAN)):
        with pytest.raises(InputError) as caught:
            scaled_motion(motion, {"turn_rad": 2.0}, "drive")
        (fault,) = caught.value.faults
        assert (fault.where, fault.expected) == (
            "drive, --factor turn_rad",
            "motion with turn_rad",
        )
    assert scaled_motion(None, {}, "drive") == (None, ())
    faults = Faults()
    given = {"step_m": 0.0, "turn_rad": np.inf, "heading_rad": -1e-9, "speed": 2.0}
    check_factors(given, "--factor", faults)
    assert [(fault.where, fault.got) for fault in faults.found] == [
        ("--factor step_m", "0"),
        ("--factor turn_rad", "inf"),
        ("--factor", "speed"),
    ]


def test_longitudes_of_one_track_go_on_across_180_degrees():
    assert near_deg([179.0, -179.0, 541.0], 179.0) == pytest.approx([179.0, 181.0, 181.0])
    assert near_deg([0.0, 359.0], 0.0) == pytest.approx([0.0, -1.0])
    lon_deg = continuous_deg([NAN, 179.5, -179.5, NAN, -179.0])
    assert lon_deg == pytest.approx([NAN, 179.5, 180.5, NAN, 181.0], nan_ok=True)
    assert np.isnan(continuous_deg([NAN, NAN])).all()


def test_metres_about_the_middle_of_a_track():
    """A degree of a great circle of the mean earth is 111 195 m, and half of it at 60 degrees."""
    east_m, north_m = metres_about_middle([179.0, 180.0, -179.0, NAN], [60.0, 60.0, 61.0, 5.0])
    half_m = 111_195 / 2
    assert east_m == pytest.approx([-half_m, 0.0, half_m, NAN], nan_ok=True)
    assert north_m[:3] == pytest.approx([0.0, 0.0, 111_195.0])
    nothing = metres_about_middle([NAN, 1.0], [1.0, NAN])
    assert np.isnan(nothing).all()
