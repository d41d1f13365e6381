"""Clocks that differ by seconds or by weeks: GPS time for UTC, dates of old receivers."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.joining.speed_shift import best_shift, shift_note

COUNT = 900
TIME_S = 1_778_666_400.0 + np.arange(float(COUNT))
METRES_PER_DEGREE = 111_195.0
WEEKS_S = 1024 * 7 * 86_400


@pytest.fixture
def notes(tmp_path):
    """Notes on a drive of uneven speed, with fixes of 3 m and a clock of its odometry."""

    def of(shift_s, *, steady=False, seed=1, fixes_s=COUNT, jammed_s=(0, 0)):
        rng = np.random.default_rng(seed)
        knots = rng.uniform(0, 16, COUNT // 20 + 2)
        speed = np.full(COUNT, 10.0) if steady else np.interp(np.arange(COUNT) / 20, *_at(knots))
        rate = np.where(np.arange(COUNT) % 60 >= 54, np.pi / 12, 0.0) * rng.choice([-1, 1])
        heading = np.cumsum(rate) - rate / 2
        east_m, north_m = np.cumsum(speed * np.cos(heading)), np.cumsum(speed * np.sin(heading))
        off_m = rng.normal(0, 3, (2, COUNT))
        places = {"lat": 60 + (north_m + off_m[0]) / METRES_PER_DEGREE}
        places["lon"] = 25 + 2 * (east_m + off_m[1]) / METRES_PER_DEGREE
        odometry = {"wheel_speed_mps": speed, "yaw_rate_radps": rate}
        for name, times, rows in (
            ("fixes.csv", TIME_S, places),
            ("odometry.csv", TIME_S + shift_s, odometry),
        ):
            table = pd.DataFrame({"time": times, **rows})
            if name == "fixes.csv":
                table = table[:fixes_s].drop(index=range(*jammed_s))
            table.to_csv(tmp_path / name, index=False)
        found = mf.read_log([tmp_path / "fixes.csv", tmp_path / "odometry.csv"]).notes
        return [note for note in found if "speeds agree" in note]

    return of


def _at(knots):
    return np.arange(len(knots), dtype=float), knots


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shift_s", [18.0, -7.0])
def test_a_clock_of_other_seconds_is_named(notes, shift_s, seed):
    (note,) = notes(shift_s, seed=seed)
    before, _, after = note.partition(" best ")
    assert before == "odometry.csv: speeds agree with those of fixes.csv"
    assert float(after.split()[0]) == pytest.approx(-shift_s, abs=1.0)
    assert ("(likely: GPS time for UTC)" in note) == (shift_s == 18.0)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shift_s", [18.0, 7.0, -18.0])
def test_so_is_one_where_positions_end_early(notes, shift_s, seed):
    """As of a drive that is jammed: shifts to one side leave too little in common."""
    (note,) = notes(shift_s, seed=seed, fixes_s=220)
    assert float(note.partition(" best ")[2].split()[0]) == pytest.approx(-shift_s, abs=1.0)
    assert notes(0.0, seed=seed, fixes_s=220) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shift_s", [18.0, -7.0])
def test_so_is_one_where_positions_pause(notes, shift_s, seed):
    """Speeds within the gap were those of its ends, and agreed at no shift."""
    (note,) = notes(shift_s, seed=seed, jammed_s=(250, 600))
    assert float(note.partition(" best ")[2].split()[0]) == pytest.approx(-shift_s, abs=1.0)
    assert notes(0.0, seed=seed, jammed_s=(250, 600)) == []


def test_the_best_shift_leaves_three_minutes_in_common():
    time_s = np.arange(600.0)
    speeds = time_s, 10 + 5 * np.sin(time_s / 20) + 3 * np.sin(time_s / 7)
    # A shift of 500 s leaves 100 s in common, and at one of 40 s speeds do not agree.
    assert best_shift(np.array([-500.0, 0.0, 40.0]), speeds, speeds) == 0.0
    assert best_shift(np.array([-500.0, 40.0]), speeds, speeds) is None
    assert best_shift(np.array([0.0]), speeds, None) is None


def test_recordings_of_three_minutes_have_one_shift_alone():
    """Any other one leaves less in common than it takes."""
    time_s = np.arange(181.0)
    speeds = time_s, 10 + 5 * np.sin(time_s / 20) + 3 * np.sin(time_s / 7)
    assert shift_note("fixes.csv", speeds, speeds) == ""


@pytest.mark.parametrize("seed", range(5))
def test_a_common_clock_and_a_steady_speed_say_nothing(notes, seed):
    assert notes(0.0, seed=seed) == []
    assert notes(18.0, steady=True, seed=seed) == []


def test_a_receiver_whose_week_number_began_anew(notes):
    assert notes(-WEEKS_S) == []
    # Nothing is mended that does not overlap.
    told = rf'week number began anew: offsets_s={{"FILE": {WEEKS_S}}}'
    with pytest.raises(InputError, match=told):
        notes(-WEEKS_S - 2 * COUNT)


@pytest.mark.parametrize("of", ["utc", "local"])
@pytest.mark.parametrize("name", ["fixes.csv", "odometry.csv"])
def test_an_offset_moves_that_recording_alone(tmp_path, of, name):
    """Also where its clock is the one that others are compared with."""
    seconds = np.arange(60.0)
    times = TIME_S[:60]
    if of == "local":
        times = [f"{time:%Y-%m-%d %H:%M:%S}" for time in pd.to_datetime(times, unit="s")]
    tables = {
        "fixes.csv": {"lat": 60 + seconds / 1e4, "lon": 25.0},
        "odometry.csv": {"wheel_speed_mps": 11.0, "yaw_rate_radps": 0.0},
    }
    for file, rows in tables.items():
        pd.DataFrame({"time": times, **rows}).to_csv(tmp_path / file, index=False)
    paths = [tmp_path / file for file in tables]
    log = mf.read_log(paths, offsets_s={name: 5.0})
    late_s = log.gnss["time_s"].iloc[0] - log.motion["time_s"].iloc[0]
    assert late_s == (5.0 if name == "fixes.csv" else -5.0)
    assert [note for note in log.notes if "speeds" in note] == []


def test_recordings_of_one_moment_each_are_refused(tmp_path):
    """Of speeds that last no time a traceback told so."""
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path, time_s in zip(paths, (5.0, 7.0), strict=True):
        rows = pd.DataFrame({"time": time_s, "wheel_speed_mps": np.arange(12.0)})
        rows.to_csv(path, index=False)
    with pytest.raises(InputError, match="positions or speeds in common"):
        mf.read_log(paths)
