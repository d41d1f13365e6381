"""Odometry at 50 Hz: steps of centimetres are added up before hypotheses move."""

from math import cos, isnan, nan, sin

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_town import CRS, Town, slowed, walk_log

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.sensors.short_steps import LEAST_M, ShortSteps
from mapfilter.serving import state_file
from mapfilter.tracks.log import make_log

TOWN = Town.of(1)
AREA = BayesFilter().over_area(TOWN.area())
PLACE = ("east_m", "north_m")
LOG = slowed(walk_log(TOWN, 2))
MOTION, RADIO, TRUTH = (rows[rows["time_s"] <= 240] for rows in (LOG.motion, LOG.radio, LOG.truth))
START_M = tuple(TRUTH[list(PLACE)].iloc[0])


def gathered(steps, short=None):
    """Return what moves, each step an epoch of its own, and what waits."""
    short, moved = short or ShortSteps(), []
    for second, step in enumerate(steps):
        short, epoch = short.gathered(Epoch(float(second), (step,)))
        moved += epoch.motion
    return moved, short


def end_of(steps):
    """Where steps with headings, or with turns, lead."""
    east_m = north_m = heading_rad = 0.0
    for step in steps:
        if isnan(step.heading_rad):
            heading_rad += step.turn_rad
        else:
            heading_rad = step.heading_rad
        east_m += step.step_m * cos(heading_rad)
        north_m += step.step_m * sin(heading_rad)
    return np.array([east_m, north_m]), heading_rad


LENGTHS = st.floats(-0.3, 2.0).filter(lambda length: abs(length) > 1e-3)


@given(st.lists(st.tuples(LENGTHS, st.floats(-0.5, 0.5)), min_size=1, max_size=60), st.booleans())
def test_no_way_and_no_turn_is_lost(rows, compass):
    headings = np.cumsum([turn for _, turn in rows])
    steps = [
        MotionStep(length, float(heading)) if compass else MotionStep(length, nan, turn)
        for (length, turn), heading in zip(rows, headings, strict=True)
    ]
    moved, short = gathered(steps)
    every = [*moved, *([short.waiting] if short.waiting is not None else [])]
    assert sum(one.step_m for one in every) == pytest.approx(sum(one.step_m for one in steps))
    (end_m, last_rad), (all_m, turned_rad) = end_of(every), end_of(steps)
    if compass:
        # Each sum leads along its mean heading: what it lacks is of the sagittas of half metres.
        assert np.hypot(*(end_m - all_m)) <= 0.05 * len(every)
    else:
        assert last_rad == pytest.approx(turned_rad, abs=1e-9)
    assert short.waiting is None or abs(short.waiting.step_m) < LEAST_M


def test_steps_move_when_they_are_half_a_metre():
    moved, short = gathered([MotionStep(0.2, 0.1, sampling_sd_m=0.03)] * 2)
    assert (moved, short.waiting.step_m) == ([], pytest.approx(0.4))
    moved, short = gathered([MotionStep(0.2, 0.3, sampling_sd_m=0.04)], short)
    assert short == ShortSteps()
    (step,) = moved
    assert step.step_m == pytest.approx(0.6)
    assert step.heading_rad == pytest.approx(1 / 6, abs=1e-3)
    assert step.sampling_sd_m == pytest.approx((0.03**2 * 2 + 0.04**2) ** 0.5)


@pytest.mark.parametrize(
    "step",
    [
        MotionStep(0.5, 0.1),
        MotionStep(-0.6, 0.1),
        MotionStep(0.0, 0.1),
        MotionStep(0.1, nan),
        MotionStep(nan, 0.1),
        MotionStep(0.1, nan, nan, 3.0),
        MotionStep(0.1, 0.2, turned_sd_rad=0.5),
    ],
)
def test_what_is_long_or_not_measured_does_not_wait(step):
    assert gathered([step]) == ([step], ShortSteps())


@pytest.mark.parametrize(
    "step",
    [
        MotionStep(-0.1, 0.1),  # It reverses.
        MotionStep(0.1, 0.7),  # The phone is turned.
        MotionStep(0.1, nan, 0.1),  # By other sensors.
        MotionStep(0.1, 0.1, 0.1),
    ],
)
def test_steps_of_another_kind_are_none_of_the_sum(step):
    first = MotionStep(0.2, 0.1)
    moved, short = gathered([first, step])
    assert moved == [first]
    assert short.waiting == step


def test_a_rest_goes_on_in_what_waits():
    moved, short = gathered([MotionStep(0.2, 0.1), MotionStep(0.0, 0.1), MotionStep(0.2, 0.1)])
    assert (moved, short.waiting.step_m) == ([], pytest.approx(0.4))


@pytest.mark.parametrize(
    "measured",
    [
        {"radio": (ReportRow("serving", "A", None, None, -70.0, 0, nan),)},
        {"gnss": GnssFix(0.0, 0.0, 9.0, 9.0, 0.0)},
        {"pseudoranges": (Pseudorange("G01", 2e7, 3.0, (2e7, 0.0, 0.0)),)},
        {"tdoa": (Difference("A", "B", 40.0, 10.0),)},
    ],
)
def test_nothing_waits_for_what_is_measured(measured):
    steps = (MotionStep(0.1, 0.1), MotionStep(0.1, 0.1))
    short, epoch = ShortSteps().gathered(Epoch(0.0, steps, **measured))
    assert short == ShortSteps()
    assert [one.step_m for one in epoch.motion] == [pytest.approx(0.2)]


def followed(log):
    """Return errors, radii of 95 % and the number of moves from a known start on."""
    rng, found, beliefs = np.random.default_rng(0), [], 0
    state = AREA.begin_at(*START_M, 3.0, rng)
    for epoch in epochs(log):
        before = state.belief
        state, output = AREA.step(state, epoch, rng)
        beliefs += state.belief is not before
        fix = output.fix
        found.append((epoch.time_s, fix.east_m, fix.north_m, fix.radii_m[2]))
    time_s, *place_m, radius_m = np.array(found).T
    truth_m = [np.interp(time_s, TRUTH["time_s"], TRUTH[axis]) for axis in PLACE]
    return np.hypot(*np.subtract(place_m, truth_m)), radius_m, beliefs


def test_a_walk_at_50_hz_is_followed_as_at_its_own_rate():
    ends_s, parts = MOTION["time_s"].to_numpy(), 200
    rows = {
        "time_s": np.concatenate([np.linspace(end - 4 + 4 / parts, end, parts) for end in ends_s]),
        "step_m": np.repeat(MOTION["step_m"] / parts, parts),
        "heading_rad": np.repeat(MOTION["heading_rad"], parts),
    }
    slow = make_log(CRS, motion=MOTION, radio=RADIO)
    fast = make_log(CRS, motion=pd.DataFrame(rows), radio=RADIO)
    error_m, radius_m, moves = followed(fast)
    usual_m, _, usual = followed(slow)
    assert len(error_m) > 12_000
    assert moves < 12 * usual
    assert np.mean(error_m <= radius_m) > 0.9
    assert np.median(error_m) < 1.5 * np.median(usual_m) + 1


def test_a_session_is_saved_between_two_parts_of_a_step():
    state, rng = AREA.begin(), np.random.default_rng(0)
    state, _ = AREA.step(state, Epoch(0.0, (MotionStep(0.2, 0.1),)), rng)
    assert state.watch.short.waiting is not None
    kept = state_file.decode(state_file.encode({"state": state}), "session")
    assert repr(kept["state"].watch.short) == repr(state.watch.short)
