"""Motion of counted steps and a compass: lengths, headings, gaps, and a plain CSV as a log."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import ConfigError
from mapfilter.tracks.joining.combine import combine
from mapfilter.tracks.open_options import CombineOptions
from mapfilter.tracks.pdr.counted import reckon_counted
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.readers.formats import read_recording

EAST = WalkOptions(declination_deg=0.0, step_m=0.8)


def sensors(count, azimuth_deg, time_s=None, compass_s=None):
    time_s = np.arange(len(count), dtype=float) if time_s is None else np.asarray(time_s, float)
    compass_s = time_s if compass_s is None else np.asarray(compass_s, float)
    azimuth = np.broadcast_to(np.asarray(azimuth_deg, float), compass_s.shape)
    return {
        "steps": pd.DataFrame({"time_s": time_s, "count": np.asarray(count, float)}),
        "compass": pd.DataFrame({"time_s": compass_s, "magnetic_deg": azimuth}),
    }


def lengths(count, **kinds):
    motion, _, _ = reckon_counted(sensors(count, 90.0, **kinds), EAST)
    return motion["step_m"].to_numpy() / EAST.step_m


def test_a_counter_gives_the_steps_since_the_row_before():
    np.testing.assert_allclose(lengths([100, 102, 102, 105]), [0, 2, 0, 3])


def test_rows_that_count_their_own_steps_are_taken_as_they_are():
    own = [2, 1, 2, 0, 2, 1, 2, 1, 2, 2]
    np.testing.assert_allclose(lengths(own), own)


def test_steps_are_unknown_where_a_counter_began_anew():
    count = [*range(5000, 5300, 2), *range(0, 300, 2)]
    steps = lengths(count)
    assert np.isnan(steps[150])
    assert np.isnan(steps).sum() == 1
    assert np.nansum(steps) == pytest.approx(149 * 2 + 149 * 2)


@given(st.lists(st.integers(0, 5), min_size=2, max_size=40), st.integers(0, 10**6))
def test_a_counters_start_does_not_matter(steps, start):
    count = start + np.cumsum([0, *steps])
    if not sum(steps):
        return
    np.testing.assert_allclose(lengths(count), lengths(count - start))
    assert lengths(count).sum() == pytest.approx(sum(steps))
    if max(steps) < 4:
        np.testing.assert_allclose(lengths(count), [0, *steps])


@pytest.mark.parametrize(
    ("azimuth", "declination", "convergence", "heading"),
    [
        (90, 0, 0, 0),
        (0, 0, 0, 90),
        (0, 10, 0, 80),
        (0, 0, 3, 93),
        (350, 10, 0, 90),
        (180, 0, 0, -90),
    ],
)
def test_headings_are_counter_clockwise_from_grid_east(azimuth, declination, convergence, heading):
    options = WalkOptions(declination_deg=declination)
    motion, imu, notes = reckon_counted(
        sensors([0, 2, 4], azimuth), options, np.radians(convergence)
    )
    np.testing.assert_allclose(np.degrees(motion["heading_rad"]), heading, atol=1e-9)
    assert imu.bias_sd_deg == pytest.approx(15.0)
    assert not any("declination" in note for note in notes)


def test_an_unknown_declination_is_told_and_widens_the_lasting_error():
    _, imu, notes = reckon_counted(sensors([0, 2, 4], 90.0), WalkOptions())
    assert imu.bias_sd_deg == pytest.approx(17.0)
    assert any("no magnetic declination" in note for note in notes)


def test_headings_of_an_interval_are_their_mean_across_north():
    kinds = sensors([0, 2, 4], [350, 350, 10, 350, 10], [0, 1, 2], [0, 0.5, 1, 1.5, 2])
    motion, _, _ = reckon_counted(kinds, EAST)
    np.testing.assert_allclose(np.degrees(motion["heading_rad"]), [100, 90, 90], atol=1e-9)


def test_a_heading_is_unknown_two_seconds_from_any():
    kinds = sensors([0, 2, 4, 6, 8], 90.0, [0, 1, 2, 3, 4], [0.0])
    motion, _, _ = reckon_counted(kinds, EAST)
    assert np.isfinite(motion["heading_rad"]).tolist() == [True, True, True, False, False]


def test_the_white_error_of_headings_is_that_of_their_scatter():
    rng = np.random.default_rng(3)
    azimuth = 90 + rng.normal(0, 8, 2000)
    _, imu, _ = reckon_counted(sensors(np.arange(0, 4000, 2), azimuth), EAST)
    assert imu.sigma_orient_deg == pytest.approx(8.0, rel=0.08)
    assert imu.sigma_trans_m == pytest.approx(np.hypot(0.16, 0.4))


def test_a_counter_that_stands_still_is_told():
    motion, imu, notes = reckon_counted(sensors([7, 7, 7], 90.0), EAST)
    assert motion is None
    assert imu is None
    assert "stands still in 3 rows" in notes[0]


@pytest.mark.parametrize("apart_s", [31.0, 40.0, 60.0, 300.0])
@pytest.mark.parametrize("rest", [0, 5])
def test_rows_too_far_apart_for_steps_are_told_with_how_far(apart_s, rest):
    count = np.cumsum([2, *[int(1.9 * apart_s)] * 15])
    made = sensors(count, 90.0, time_s=apart_s * np.arange(16))
    motion, _, notes = reckon_counted(made, EAST)
    assert motion is None
    assert notes[0] == (
        f"steps are counted in rows {apart_s:g} s apart, and used in rows up to 30 s apart: "
        "no motion"
    )
    # The phone lies there afterwards.
    count = np.append(count, count[-1] + np.zeros(rest))
    made = sensors(count, 90.0, time_s=apart_s * np.arange(16 + rest))
    assert reckon_counted(made, EAST)[2] == notes


def test_steps_of_rows_thirty_seconds_apart_are_used():
    count = np.cumsum([2, *[57] * 15])
    np.testing.assert_allclose(lengths(count, time_s=30.0 * np.arange(16)), [0, *[57] * 15])


def test_a_counter_that_jumps_in_each_row_is_none_that_stands_still():
    motion, _, notes = reckon_counted(sensors(1000 * np.arange(9), 90.0), EAST)
    assert motion is None
    assert notes[0].startswith(
        "the step counter begins anew, or grows by more than 5 steps/s, in 8 of 9 rows: no motion"
    )


@pytest.mark.parametrize(("lacking", "told"), [("steps", ()), ("compass", "no compass")])
def test_without_a_counter_or_a_compass_there_is_no_motion(lacking, told):
    kinds = sensors([0, 2], 90.0)
    del kinds[lacking]
    motion, imu, notes = reckon_counted(kinds)
    assert motion is None
    assert imu is None
    assert notes == told or (len(notes) == 1 and told in notes[0])


def test_a_table_of_a_phone_with_steps_and_compass_has_motion(tmp_path):
    rows = [f"2026-05-01T10:00:{k:02d}Z,{3 * k},90,48.0,11.0" for k in range(30)]
    path = tmp_path / "phone.csv"
    path.write_text("\n".join(["time,steps,compass_deg,latitude,longitude", *rows]) + "\n")
    options = CombineOptions(truth=(path,), measured=(path,), walk=EAST)
    log = combine([read_recording(path)], options).log
    assert log.motion["step_m"].sum() == pytest.approx(29 * 3 * 0.8)
    assert np.abs(np.degrees(log.motion["heading_rad"])).max() < 3.0
    assert log.imu is not None
    assert log.notes


def test_lengths_of_steps_move_beside_a_compass_as_before(tmp_path):
    path = tmp_path / "phone.csv"
    rows = [f"{k},0.7,{3 * k},90,48.0,11.0" for k in range(5)]
    path.write_text("\n".join(["time_s,step_m,steps,compass_deg,latitude,longitude", *rows]) + "\n")
    recording = read_recording(path)
    assert "compass" not in recording.tables
    assert "motion" in recording.tables


@pytest.mark.parametrize("step_m", [0.0, -0.7, 3.0, 70.0])
def test_a_length_that_no_step_has_is_refused(step_m):
    with pytest.raises(ConfigError, match="step_m"):
        WalkOptions(step_m=step_m)


RATE = st.lists(st.integers(1, 3), min_size=60, max_size=60)


@given(RATE, st.sampled_from([(), (5,), (25,), (20, 45)]))
def test_a_counter_that_begins_anew_several_times_is_a_counter(steps, restarts):
    count, now = [], 5000
    for number, one in enumerate(steps):
        now = 0 if number in restarts else now + one
        count.append(now)
    found = lengths(count)
    known = np.array([n not in restarts for n in range(60)])
    known[0] = False
    assert np.isnan(found[list(restarts)]).all()
    np.testing.assert_allclose(found[known], np.array(steps)[known])


def test_a_missing_count_is_unknown_and_not_the_whole_counter():
    count = np.arange(5000, 5400, 1.0)
    count[200] = 0
    found = lengths(count)
    assert np.isnan(found[[200, 201]]).all()
    assert np.nansum(found) == pytest.approx(397)


def test_three_files_that_each_begin_at_nothing():
    found = lengths(np.concatenate([np.arange(0, 40, 2)] * 3))
    assert np.nansum(found) <= 114
    assert np.nansum(found) >= 112


def test_rows_out_of_order_move_nobody():
    found = lengths([100, 102, 101, 104, 103, 106, 108])
    assert np.nansum(found) == pytest.approx(8)


def test_own_counts_with_few_falls_are_summed():
    own = [0, 1, 2, 2, 2, 2, 2, 2, 1, 2, 2, 2, 2, 2]
    _, _, notes = reckon_counted(sensors(own, 90.0), EAST)
    assert np.sum(lengths(own)) == sum(own)
    assert "counted in each row" in notes[0]


@pytest.mark.parametrize("every", [2, 5, 20])
def test_steps_that_come_in_batches_are_spread(every):
    own = np.where(np.arange(201) % every == 0, 2 * every, 0)
    np.testing.assert_allclose(lengths(own), [2 * every, *np.full(200, 2.0)])


def test_motion_after_a_pause_is_unknown():
    time_s = np.concatenate([np.arange(20.0), 9000.0 + np.arange(20.0)])
    count = np.concatenate([np.arange(20.0), 8000.0 + np.arange(20.0)])
    motion, imu, notes = reckon_counted(sensors(count, 90.0, time_s), EAST)
    assert np.isnan(motion["step_m"][20])
    assert motion["step_m"].sum() == pytest.approx(38 * 0.8)
    assert imu.sigma_trans_m < 0.5
    assert any("unknown in 1 row:" in note for note in notes)


def test_a_step_after_standing_goes_where_the_compass_last_pointed():
    # Ten minutes facing west, then a step north.
    compass_s = np.arange(700.0)
    azimuth = np.where(compass_s < 596, 270.0, 0.0)
    kinds = sensors([7, 9, 9 + 1], azimuth, [0.0, 1.0, 606.0], compass_s)
    motion, _, _ = reckon_counted(kinds, EAST)
    assert np.degrees(motion["heading_rad"].iloc[2]) == pytest.approx(90.0)


def test_round_a_corner_a_row_is_the_chord():
    # Too few azimuths for rows of a second.
    compass_s = np.arange(0.0, 41.0, 2.0)
    azimuth = np.where(compass_s <= 20, 0.0, 90.0)
    kinds = sensors([0, 40, 80], azimuth, [0.0, 10.0, 30.0], compass_s)
    motion, _, _ = reckon_counted(kinds, EAST)
    step_m, heading = motion["step_m"].iloc[2], np.degrees(motion["heading_rad"].iloc[2])
    assert step_m == pytest.approx(40 * 0.8 / np.sqrt(2), rel=0.01)
    assert heading == pytest.approx(45.0, abs=0.1)


def test_a_compass_of_another_time_makes_no_motion():
    kinds = sensors([0, 2, 4], 90.0, [0, 1, 2], [500.0, 501.0])
    motion, _, notes = reckon_counted(kinds, EAST)
    assert motion is None
    assert "no time in common" in notes[0]


def test_a_heading_of_a_vehicle_is_no_compass(tmp_path):
    path = tmp_path / "vehicle.csv"
    path.write_text("time_s,heading_deg,latitude,longitude\n0,720,48,11\n1,721,48,11\n")
    recording = read_recording(path)
    assert "compass" not in recording.tables
    assert not any("magnetic" in note for note in recording.notes)
