"""Clocks that are set back while a log is recorded."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.checks.clock_steps import clock_steps, with_clocks_gone_on
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log

CRS = "EPSG:32635"
BACK_S = 30.0


def motion(time_s):
    return pd.DataFrame({"time_s": time_s, "step_m": 1.4, "heading_rad": 0.5})


def radio(time_s):
    """Return two rows for each report."""
    level_dbm = -60.0 - np.arange(2.0 * len(time_s)) % 40
    role = ["serving", "neighbour"] * len(time_s)
    columns = {"role": role, "cell": ["A", "B"] * len(time_s), "level_dbm": level_dbm}
    return pd.DataFrame({"time_s": np.repeat(time_s, 2), **columns})


def set_back(time_s, first_s, last_s=np.inf, by_s=BACK_S):
    return np.where((time_s >= first_s) & (time_s < last_s), time_s - by_s, time_s)


def notes_of(log):
    return [note for note in log.notes if "as when a clock is set back" in note]


def gone_on(time_s):
    """Return the times of a table alone as they go on, and the note."""
    tables, notes = with_clocks_gone_on({"motion": pd.DataFrame({"time_s": time_s})}, {})
    return tables["motion"]["time_s"].to_numpy(), "".join(notes)


def true_s(seconds=240.0, every_s=1.0):
    return np.arange(0.0, seconds, every_s)


@pytest.mark.parametrize("back_s", [5.5, 30.5])
def test_rows_after_a_step_go_on_and_it_is_noted_with_when_and_by_how_much(back_s):
    time_s = true_s(120.0)
    log = make_log(CRS, motion=motion(set_back(time_s, 60.0, by_s=back_s)))
    np.testing.assert_allclose(log.motion["time_s"], time_s)
    (said,) = notes_of(log)
    # The first row after the step comes a second after the last one before it.
    assert f"motion: time goes back by {back_s - 1:g} s after 59 s" in said
    assert said.endswith(f"later rows are taken {back_s:g} s later")


def test_a_clock_that_is_set_again_was_wrong_in_between():
    time_s = true_s()
    stepped = set_back(time_s, 90.0, 170.0)
    found_s, said = gone_on(stepped)
    np.testing.assert_allclose(found_s, time_s)
    assert said.endswith("rows until it is set again are taken 30 s later")


def test_a_log_of_csv_files_goes_on_too(tmp_path):
    """Their values are texts until they are checked."""
    motion(set_back(true_s(), 100.0)).to_csv(tmp_path / "motion.csv", index=False)
    radio(set_back(true_s(every_s=4.0), 100.0)).to_csv(tmp_path / "radio.csv", index=False)
    (tmp_path / "log.json").write_text(f'{{"crs": "{CRS}"}}')
    log = read_log(tmp_path)
    np.testing.assert_allclose(log.motion["time_s"], true_s())
    np.testing.assert_allclose(log.radio["time_s"], np.repeat(true_s(every_s=4.0), 2))
    assert len(notes_of(log)) == 2


@pytest.mark.parametrize("table", ["motion", "radio"])
@pytest.mark.parametrize(("first_s", "last_s"), [(100.0, np.inf), (100.0, 180.0)])
def test_the_rows_of_a_walk_keep_their_order_beside_another_table(table, first_s, last_s):
    clocks = {"motion": true_s(), "radio": true_s(every_s=4.0)}
    given = {**clocks, table: set_back(clocks[table], first_s, last_s)}
    log = make_log(CRS, motion=motion(given["motion"]), radio=radio(given["radio"]))
    np.testing.assert_allclose(log.motion["time_s"], clocks["motion"])
    np.testing.assert_allclose(log.radio["time_s"], np.repeat(clocks["radio"], 2))
    sound = make_log(CRS, motion=motion(clocks["motion"]), radio=radio(clocks["radio"]))
    pd.testing.assert_frame_equal(log.radio, sound.radio)
    assert len(notes_of(log)) == 1


def test_where_the_clock_was_wrong_before_earlier_rows_are_taken_earlier():
    """Radio tells: with the rows before 30 s too late, both tables begin and end together."""
    time_s = true_s()
    late = np.where(time_s < 100.0, time_s + BACK_S, time_s)
    log = make_log(CRS, motion=motion(late), radio=radio(true_s(every_s=4.0)))
    np.testing.assert_allclose(log.motion["time_s"], time_s)
    assert notes_of(log)[0].endswith("earlier rows are taken 30 s earlier")


def test_a_pause_as_long_as_the_step_is_none_of_the_clock():
    """Nothing is counted for 30 s; radio that goes on to the end tells that no clock was set."""
    time_s = true_s(300.0)
    walking = time_s[(time_s < 200.0) | (time_s >= 230.0)]
    stepped = set_back(walking, 100.0)
    log = make_log(CRS, motion=motion(stepped), radio=radio(true_s(300.0, 4.0)))
    np.testing.assert_allclose(log.motion["time_s"], walking)
    # By itself the table does not tell it from a clock that is set again.
    np.testing.assert_allclose(gone_on(stepped)[0], np.where(walking >= 230, walking - 30, walking))


def test_one_clock_of_all_tables_goes_on_in_all_of_them():
    log = make_log(
        CRS,
        motion=motion(set_back(true_s(), 100.0)),
        radio=radio(set_back(true_s(every_s=4.0), 100.0)),
    )
    np.testing.assert_allclose(log.motion["time_s"], true_s())
    np.testing.assert_allclose(log.radio["time_s"], np.repeat(true_s(every_s=4.0), 2))
    assert len(notes_of(log)) == 2


def test_a_missing_role_beside_a_step_is_told_as_any_other():
    rows = radio(set_back(true_s(every_s=4.0), 100.0))
    rows["role"] = rows["role"].astype("string")
    rows.loc[5, "role"] = pd.NA
    with pytest.raises(InputError, match="role"):
        make_log(CRS, motion=motion(true_s()), radio=rows)


def fixes(time_s):
    return pd.DataFrame({"time_s": time_s, "east_m": 1.4 * true_s(every_s=60.0), "north_m": 0.0})


@pytest.mark.parametrize("every_s", [25.0, 60.0])
def test_sparse_tables_of_the_same_clock_follow(every_s):
    """They have too few rows to show the step, but end with the stepped clock."""
    rows = fixes if every_s == 60.0 else radio
    table = "gnss" if every_s == 60.0 else "radio"
    sparse_s = true_s(every_s=every_s)
    log = make_log(
        CRS,
        motion=motion(set_back(true_s(), 100.0)),
        **{table: rows(set_back(sparse_s, 100.0))},
    )
    np.testing.assert_allclose(log.motion["time_s"], true_s())
    # Rows within the time that comes twice may be of either side.
    found_s = np.unique(getattr(log, table)["time_s"])
    sure = (sparse_s < 70.0) | (sparse_s > 130.0)
    np.testing.assert_allclose(np.intersect1d(found_s, sparse_s[sure]), sparse_s[sure])
    assert any("rows are taken later with those of motion" in note for note in log.notes)


def test_a_dense_table_with_a_clock_of_its_own_does_not_follow():
    """Reports each 5 s would show the step; they only end earlier."""
    own_s = true_s(seconds=210.0, every_s=5.0)
    log = make_log(CRS, motion=motion(set_back(true_s(), 100.0)), radio=radio(own_s))
    np.testing.assert_allclose(np.unique(log.radio["time_s"]), own_s)


def test_one_clock_of_motion_radio_fixes_and_satellites():
    second = set_back(true_s(), 100.0)
    satellites = pd.DataFrame({
        "time_s": np.repeat(second, 2), "satellite": ["G01", "G02"] * second.size,
        "pseudorange_m": 2.2e7,
    })  # fmt: skip
    log = make_log(
        CRS,
        motion=motion(second),
        radio=radio(set_back(true_s(every_s=4.0), 100.0)),
        gnss=fixes(set_back(true_s(every_s=60.0), 100.0)),
        pseudoranges=satellites,
    )
    np.testing.assert_allclose(log.motion["time_s"], true_s())
    np.testing.assert_allclose(log.radio["time_s"], np.repeat(true_s(every_s=4.0), 2))
    np.testing.assert_allclose(log.pseudoranges["time_s"], np.repeat(true_s(), 2))
    np.testing.assert_allclose(log.gnss["time_s"], [0.0, 60.0, 120.0, 180.0], atol=30.0)
    assert log.gnss["time_s"].iloc[-1] == pytest.approx(181.0, abs=2.0)


def test_fixes_of_one_provider_after_those_of_another_are_no_clock():
    """Also where there is no other table."""
    east_m = np.tile(1.4 * true_s(), 2)
    time_s = np.concatenate([true_s(), true_s() + 1.0])
    both = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": 0.0})
    for more in ({}, {"motion": motion(true_s())}):
        log = make_log(CRS, gnss=both, **more)
        assert notes_of(log) == []
        np.testing.assert_allclose(np.unique(log.gnss["time_s"]), np.unique(time_s))


@pytest.mark.parametrize("table", ["radio", "pseudoranges"])
def test_series_that_are_written_one_after_the_other_are_no_clock(table):
    """All rows of the serving cell and then those of a neighbour; one satellite after another."""
    time_s = np.concatenate([true_s(every_s=4.0)] * 2)
    if table == "radio":
        role = np.repeat(["serving", "neighbour"], 60)
        rows = pd.DataFrame({"time_s": time_s, "role": role, "cell": role, "level_dbm": -70.0})
    else:
        satellite = np.repeat(["G01", "G02"], 60)
        rows = pd.DataFrame({"time_s": time_s, "satellite": satellite, "pseudorange_m": 2.2e7})
    log = make_log(CRS, motion=motion(true_s()), **{table: rows})
    assert notes_of(log) == []
    np.testing.assert_allclose(getattr(log, table)["time_s"], np.sort(time_s))


def test_the_ground_truth_decides_nothing():
    """What a log is read as depends on what the phone wrote alone."""
    stepped, truth_s = set_back(true_s(), 100.0), true_s(1000.0)
    truth = pd.DataFrame({"time_s": truth_s, "east_m": 1.4 * truth_s, "north_m": 0.0})
    with_truth = make_log(CRS, motion=motion(stepped), truth=truth)
    without = make_log(CRS, motion=motion(stepped))
    pd.testing.assert_frame_equal(with_truth.motion, without.motion)


def test_two_rows_out_of_order_are_no_clock():
    time_s = np.arange(120.0)
    time_s[[60, 61]] = time_s[[61, 60]]
    log = make_log(CRS, motion=motion(time_s))
    assert notes_of(log) == []
    assert any("out of order in 1 place, sorted by time" in note for note in log.notes)
    np.testing.assert_allclose(log.motion["time_s"], np.arange(120.0))


@pytest.mark.parametrize(("rows", "of_report"), [(100, 1), (12, 7)])
def test_a_block_that_is_delivered_late_is_sorted(rows, of_report):
    """Its times fill a gap: no time comes twice. A report of seven rows is one time."""
    whole = np.repeat(np.arange(4.0 * rows), of_report)
    quarter = whole.size // 4
    late = np.concatenate([whole[: 2 * quarter][:quarter], whole[2 * quarter : 3 * quarter],
                           whole[quarter : 2 * quarter], whole[3 * quarter :]])  # fmt: skip
    assert clock_steps(late) == ()
    assert gone_on(late)[1] == ""


def test_every_step_of_a_few_is_named_and_many_are_none():
    def stepped(steps):
        time_s = np.arange(50.0 * (steps + 1))
        for step in range(steps):
            time_s[50 * (step + 1) :] -= 10.5
        return gone_on(time_s)

    found_s, said = stepped(2)
    assert said.count("by 9.5 s after") == 2
    np.testing.assert_allclose(found_s, np.arange(150.0))
    for steps in (0, 4):
        assert stepped(steps)[1] == ""
