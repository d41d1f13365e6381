"""Motion is compared with fixes on both sides of a gap between them, however long it is.

Drives turn by right angles over 6 s; walks turn at once, and stand now and then. Errors of fixes
last for 40 s.
"""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.checks.headings import are_mirrored
from mapfilter.tracks.checks.mirrored import mirrored_by
from mapfilter.tracks.checks.motion_faults import motion_faults
from mapfilter.tracks.checks.stretches import stretches
from mapfilter.tracks.checks.turn_drift import turn_drift_radps

COUNT = 900


def lasting(rng, sd, tau_s=40.0, count=COUNT):
    """Return errors whose correlation falls to 1/e in a time."""
    keep = np.exp(-1 / tau_s)
    white = rng.normal(0, sd, count)
    values = [white[0]]
    for one in np.sqrt(1 - keep**2) * white[1:]:
        values.append(keep * values[-1] + one)
    return np.array(values)


def drive(seed, turns_s=(100, 190, 280, 480, 640, 730, 820), bias_degps=0.1):
    """Return motion by odometry, and a fix each second: 15 minutes at 12 m/s, 5 m/s in turns."""
    rng = np.random.default_rng(seed)
    rate, speed = np.zeros(COUNT), np.full(COUNT, 12.0)
    for at, side in zip(turns_s, rng.choice([-1, 1], len(turns_s)), strict=True):
        rate[at : at + 6] = np.radians(15.0) * side
        speed[at - 5 : at + 9] = 5.0
    course = np.cumsum(rate)
    east, north = (np.cumsum(speed * f(course - rate / 2)) for f in (np.cos, np.sin))
    noise = np.radians(rng.normal(bias_degps, 0.3, COUNT))
    turn_m = {"step_m": 1.02 * speed, "heading_rad": np.nan, "turn_rad": rate + noise}
    places = {"east_m": east + lasting(rng, 2.5), "north_m": north + lasting(rng, 2.5)}
    time_s = np.arange(float(COUNT))
    return pd.DataFrame({"time_s": time_s, **turn_m}), pd.DataFrame({"time_s": time_s, **places})


def walk(seed, leg_s=90, rests_s=(200, 550), fix_sd_m=3.0):
    """Return motion by steps and a compass, and a fix each second; two rests of 40 s."""
    rng = np.random.default_rng(seed)
    sides = rng.choice([-1, 1], COUNT // leg_s)
    course = np.repeat(rng.uniform(-np.pi, np.pi) + np.pi / 2 * np.cumsum(sides), leg_s)
    speed = np.full(COUNT, 1.35)
    for at in rests_s:
        speed[at : at + 40] = 0.0
    east, north = (np.cumsum(speed * f(course)) for f in (np.cos, np.sin))
    off_deg = 4 + lasting(rng, 6.0, 60.0) + rng.normal(0, 4, COUNT)
    heading = np.angle(np.exp(1j * (course + np.radians(off_deg))))
    off_m = [lasting(rng, fix_sd_m) for _ in range(2)]
    places = {"east_m": east + off_m[0], "north_m": north + off_m[1]}
    time_s = np.arange(float(COUNT))
    motion = {"step_m": speed, "heading_rad": heading, "turn_rad": np.nan}
    return pd.DataFrame({"time_s": time_s, **motion}), pd.DataFrame({"time_s": time_s, **places})


def without(places, *gaps_s):
    """Return places outside of gaps: pairs of begin and end."""
    for begin_s, end_s in gaps_s:
        places = places[~places["time_s"].between(begin_s, end_s, inclusive="left")]
    return places


LONG = (300, 700)
HALVES = ((110, 320), (500, 710))
GAPS = [[LONG], HALVES, [(0, 300), (650, 660)], [(at, at + 40) for at in range(50, 850, 100)]]


@pytest.mark.parametrize("gaps_s", GAPS)
@pytest.mark.parametrize(
    ("column", "factor"),
    [("turn_rad", -1.0), ("turn_rad", np.pi / 180), ("step_m", 1 / 3.6), ("step_m", 3.6)],
)
def test_faults_of_a_drive_are_found_on_both_sides_of_gaps(column, factor, gaps_s):
    for seed in range(5):
        motion, places = drive(seed)
        wrong = motion.assign(**{column: factor * motion[column]})
        (fault,) = motion_faults(wrong, without(places, *gaps_s)).values()
        assert fault.column == column
        assert fault.factor == pytest.approx(1 / factor)


@pytest.mark.parametrize("gaps_s", [*GAPS, [(420, 440)], [(100, 850)]])
@pytest.mark.parametrize("made", [drive, walk])
def test_right_motion_is_no_fault_with_gaps(made, gaps_s):
    for seed in range(100, 110):
        motion, places = made(seed)
        assert motion_faults(motion, without(places, *gaps_s)) == {}


def test_a_log_with_a_gap_is_refused_also_with_a_truth():
    motion, places = drive(7)
    gnss = without(places, LONG)
    for truth in (None, places):
        right = mf.make_log("EPSG:32633", motion=motion, gnss=gnss, truth=truth)
        assert not any("turn_rad" in note for note in right.notes)
        turned = motion.assign(turn_rad=-motion["turn_rad"])
        log = mf.make_log("EPSG:32633", motion=turned, gnss=gnss, truth=truth)
        with pytest.raises(InputError, match=r'factors=\{"turn_rad": -1\} mends it'):
            mf.locate(log, filter="ekf")


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_lines_are_as_fine_as_without_a_gap_and_none_leads_over_it(share):
    time_s = np.arange(2001.0)
    truth = pd.DataFrame({"time_s": time_s, "east_m": 10 * time_s, "north_m": 0.0})
    gap_s = 1000 * (1 - share), 1000 * (1 + share)
    found = stretches(without(truth, gap_s), time_s, 10 * time_s)
    for line_m in (found.before_m, found.after_m):
        assert np.abs(line_m).min() >= 25.0
        assert np.abs(line_m).max() <= 60.0
    assert len(found) > (1 - share) * 20_000 / 60 - 4


def test_a_drift_of_turns_is_found_on_both_sides_of_a_gap():
    for seed in range(4):
        motion, places = drive(seed, bias_degps=1.0)
        found = turn_drift_radps(motion, without(places, LONG))
        assert np.degrees(found) == pytest.approx(1.0, abs=0.2)
        motion, places = drive(seed)
        assert turn_drift_radps(motion, without(places, LONG)) == 0.0


def test_two_corners_are_too_few_to_blame_turns():
    motion, places = drive(3, turns_s=(200, 700))
    wrong = motion.assign(turn_rad=-motion["turn_rad"])
    assert motion_faults(wrong, places) == {}
    motion, places = drive(3, turns_s=(100, 200, 700, 800))
    wrong = motion.assign(turn_rad=-motion["turn_rad"])
    assert set(motion_faults(wrong, places)) == {"turn_rad"}


def test_a_gyroscope_that_is_dead_is_none_in_radians():
    """Its noise, 57 times as large, turns everywhere."""
    rng = np.random.default_rng(8)
    for seed in range(40):
        motion, places = drive(seed)
        noise = np.radians(rng.uniform(-0.2, 0.2) + rng.normal(0, 0.3, COUNT))
        for dead in (noise, np.zeros(COUNT)):
            assert motion_faults(motion.assign(turn_rad=dead), without(places, LONG)) == {}


def degrees(places):
    """Return places as longitude and latitude."""
    lon_deg, lat_deg = 13.0 + places["east_m"] / 67_000, 52.5 + places["north_m"] / 111_000
    return places[["time_s"]].assign(lon_deg=lon_deg, lat_deg=lat_deg)


@pytest.mark.parametrize("gaps_s", [*GAPS, []])
def test_azimuths_counter_clockwise_are_found_on_both_sides_of_gaps(gaps_s):
    for seed in range(5):
        motion, places = walk(seed)
        places = without(places, *gaps_s)
        assert mirrored_by(motion, degrees(places)) == ""
        assert not are_mirrored(motion, places)
        mirrored = motion.assign(heading_rad=np.pi - motion["heading_rad"])
        assert mirrored_by(mirrored, degrees(places)) == "a lost sign of longitude"
        assert are_mirrored(mirrored, places)


@pytest.mark.parametrize("gaps_s", [*GAPS, []])
def test_headings_that_count_from_north_are_found_on_both_sides_of_gaps(gaps_s):
    for seed in range(5):
        motion, places = walk(seed, fix_sd_m=1.0)
        wrong = motion.assign(heading_rad=np.pi / 2 - motion["heading_rad"])
        found = motion_faults(wrong, without(places, *gaps_s))
        assert found["heading_rad"].option == "--column compass_deg=COLUMN"


@pytest.mark.parametrize("turned_deg", [90.0, 180.0, -120.0])
def test_a_phone_that_is_turned_is_not_mirrored(turned_deg):
    for seed in range(50, 60):
        motion, places = walk(seed)
        at_s = np.random.default_rng(seed).integers(0, COUNT, 2)
        turned = np.radians(turned_deg) * (motion["time_s"].to_numpy()[:, None] >= at_s).sum(1)
        held = motion.assign(heading_rad=motion["heading_rad"] + turned)
        for gaps_s in ([], [LONG]):
            assert not are_mirrored(held, without(places, *gaps_s))


def test_a_phone_that_is_turned_at_the_only_corner_is_not_surely_mirrored():
    """Back to front on the first leg, it tells the same as a mirror image."""
    time_s = np.arange(200.0)
    course = np.where(time_s < 100, 0.0, np.pi / 2)
    east, north = (np.cumsum(1.3 * f(course)) for f in (np.cos, np.sin))
    places = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})
    motion = pd.DataFrame({"time_s": time_s, "step_m": 1.3, "heading_rad": np.pi - course})
    assert mirrored_by(motion, degrees(places)) == "a lost sign of longitude"
    assert not are_mirrored(motion, places)
