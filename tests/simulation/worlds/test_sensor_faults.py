"""Each fault of the sensors changes what it says, within its time, and nothing else."""

import inspect
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import ConfigError
from mapfilter.simulation.worlds.sensor_faults import (
    NO_FAULT,
    SENSOR_FAULTS,
    WHOLE_LOG,
    faulty_log,
)
from mapfilter.simulation.worlds.windows import Window, drawn_window
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
LASTS_S = 400
WINDOW = Window(150.0, 250.0)
OF_MOTION = (
    "motion-ends",
    "steps-missing",
    "steps-zero",
    "headings-frozen",
    "headings-reversed",
    "headings-mirrored",
    "steps-in-feet",
)
OF_RADIO = (
    "radio-ends",
    "radio-frozen",
    "levels-backwards",
    "neighbour-stuck",
    "cell-stale",
    "report-far-ahead",
)


def sound():
    """A walk on an arc of 1.4 m/s: each report has levels that no other one has."""
    time_s = np.arange(LASTS_S + 1.0)
    heading = 0.4 + 0.004 * time_s[1:]
    motion = {
        "time_s": time_s[1:],
        "step_m": 1.4 + 0.01 * np.sin(time_s[1:]),
        "heading_rad": (heading + np.pi) % (2 * np.pi) - np.pi,
        "turn_rad": np.diff(heading, prepend=np.nan),
    }
    rows = []
    for at_s in time_s:
        # The cell of carrier 103 serves in the last hundred seconds, in place of that of 100.
        order = (103, 101, 102, 100) if at_s >= 300.0 else (100, 101, 102, 103)
        for rank, arfcn in enumerate(order):
            rows.append(
                {
                    "time_s": at_s,
                    "role": "neighbour" if rank else "serving",
                    "cell": None if rank else f"c{arfcn}",
                    "arfcn": arfcn,
                    "bsic": 7,
                    "level_dbm": -60.0 - 5.0 * (arfcn - 100) - 0.01 * at_s,
                }
            )
    # One neighbour is received in the first half of every ten seconds only.
    rows = [row for row in rows if row["arfcn"] != 102 or row["time_s"] % 10 < 5]
    truth = {
        "time_s": time_s,
        "east_m": 380_000.0 + 1.2 * time_s,
        "north_m": 6_670_000.0 + 0.7 * time_s,
    }
    tables = {"motion": motion, "radio": rows, "truth": truth}
    return make_log(CRS, **{name: pd.DataFrame(table) for name, table in tables.items()})


LOG = sound()


def faulty(name, window=WINDOW, seed=1):
    return SENSOR_FAULTS[name](LOG, window, np.random.default_rng(seed))


def outside(table, window=WINDOW):
    return table[~window.holds(table["time_s"])].reset_index(drop=True)


def inside(table, window=WINDOW):
    return table[window.holds(table["time_s"])].reset_index(drop=True)


def same(one, other):
    pd.testing.assert_frame_equal(one, other, check_dtype=False)


def changed_columns(name, table):
    was, now = inside(getattr(LOG, table)), inside(getattr(faulty(name), table))
    assert len(was) == len(now)
    return {column for column in was if not was[column].equals(now[column])}


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_every_fault_says_why_and_leaves_its_argument_alone(name):
    before = sound()
    faulty(name)
    for table in ("motion", "radio", "truth"):
        same(getattr(LOG, table), getattr(before, table))
    text = inspect.getdoc(SENSOR_FAULTS[name])
    assert len(text.split("\n\n")) > 1 or name == NO_FAULT


@pytest.mark.parametrize("name", [*OF_MOTION, *OF_RADIO])
def test_the_other_source_and_the_truth_stay_as_they_were(name):
    found = faulty(name)
    same(found.truth, LOG.truth)
    same(
        found.radio if name in OF_MOTION else found.motion,
        LOG.radio if name in OF_MOTION else LOG.motion,
    )


@pytest.mark.parametrize("name", [*OF_MOTION, *OF_RADIO, "clock-steps-back"])
def test_nothing_changes_before_the_begin_and_after_the_end(name):
    found = faulty(name)
    for table in ("motion", "radio"):
        was, now = getattr(LOG, table), getattr(found, table)
        early, late = Window(-1.0, WINDOW.begin_s), Window(WINDOW.end_s)
        if name != "clock-steps-back":
            same(inside(now, early), inside(was, early))
        after = inside(now, late)
        if name == "report-far-ahead":
            after = after[after["time_s"] < 1e6].reset_index(drop=True)
        if table == "motion" and name.startswith("headings"):
            # The first turn after the fault is back to the sound heading.
            after, was = (rows.drop(columns="turn_rad") for rows in (after, was))
        same(after, inside(was, late))


@pytest.mark.parametrize("name", sorted(set(SENSOR_FAULTS) - WHOLE_LOG))
def test_a_fault_that_begins_after_the_log_changes_nothing(name):
    found = faulty(name, Window(LASTS_S + 1.0))
    same(found.motion, LOG.motion)
    same(found.radio, LOG.radio)


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_faults_of_empty_tables(name):
    empty = replace(LOG, motion=LOG.motion.iloc[:0], radio=LOG.radio.iloc[:0])
    found = SENSOR_FAULTS[name](empty, WINDOW, np.random.default_rng(0))
    assert len(found.motion) == len(found.radio) == 0


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_a_log_with_a_fault_is_read_as_any_other(name):
    for seed in range(4):
        found, window = faulty_log(name, LOG, np.random.default_rng(seed))
        again, _ = faulty_log(name, LOG, np.random.default_rng(seed))
        for table in ("motion", "radio", "truth"):
            rows = getattr(found, table)
            same(rows, getattr(again, table))
            assert rows["time_s"].is_monotonic_increasing
        same(found.truth, LOG.truth)
        assert (window.begin_s == 0.0) or 160.0 <= window.begin_s <= 280.0
        if name in WHOLE_LOG:
            assert window == Window(0.0)
        if name == NO_FAULT:
            same(found.motion, LOG.motion)
            same(found.radio, LOG.radio)


def test_an_unknown_fault_is_refused():
    with pytest.raises(ConfigError, match="motion-ends"):
        faulty_log("broken", LOG, np.random.default_rng(0))


def test_motion_and_radio_end():
    assert len(inside(faulty("motion-ends").motion)) == 0
    assert len(faulty("motion-ends").motion) == LASTS_S - 100
    assert len(inside(faulty("radio-ends").radio)) == 0
    assert len(faulty("radio-ends").radio) == len(outside(LOG.radio))


def test_steps():
    for name in ("steps-missing", "steps-zero", "steps-in-feet"):
        assert changed_columns(name, "motion") == {"step_m"}
    assert inside(faulty("steps-missing").motion)["step_m"].isna().all()
    assert (inside(faulty("steps-zero").motion)["step_m"] == 0.0).all()
    ratio = inside(faulty("steps-in-feet").motion)["step_m"] / inside(LOG.motion)["step_m"]
    np.testing.assert_allclose(ratio, 1 / 0.3048, rtol=1e-3)


def heading(name, window=WINDOW):
    return faulty(name, window).motion["heading_rad"].to_numpy()


def test_a_frozen_heading_is_the_last_one_before():
    rows = LOG.motion["time_s"].between(150.0, 249.0).to_numpy()
    (last,) = LOG.motion["heading_rad"][LOG.motion["time_s"] == 149.0]
    assert (heading("headings-frozen")[rows] == last).all()
    turn = faulty("headings-frozen").motion["turn_rad"].to_numpy()[rows]
    np.testing.assert_allclose(turn, 0.0, atol=1e-12)
    at_once = heading("headings-frozen", Window(0.0))
    assert (at_once == LOG.motion["heading_rad"][0]).all()


@pytest.mark.parametrize(
    ("name", "times"),
    [("headings-reversed", lambda h: h + np.pi), ("headings-mirrored", lambda h: -h)],
)
def test_headings_are_reversed_and_mirrored(name, times):
    rows = LOG.motion["time_s"].between(150.0, 249.0).to_numpy()
    was = LOG.motion["heading_rad"].to_numpy()
    np.testing.assert_allclose(
        np.exp(1j * heading(name)[rows]), np.exp(1j * times(was[rows])), atol=1e-12
    )
    assert changed_columns(name, "motion") <= {"heading_rad", "turn_rad"}


@pytest.mark.parametrize("name", ["headings-frozen", "headings-reversed", "headings-mirrored"])
def test_turns_lead_from_heading_to_heading(name):
    motion = faulty(name).motion
    between = np.diff(motion["heading_rad"])
    turns = motion["turn_rad"].to_numpy()[1:]
    np.testing.assert_allclose(np.exp(1j * turns), np.exp(1j * between), atol=1e-12)


def levels(log, at_s):
    rows = log.radio[log.radio["time_s"] == at_s]
    return dict(zip(rows["arfcn"], rows["level_dbm"], strict=True))


def test_a_frozen_report_is_the_last_one_before():
    found = faulty("radio-frozen")
    for at_s in (150.0, 200.0, 249.0):
        assert levels(found, at_s) == levels(LOG, 149.0)
    assert levels(found, 250.0) == levels(LOG, 250.0)
    assert (found.radio["time_s"].unique() == LOG.radio["time_s"].unique()).all()
    frozen = faulty("radio-frozen", Window(0.0))
    assert levels(frozen, 400.0) == levels(LOG, 0.0)


def test_levels_are_played_backwards():
    found = faulty("levels-backwards")
    for number in range(100):
        assert levels(found, 150.0 + number) == levels(LOG, 249.0 - number)
    roles = faulty("levels-backwards", Window(0.0)).radio
    assert set(roles[roles["role"] == "serving"]["cell"][:300]) == {"c100", "c103"}


def test_a_neighbour_is_stuck():
    for seed in range(8):
        found = faulty("neighbour-stuck", Window(150.0), seed)
        differing = set()
        for at_s in range(150, 400):
            was, now = levels(LOG, float(at_s)), levels(found, float(at_s))
            differing |= {a for a in {*was, *now} if was.get(a) != now.get(a)}
        (stuck,) = differing
        assert stuck != 100
        first = levels(LOG, 150.0)[stuck]
        for at_s in (150.0, 199.0, 299.0):
            assert levels(found, at_s)[stuck] == first
        # While it serves, it is measured.
        served = stuck == 103
        assert (levels(found, 350.0)[stuck] == levels(LOG, 350.0)[stuck]) == served


def test_the_levels_of_a_cell_are_a_minute_old():
    found = faulty("cell-stale")
    for at_s in (150.0, 200.0, 249.0):
        was, now = levels(LOG, at_s), levels(found, at_s)
        differing = {arfcn for arfcn in was if was[arfcn] != now[arfcn]}
        assert len(differing) == 1
        (cell,) = differing
        assert now[cell] == levels(LOG, at_s - 60.0)[cell]
    assert changed_columns("cell-stale", "radio") == {"level_dbm"}
    # Nothing is known of a minute ago.
    early = faulty("cell-stale", Window(0.0, 60.0))
    same(early.radio, LOG.radio)


def test_one_row_is_at_a_thousand_million_seconds():
    radio = faulty("report-far-ahead").radio
    far = np.flatnonzero(radio["time_s"] > 1e6)
    assert far.size == 1
    assert radio["time_s"][far[0]] == 1e9
    assert LOG.radio["time_s"][far[0]] == 150.0
    same(radio.drop(columns="time_s"), LOG.radio.drop(columns="time_s"))


@pytest.mark.parametrize(("name", "by_s"), [("clock-steps-back", -30.0), ("clocks-apart", 20.0)])
def test_one_clock_is_off(name, by_s):
    moved = set()
    for seed in range(8):
        found = faulty(name, seed=seed)
        for table in ("motion", "radio"):
            was, now = getattr(LOG, table), getattr(found, table)
            same(now.drop(columns="time_s"), was.drop(columns="time_s"))
            off_s = (now["time_s"] - was["time_s"]).to_numpy()
            if off_s.any():
                moved.add(table)
                assert (off_s == np.where(WINDOW.holds(was["time_s"]), by_s, 0.0)).all()
        same(found.truth, LOG.truth)
    assert moved == {"motion", "radio"}


def test_rows_are_delivered_twice():
    found = faulty("epochs-twice")
    for table in ("motion", "radio"):
        was, now = getattr(LOG, table), getattr(found, table)
        count = len(inside(was))
        assert len(now) == len(was) + count
        again = now[(now["time_s"] % 1) > 0.2]
        same(
            again.drop(columns="time_s").reset_index(drop=True), inside(was).drop(columns="time_s")
        )
    walked_m = inside(found.motion)["step_m"].sum()
    assert walked_m == pytest.approx(2 * inside(LOG.motion)["step_m"].sum())


@pytest.mark.parametrize("end_s", [WINDOW.end_s, np.inf])
def test_a_recording_pauses_in_all_its_tables_and_goes_on(end_s):
    window = Window(WINDOW.begin_s, end_s)
    goes_on_s = end_s if np.isfinite(end_s) else window.begin_s + 30.0
    found = faulty("recording-paused", window)
    for table in ("motion", "radio"):
        same(getattr(found, table), outside(getattr(LOG, table), Window(window.begin_s, goes_on_s)))
        assert getattr(found, table)["time_s"].max() >= goes_on_s
    same(found.truth, LOG.truth)


@given(first_s=st.floats(-1e3, 1e3), lasts_s=st.floats(1.0, 1e4), seed=st.integers(0, 2**32))
def test_faults_begin_within_the_walk(first_s, lasts_s, seed):
    window = drawn_window(first_s, first_s + lasts_s, np.random.default_rng(seed))
    share = (window.begin_s - first_s) / lasts_s
    assert window.begin_s == first_s or 0.4 - 1e-6 <= share <= 0.7 + 1e-6
    assert window.end_s == np.inf or 60.0 - 1e-6 <= window.end_s - window.begin_s <= 300.0 + 1e-6


def test_shares_of_windows():
    """Within four standard errors of 2000 draws."""
    drawn = [drawn_window(0.0, 1000.0, np.random.default_rng(seed)) for seed in range(2000)]
    at_once = np.mean([window.begin_s == 0.0 for window in drawn])
    lasting = np.mean([window.end_s == np.inf for window in drawn])
    assert at_once == pytest.approx(0.2, abs=4 * np.sqrt(0.16 / 2000))
    assert lasting == pytest.approx(0.5, abs=4 * np.sqrt(0.25 / 2000))
