"""Alignment of clocks by hand: the common clock, zones, and shifts by positions and speeds."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.joining.alignment import (
    _by_speed,
    _clock,
    _common,
    _disagreement,
    _moved,
    _offset,
    _rate,
    _reference,
    _speed,
    _zone,
    align,
)
from mapfilter.tracks.joining.position_shift import places_of
from mapfilter.tracks.readers.recorded.recording import Clock, Recording

DEGREE_M = 111_195.0
UTC, GPS, UNKNOWN = Clock("utc"), Clock("gps"), Clock("monotonic")
LOCAL, ZONED = Clock("local"), Clock("local", "+02:00")
START_S = 1_777_629_600.0
"""2026-05-01 10:00:00 UTC."""
WEEK_S = 1_777_161_582.0
"""Begin of its GPS week in UTC: 26 April less 18 s, 468018 s before."""


def recording(clock=UTC, name="a.csv", **tables):
    return Recording(
        Path(name), "csv", "", clock, {of: pd.DataFrame(rows) for of, rows in tables.items()}, 0
    )


def along(time_s, east_m, north_m=0.0):
    """Return positions along 60 degrees north, where a degree of longitude is half as long."""
    lat = 60 + np.broadcast_to(north_m, len(time_s)) / DEGREE_M
    lon = 25 + 2 * east_m / DEGREE_M
    return {"time_s": time_s, "lat_deg": lat, "lon_deg": lon, "speed_mps": np.nan}


def speeds(time_s, seed=1):
    """Return uneven speeds of each second."""
    knots = np.random.default_rng(seed).uniform(2, 16, 200)
    return np.interp(np.asarray(time_s) / 10, np.arange(200), knots)


def drive(clock, begin_s, seconds, name="b.csv", seed=1):
    """Return odometry of some seconds of a drive, on a clock that has another time at its start."""
    seconds = np.asarray(seconds, dtype=float)
    rows = {"time_s": begin_s + seconds - seconds[0], "speed_mps": speeds(seconds, seed)}
    return recording(clock, name, odometry=rows)


PLACES = along(np.arange(3.0), np.zeros(3))
ONE = {"time_s": [0.0]}


@pytest.mark.parametrize(
    ("recordings", "reference"),
    [
        # UTC goes before local times, these before an unknown start.
        ([recording(UNKNOWN, positions=PLACES), recording(LOCAL, steps=ONE)], 1),
        ([recording(LOCAL, positions=PLACES), recording(UTC, steps=ONE)], 1),
        ([recording(LOCAL, positions=PLACES), recording(GPS, steps=ONE)], 1),
        ([recording(LOCAL, positions=PLACES), recording(ZONED, steps=ONE)], 1),
        # Then positions before the truth, and this before neither.
        ([recording(UTC, steps=ONE), recording(UTC, truth=PLACES)], 1),
        ([recording(UTC, truth=PLACES), recording(UTC, positions=PLACES)], 1),
        ([recording(UNKNOWN, steps=ONE), recording(UNKNOWN, positions=PLACES)], 1),
        ([recording(UTC, steps=ONE), recording(ZONED, positions=PLACES)], 1),
        ([recording(UTC, steps=ONE), recording(UTC, steps=ONE)], 0),
    ],
)
def test_the_common_clock_is_that_of_the_best_recording(recordings, reference):
    assert _reference(recordings) == reference


@pytest.mark.parametrize(
    ("begin_s", "end_s", "shift_s", "share"),
    [
        # Beside 0 to 100 s.
        (50.0, 250.0, 0.0, 0.5),
        (50.0, 250.0, -50.0, 1.0),
        (50.0, 250.0, 100.0, -0.5),
        (20.0, 60.0, 0.0, 1.0),
        (-30.0, 10.0, 0.0, 0.25),
        (-30.0, 10.0, 10.0, 0.5),
    ],
)
def test_the_share_of_the_shorter_recording_in_the_other(begin_s, end_s, shift_s, share):
    first = recording(steps={"time_s": [0.0, 40.0, 100.0]})
    other = recording(steps={"time_s": [begin_s, end_s]})
    assert _common(other, first, shift_s) == pytest.approx(share)


@pytest.mark.parametrize(
    ("shift_s", "text"),
    [
        (0.0, "+00:00"),
        (19800.0, "+05:30"),
        (-12600.0, "-03:30"),
        (50400.0, "+14:00"),
        (-900.0, "-00:15"),
        (35100.0, "+09:45"),
        (-0.0, "+00:00"),
    ],
)
def test_hours_and_minutes_of_zones(shift_s, text):
    assert _clock(shift_s) == text


def test_steps_over_their_seconds_are_speeds():
    """Of steps of 2, 4, 1, 6 and NaN m in 1, 2, 0, 3 and 1 s."""
    time_s, speed = _rate(np.array([0.0, 1, 3, 3, 6, 7]), np.array([2.0, 4, 1, 6, np.nan]))
    assert time_s.tolist() == [1, 3, 6]
    assert speed.tolist() == [2, 2, 2]


@pytest.mark.parametrize(
    ("east_m", "north_m", "moved"),
    [
        (0, 49.9, False),
        (0, 50.1, True),
        (49.9, 0, False),
        (50.1, 0, True),
        (30, 39, False),
        (30, 41, True),
    ],
)
def test_positions_that_span_50_m_have_moved(east_m, north_m, moved):
    """30 and 39 m are 49.2 m; 30 and 41 m are 50.8 m."""
    found = along(np.arange(3.0), east_m * np.array([0, 0, 1]), north_m * np.array([0, 1, 0.5]))
    assert _moved((found["time_s"], found["lon_deg"], found["lat_deg"])) == moved


COUNT = 10
TIMES = 2.0 * np.arange(COUNT)


@pytest.mark.parametrize(
    ("tables", "time_s", "speed"),
    [
        # Of ten values each, the first of these that has so many.
        ({"odometry": {"time_s": TIMES, "speed_mps": -3.0}}, TIMES, 3.0),
        ({"positions": {"time_s": TIMES, "speed_mps": 4.0}}, TIMES, 4.0),
        (
            {
                "odometry": {"time_s": TIMES, "speed_mps": [np.nan, *[3.0] * 9]},
                "positions": {"time_s": TIMES, "speed_mps": 4.0},
            },
            TIMES,
            4.0,
        ),
        (
            {"odometry": {"time_s": [-1, *TIMES], "speed_mps": [np.nan, *[3.0] * 10]}},
            TIMES,
            3.0,
        ),
        ({"motion": {"time_s": TIMES, "step_m": -3.0}}, TIMES[1:], 1.5),
        # 3, 4 and 12 m are 13 m in 2 s.
        (
            {"poses": {"time_s": TIMES, "x_m": 1.5 * TIMES, "y_m": 2 * TIMES, "z_m": 6 * TIMES}},
            TIMES[1:],
            6.5,
        ),
        ({"positions": along(TIMES, 5 * TIMES)}, TIMES, 5.0),
        ({"truth": along(TIMES, 5 * TIMES)}, TIMES, 5.0),
    ],
)
def test_speeds_of_the_first_table_that_has_ten(tables, time_s, speed):
    found = _speed(recording(**tables))
    assert found[0].tolist() == pytest.approx(list(time_s))
    assert found[1].tolist() == pytest.approx([speed] * len(time_s))


@pytest.mark.parametrize(
    "tables",
    [
        {"motion": {"time_s": TIMES[1:], "step_m": 3.0}},
        {"poses": {"time_s": TIMES[1:], "x_m": TIMES[1:], "y_m": 0.0, "z_m": 0.0}},
        {"truth": along(TIMES[1:], TIMES[1:])},
    ],
)
def test_nine_values_are_no_speeds(tables):
    assert _speed(recording(**tables)) is None


@pytest.mark.parametrize(
    ("one", "other", "late_s"),
    # Of seconds of a drive; the other one's clock is at 0 where the first one's is at 1000.
    [
        ((0, 300), (0, 300), 0),
        ((0, 300), (37, 137), 37),
        ((60, 160), (0, 300), -60),
        ((0, 200), (90, 290), 90),
        ((90, 290), (0, 200), -90),
    ],
)
def test_speeds_agree_at_the_shift_of_their_clocks(one, other, late_s):
    """Whole seconds are whole fifths of one: both are the same numbers there."""
    found = []
    for begin_s, (first, last) in ((1000.0, one), (0.0, other)):
        time_s = np.arange(first, last, 1.0)
        found.append((begin_s + time_s - first, speeds(time_s)))
    shift_s, correlation = _by_speed(*found)
    assert shift_s == pytest.approx(1000.0 + late_s)
    assert correlation == pytest.approx(1.0)


def test_shifts_leave_half_of_the_shorter_one_in_common():
    """80 s of 200 s are too few."""
    one, other = ((t - t[0], speeds(t)) for t in (np.arange(0.0, 200.0), np.arange(120.0, 320.0)))
    shift_s, correlation = _by_speed(one, other)
    assert abs(shift_s) <= 100
    assert correlation < 0.9


def test_few_speeds_have_no_shift():
    time_s = np.arange(10.0)
    ten = time_s, speeds(10 * time_s)
    assert _by_speed(ten, ten) == pytest.approx((0, 1))
    nine = ten[0][1:], ten[1][1:]
    moment = np.zeros(10), ten[1]
    for one, other in ((nine, ten), (ten, nine), (None, ten), (ten, None), (ten, moment)):
        assert _by_speed(one, other) == (0.0, 0.0)


@pytest.mark.parametrize("shift_s", [-9_900.0, 45_900.0, -50_400.0, 0.0])
def test_local_times_by_positions(shift_s):
    """Whole quarters of an hour to 14 h: zones that are not in use, too."""
    time_s = START_S + np.arange(100.0)
    first = recording(positions=along(time_s, 10 * np.arange(100.0)))
    other = recording(LOCAL, "b.csv", positions=along(time_s - shift_s, 10 * np.arange(100.0)))
    found, note = _zone(other, first, places_of(first), places_of(other))
    assert found == shift_s
    zone = _clock(-shift_s)
    assert note.startswith(f"local time is UTC{zone} (by positions, median 0.0 m apart)")
    assert note.endswith("; positions agree within 0.0 m (median)")


@pytest.mark.parametrize(
    ("apart_m", "shift_s", "by"),
    [(2_010.0, 7_200.0, "the overlap of times"), (1_990.0, -9_900.0, "positions")],
)
def test_positions_of_two_places_tell_no_zone(apart_m, shift_s, by):
    """Beyond 2 km times do: the first of the zones by which both end, or begin, together."""
    time_s = np.arange(0.0, 18_001, 60)
    first = recording(positions=along(time_s, 0.1 * time_s))
    there_s = np.arange(7_200.0, 10_801, 60)
    rows = along(there_s, 0.1 * (there_s - 9_900), apart_m)
    other = recording(LOCAL, "b.csv", positions=rows)
    found, note = _zone(other, first, places_of(first), places_of(other))
    assert found == shift_s
    assert f"(by {by}" in note


def of_times(clock, name, *time_s):
    return recording(clock, name, steps={"time_s": list(time_s)})


def test_local_times_by_their_overlap():
    """Two ends fit: both end together by UTC, and begin together two hours earlier."""
    first = of_times(UTC, "a.csv", 0, 10_800)
    found, note = _zone(of_times(LOCAL, "b.csv", 7_200, 10_800), first, None, None)
    assert found == 0
    also = "UTC+02:00 or UTC+01:00 would do as well: --zone"
    assert note == f"local time is UTC+00:00 (by the overlap of times; {also})"
    # 5:30 h ahead; no other zone has all of it.
    first = of_times(UTC, "a.csv", 0, 600)
    found, note = _zone(of_times(LOCAL, "b.csv", 19_800, 20_400), first, None, None)
    assert found == -19_800
    assert note == "local time is UTC+05:30 (by the overlap of times)"


def test_local_times_that_overlap_in_no_zone_are_refused():
    first = of_times(UTC, "a.csv", 0, 600)
    # Zones lie between 12 h behind UTC and 14 h ahead of it.
    assert _zone(of_times(LOCAL, "b.csv", 50_400, 51_000), first, None, None)[0] == -50_400
    assert _zone(of_times(LOCAL, "b.csv", -43_200, -42_600), first, None, None)[0] == 43_200
    for begin_s in (51_000, -43_800):
        with pytest.raises(InputError, match=r"overlap those of a\.csv in some zone, found none"):
            _zone(of_times(LOCAL, "b.csv", begin_s, begin_s + 600), first, None, None)


def test_positions_2_km_apart_tell_a_zone():
    """On the equator, by a difference of latitudes that is 2000 m to the last bit."""
    off_deg = 2_000.0 / DEGREE_M
    assert DEGREE_M * off_deg == 2_000.0
    time_s = np.arange(0.0, 601, 60)
    places = {"time_s": time_s, "lat_deg": 0.0, "lon_deg": 25.0}
    first = recording(positions=places)
    other = recording(LOCAL, "b.csv", positions=places | {"lat_deg": off_deg})
    _, note = _zone(other, first, places_of(first), places_of(other))
    assert "(by positions, median 2000.0 m apart)" in note


LINE = 10.0 * np.arange(200.0)


def timed(time_s, east_m, north_m=0.0):
    found = along(time_s, east_m, north_m)
    return found["time_s"], found["lon_deg"], found["lat_deg"]


@pytest.mark.parametrize(
    ("late_s", "aside_m", "note"),
    [
        # At 10 m/s; a second and a half is remarkable.
        (0.0, 0.0, "positions agree within 0.0 m (median)"),
        (1.4, 0.0, "positions agree within 14.0 m (median)"),
        (
            1.6,
            0.0,
            "positions agree best -1.6 s shifted (0.0 m, not 16.0 m); not applied, see --offset",
        ),
        (
            -5.0,
            0.0,
            "positions agree best +5.0 s shifted (0.0 m, not 50.0 m); not applied, see --offset",
        ),
        # If it leaves less than four fifths: 30 of √(30² + 20²) m are 0.83, of √(30² + 25²) 0.77.
        (2.0, 30.0, "positions agree within 36.1 m (median)"),
        (
            2.5,
            30.0,
            "positions agree best -2.5 s shifted (30.0 m, not 39.1 m); not applied, see --offset",
        ),
        (0.0, 1_990.0, "positions agree within 1990.0 m (median)"),
        (
            0.0,
            2_010.0,
            "positions lie 2.0 km from those of the same times in a.csv (median) (likely: another "
            "journey, another day's times, or positions that were spoofed)",
        ),
    ],
)
def test_notes_on_positions_of_two_clocks(late_s, aside_m, note):
    time_s = np.arange(200.0)
    other = timed(time_s + late_s, LINE, aside_m)
    assert _disagreement("a.csv", timed(time_s, LINE), other) == note


@pytest.mark.parametrize("still", [0, 1])
def test_positions_in_one_place_have_no_clock(still):
    time_s = np.arange(200.0)
    pair = [timed(time_s, LINE), timed(time_s, 0.02 * LINE)]
    assert _disagreement("a.csv", pair[still], pair[1 - still]) == ""
    assert _disagreement("a.csv", None, pair[0]) == _disagreement("a.csv", pair[0], None) == ""
    assert _disagreement("a.csv", pair[0], timed(time_s + 500, LINE)) == ""


@pytest.mark.parametrize(("apart_m", "by_positions"), [(90.0, True), (110.0, False)])
def test_a_clock_from_an_unknown_start_by_positions(apart_m, by_positions):
    """Within 100 m of each other."""
    first = recording(positions=along(START_S + np.arange(200.0), LINE))
    other = recording(UNKNOWN, "b.csv", positions=along(np.arange(50.0), LINE[60:110], apart_m))
    if by_positions:
        shift_s, note = _offset(other, first, 0.0)
        assert shift_s == pytest.approx(START_S + 60, abs=0.06)
        assert note.endswith(f"s, by positions (median {apart_m:.1f} m apart)")
        # The first one's times as they were given.
        assert _offset(other, first, 7.0)[0] == pytest.approx(START_S + 67, abs=0.06)
    else:
        with pytest.raises(InputError) as raised:
            _offset(other, first, 0.0)
        assert str(raised.value).startswith(
            "b.csv: expected positions or speeds in common with a.csv, found times in seconds from "
            "an unknown start, and none (likely: "
        )
        assert str(raised.value).endswith(
            "--offset b.csv=SECONDS, the seconds to add to its times (Unix time of its time 0))"
        )


@pytest.mark.parametrize(("begin_s", "shift_s"), [(50.0, 0.0), (51.0, -51.0)])
def test_unknown_starts_are_one_where_half_is_in_common(begin_s, shift_s):
    time_s = np.arange(101.0)
    first = recording(UNKNOWN, positions=along(time_s, LINE[:101]))
    other = recording(UNKNOWN, "b.csv", positions=along(time_s + begin_s, LINE[:101]))
    found, note = _offset(other, first, 0.0)
    assert found == pytest.approx(shift_s, abs=0.06)
    assert note.endswith("by positions (median 0.0 m apart)") == (shift_s != 0)
    if not shift_s:
        assert note == ""


@pytest.mark.parametrize(("apart_m", "is_far"), [(1_900.0, False), (2_100.0, True)])
def test_one_unknown_start_of_two_places(apart_m, is_far):
    time_s = np.arange(200.0)
    first = recording(UNKNOWN, positions=along(time_s, LINE))
    other = recording(UNKNOWN, "b.csv", positions=along(time_s, LINE, apart_m))
    found, note = _offset(other, first, 0.0)
    assert found == 0
    assert ("km from those of the same times in a.csv" in note) == is_far
    assert is_far or note == ""


def test_seconds_of_the_gps_week():
    """10:00:00 UTC of that Friday is second 468018 in GPS time, which is 18 s ahead."""
    first = of_times(UTC, "a.csv", START_S, START_S + 100)
    other = of_times(UNKNOWN, "b.csv", 468_018, 468_118)
    assert _offset(other, first, 0.0) == (
        WEEK_S,
        "+1777161582.0 s, as seconds of the GPS week",
    )


@pytest.mark.parametrize("late_s", [0.0, 100.0])
def test_seconds_of_the_gps_week_that_speeds_contradict(late_s):
    """A clock that is 100 s slow is none of the week."""
    first = drive(UTC, START_S, np.arange(700.0), "a.csv")
    other = drive(UNKNOWN, 468_018.0, late_s + np.arange(500.0))
    shift_s, note = _offset(other, first, 0.0)
    assert shift_s == pytest.approx(WEEK_S + late_s)
    by = "by speeds (correlation 1.00)" if late_s else "as seconds of the GPS week"
    assert note == f"+{WEEK_S + late_s:.1f} s, {by}"


@pytest.mark.parametrize("seed", range(3))
def test_speeds_over_a_pause_of_a_receiver_are_not_compared(seed):
    """Those between the ends of the gap told against the right shift: 0.5 instead of 0.99."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(900.0)
    speed = np.interp(time_s / 20, np.arange(47.0), rng.uniform(0, 16, 47))
    heard = (time_s < 250) | (time_s >= 600)
    shift_s, correlation = _by_speed((time_s[heard] + 1e6, speed[heard]), (time_s + 55, speed))
    assert shift_s == pytest.approx(1e6 - 55, abs=0.2)
    assert correlation > 0.99


def test_a_clock_from_an_unknown_start_by_speeds():
    first = drive(LOCAL, 5_000.0, np.arange(400.0), "a.csv")
    shift_s, note = _offset(drive(UNKNOWN, 0.0, np.arange(100.0, 250.0)), first, 0.0)
    assert shift_s == pytest.approx(5_100)
    assert note == "+5100.0 s, by speeds (correlation 1.00)"
    other = of_times(UNKNOWN, "b.csv", 0, 100)
    with pytest.raises(InputError, match=r"the seconds to add to its times\)$"):
        _offset(other, first, 0.0)


def test_offsets_of_all_recordings():
    """Those that are given are taken as they are, and move the first one's times for others."""
    time_s = START_S + np.arange(200.0)
    recordings = [
        recording(UTC, "a.csv", positions=along(time_s, LINE)),
        recording(UTC, "b.csv", positions=along(time_s + 5, LINE)),
        recording(UNKNOWN, "c.csv", positions=along(np.arange(200.0), LINE)),
        recording(UNKNOWN, "d.csv", steps={"time_s": [0.0, 50.0]}),
    ]
    found = align(recordings, {Path("a.csv"): 5.0, Path("d.csv"): START_S})
    assert found.absolute
    assert found.offsets_s[:2] == (5, 0)
    assert found.offsets_s[2] == pytest.approx(START_S + 5, abs=0.06)
    assert found.offsets_s[3] == START_S
    assert found.notes[0] == "a.csv: +5 s, as given"
    assert found.notes[1] == "b.csv: positions agree within 0.0 m (median)"
    assert found.notes[2].startswith("c.csv: +17776296")
    assert found.notes[3] == "d.csv: +1.77763e+09 s, as given"
    assert len(found.notes) == 4


def test_local_times_alone_state_no_zone():
    recordings = [of_times(LOCAL, "a.csv", 0, 100), of_times(LOCAL, "b.csv", 50, 150)]
    found = align(recordings, {})
    assert (found.offsets_s, found.absolute) == ((0, 0), False)
    (note,) = found.notes
    assert note.startswith("a.csv, b.csv: local times that state no zone, taken for one zone")
    (note,) = align(recordings, {Path("a.csv"): 3.0}).notes[1:]
    assert note.startswith("b.csv: local times that state no zone: UTC is unknown")
