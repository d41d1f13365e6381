"""Steps that a phone delivers late, many at a time, are those of the time since the last ones."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.tracks.open_options import WalkOptions

START_S, EVERY_S, STEP_M, CADENCE_HZ = 1_778_666_400.0, 10.0, 0.7, 1.8
SECONDS = np.arange(0.0, 601.0)


def azimuth_deg(time_s):
    """Legs of 75 s with quarter turns, which begin within a batch."""
    return 90.0 * ((time_s // 75) % 2)


def delivered(time_s):
    return np.ceil(time_s / EVERY_S) * EVERY_S


def read_each(every_s):
    """Return what a phone shows each second that reads its counter every so many seconds."""
    return np.searchsorted(STEPS_S, np.floor(SECONDS / every_s) * every_s, side="right")


STEPS_S = np.arange(1.0, SECONDS.size * CADENCE_HZ - 2) / CADENCE_HZ
"""Times at which a foot is set down."""
COUNTED = read_each(EVERY_S)
COMPASS = {"time": START_S + SECONDS, "compass_deg": azimuth_deg(SECONDS)}


def of_a_counter():
    return COMPASS | {"steps": COUNTED}


def of_own_counts():
    return COMPASS | {"steps": np.diff(COUNTED, prepend=0)}


def beside_a_compass(steps):
    rows = pd.concat([pd.DataFrame(steps), pd.DataFrame(COMPASS)])
    return rows.sort_values("time", kind="stable")


def of_rows_at_one_time():
    number = np.arange(1, STEPS_S.size + 1)
    return beside_a_compass({"time": START_S + delivered(STEPS_S), "steps": number})


def of_single_steps():
    return beside_a_compass({"time": START_S + delivered(STEPS_S), "steps": 1})


def of_a_row_for_each_batch():
    batch_s = SECONDS[:: int(EVERY_S)]
    return beside_a_compass({"time": START_S + batch_s, "steps": COUNTED[:: int(EVERY_S)]})


def of_lengths():
    # Each row has the direction of its own moment, but the time of its batch.
    own = {"step_m": STEP_M, "compass_deg": azimuth_deg(STEPS_S)}
    return {"time": START_S + delivered(STEPS_S)} | own


def read(tmp_path, columns):
    path = tmp_path / "phone.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return mf.read_log(path, walk=WalkOptions(step_m=STEP_M, declination_deg=0.0))


@pytest.mark.parametrize(
    "made",
    [
        of_a_counter,
        of_own_counts,
        of_rows_at_one_time,
        of_single_steps,
        of_a_row_for_each_batch,
        of_lengths,
    ],
)
def test_they_are_spread_over_the_way(made, tmp_path):
    """A batch was one step of 13 m in one direction, or dropped as a row given twice."""
    log = read(tmp_path, made())
    motion = log.motion
    assert motion["step_m"].max() < 1.5
    assert motion["step_m"].sum() == pytest.approx(STEP_M * STEPS_S.size, abs=13)
    assert motion["heading_rad"].notna().all()
    moved_m = motion["step_m"].to_numpy() * np.exp(1j * motion["heading_rad"].to_numpy())
    true_m = STEP_M * np.exp(1j * np.pi / 2 - 1j * np.radians(azimuth_deg(STEPS_S)))
    at_s = SECONDS[10:-10]
    own = np.interp(at_s, motion["time_s"], np.cumsum(moved_m))
    true = np.interp(at_s, STEPS_S, np.cumsum(true_m))
    assert np.abs(own - true).max() < 4


@pytest.mark.parametrize("made", [of_a_counter, of_rows_at_one_time, of_single_steps, of_lengths])
def test_a_note_says_so(made, tmp_path):
    (note,) = [note for note in read(tmp_path, made()).notes if "spread over" in note]
    assert "batches" in note
    assert not any("duplicate" in note for note in read(tmp_path, made()).notes)


def test_after_a_rest_steps_are_those_of_the_last_seconds(tmp_path):
    counted = np.where(SECONDS < 300, 0, np.where(SECONDS < 310, 6, COUNTED - COUNTED[309] + 6))
    motion = read(tmp_path, COMPASS | {"steps": counted}).motion
    before = motion.set_index("time_s")["step_m"]
    assert before[before.index <= 293].sum() == 0
    assert before[(before.index > 294) & (before.index <= 300)].min() == pytest.approx(STEP_M)


@pytest.mark.parametrize("every_s", [20.0, 30.0, 60.0])
@pytest.mark.parametrize("own", [False, True])
def test_long_batches_have_the_steps_of_the_time_since_the_last_one(every_s, own, tmp_path):
    """More than 50 steps at once were taken for a counter that jumps: no motion."""
    counted = read_each(every_s)
    log = read(tmp_path, COMPASS | {"steps": np.diff(counted, prepend=0) if own else counted})
    assert log.motion["step_m"].notna().all()
    assert log.motion["step_m"].sum() == pytest.approx(STEP_M * counted[-1])
    assert log.motion["step_m"][1:].max() < 1.5


@pytest.mark.parametrize("rest_s", [1, 20])
def test_more_steps_than_anybody_makes_since_the_last_one_are_a_jump(rest_s, tmp_path):
    counted = np.searchsorted(STEPS_S, SECONDS, side="right")
    counted[300 : 300 + rest_s] = counted[300]
    counted[300 + rest_s :] += 5 * (rest_s + 10)
    motion = read(tmp_path, COMPASS | {"steps": counted}).motion
    assert motion["time_s"][motion["step_m"].isna()].tolist() == [300 + rest_s]


def test_a_jump_after_an_hour_at_rest_is_no_batch_of_all_of_it(tmp_path):
    """8000 steps were spread over the hour in which the phone lay on a table."""
    seconds = np.arange(3700.0)
    walked = 2 * np.maximum(seconds - 3600, 0)
    rows = {"time": START_S + seconds, "compass_deg": 0.0}
    motion = read(tmp_path, rows | {"steps": walked + 8000 * (seconds >= 3600)}).motion
    assert motion["time_s"][motion["step_m"].isna()].tolist() == [3600]
    assert motion["step_m"].sum() == pytest.approx(STEP_M * walked[-1])


def test_rows_of_cells_repeat_a_counter_and_are_no_batches(tmp_path):
    """A table with a row for each of four cells every 10 s has the same count in each."""
    time_s = np.repeat(SECONDS[::10], 4)
    rows = {"time": START_S + time_s, "steps": np.repeat(COUNTED[::10], 4)}
    rows |= {"compass_deg": 0.0, "mcc": 244, "mnc": 91, "lac": 1}
    rows |= {"ci": np.tile([1, 2, 3, 4], SECONDS[::10].size), "level_dbm": -80}
    log = read(tmp_path, rows)
    assert len(log.motion) == SECONDS[::10].size
    assert not any("batches" in note for note in log.notes)


def test_steps_in_time_stay_as_they_are(tmp_path):
    counted = np.searchsorted(STEPS_S, SECONDS, side="right")
    log = read(tmp_path, COMPASS | {"steps": counted})
    np.testing.assert_allclose(log.motion["step_m"][1:], STEP_M * np.diff(counted))
    assert not any("batch" in note for note in log.notes)


def test_rows_given_twice_are_dropped_still(tmp_path):
    counted = np.searchsorted(STEPS_S, SECONDS, side="right")
    once = pd.DataFrame({"time": COMPASS["time"], "step_m": STEP_M * np.diff(counted, prepend=0)})
    once["heading_rad"] = 0.1
    log = read(tmp_path, pd.concat([once, once]))
    assert log.motion["step_m"].sum() == pytest.approx(once["step_m"].sum())


@pytest.mark.parametrize("kind", ["counts", "single", "lengths"])
def test_equal_rows_of_one_whole_second_are_steps_of_their_own(kind, tmp_path):
    """Every second of two was dropped as a row given twice."""
    number = np.diff(np.searchsorted(STEPS_S, np.arange(0, 600, 0.5), side="right"), prepend=0)
    second_s = np.arange(number.size) // 2
    if kind != "counts":
        second_s = np.floor(STEPS_S)
    rows = {"time": START_S + second_s}
    if kind == "lengths":
        columns = rows | {"step_m": STEP_M, "compass_deg": 0.0}
    else:
        columns = beside_a_compass(rows | {"steps": number if kind == "counts" else 1})
    log = read(tmp_path, columns)
    assert log.motion["step_m"].sum() == pytest.approx(STEP_M * STEPS_S.size, abs=2)
    (note,) = [note for note in log.notes if "same second" in note]
    assert "spread over it" in note
    # A listener that is registered twice from some time on.
    twice = pd.DataFrame(columns).drop_duplicates()
    twice = pd.concat([twice[:200], *[twice[200:]] * 2])
    assert "duplicate rows dropped" in " ".join(read(tmp_path, twice).notes)
    once = read(tmp_path, pd.DataFrame(columns).drop_duplicates()).motion
    if kind == "lengths":
        assert read(tmp_path, twice).motion["step_m"].sum() == once["step_m"].sum()


def test_different_counts_of_one_time_add_up(tmp_path):
    """Of two in each second the second one counted: no step at all."""
    rows = {"time": START_S + np.repeat(SECONDS, 2), "steps": np.tile([1, 0], SECONDS.size)}
    motion = read(tmp_path, beside_a_compass(rows)).motion
    assert motion["step_m"].sum() == pytest.approx(STEP_M * SECONDS.size)
