"""Headings that jump in a walk: the walker has turned, or the phone was turned or mirrored."""

from dataclasses import replace

import numpy as np
import pytest
from made_town import Town, walk_log

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.held import Hold, HoldRules, jumps
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import GnssFix, epochs
from mapfilter.serving.state_file import decode, encode
from mapfilter.tracks.log import make_log

TOWN = Town.of(1)
AREA = BayesFilter(heading_sd_deg=6.0).over_area(TOWN.area())
# Rows of the made town are 5 m long.
WATCHED = replace(AREA, holds=replace(AREA.holds, longest_row_m=6.0))
UNWATCHED = replace(AREA, holds=HoldRules(watched=False))
SEEDS = range(1, 7)
TURNED_S = 120.0


def log_of(seed, change=None, until_s=np.inf):
    """A walk of 240 s whose headings are changed from the middle on."""
    log = walk_log(TOWN, seed, error_db=3.0)
    motion = log.motion.copy()
    late = (motion["time_s"] > TURNED_S) & (motion["time_s"] <= until_s)
    if change is not None:
        motion.loc[late, "heading_rad"] = change(motion.loc[late, "heading_rad"])
    return make_log(log.crs, motion=motion, radio=log.radio, truth=log.truth)


def reversed_(heading):
    return heading + np.pi


def mirrored(heading):
    return 2.2 - heading


def followed(positioner, log, seed):
    """Follow a log from its known start: errors, whether claimed, reasons, and all states."""
    rng, truth, state = np.random.default_rng(seed), log.truth, None
    state = positioner.begin_at(truth["east_m"][0], truth["north_m"][0], 5.0, rng)
    off_m, claimed, reasons, states = [], [], [], []
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
        fix = output.fix
        off_m.append(
            np.hypot(
                fix.east_m - np.interp(fix.time_s, truth["time_s"], truth["east_m"]),
                fix.north_m - np.interp(fix.time_s, truth["time_s"], truth["north_m"]),
            )
        )
        claimed.append(fix.status in (Status.CONVERGED, Status.TRACKING))
        reasons.append({one.reason for one in output.unused if one.kind == "motion"})
        states.append(state)
    return np.array(off_m), np.array(claimed), reasons, states


@pytest.mark.parametrize("change", [reversed_, mirrored])
def test_a_turned_phone_is_noticed_and_its_headings_are_read_otherwise(change):
    wrong, ends = {}, {}
    for positioner in (WATCHED, UNWATCHED):
        name, found = positioner.holds.watched, []
        for seed in SEEDS:
            off_m, claimed, reasons, states = followed(positioner, log_of(seed, change), seed)
            found.append((np.mean(claimed & (off_m > 50)), np.median(off_m[-60:]) < 30))
            if name and states[-1].hold != Hold():
                assert any(Reason.PHONE_TURNED in one for one in reasons)
        wrong[name], ends[name] = np.mean(found, axis=0)
    assert wrong[True] < 0.75 * wrong[False]
    assert ends[True] > ends[False] + 0.3


def test_walks_whose_headings_do_not_jump_are_the_same_to_the_bit():
    """Rows of 5 m may hold a corner: by default none of the town's turns is a jump."""
    log = log_of(3)
    found, other = (followed(one, log, 3)[3][-1] for one in (AREA, UNWATCHED))
    assert found.belief.state.tobytes() == other.belief.state.tobytes()
    assert found.held == ()


def test_walkers_who_turn_are_followed_as_before():
    """Beliefs with a turned phone have draws of their own, and do not take over."""
    for seed in (1, 2, 3):
        log = log_of(seed)
        off_m, claimed, _, states = followed(WATCHED, log, seed)
        plain = followed(UNWATCHED, log, seed)
        assert any(one.held for one in states)
        assert states[-1].hold == Hold()
        assert np.array_equal(off_m, plain[0])
        assert claimed.mean() > plain[1].mean() - 0.05


def test_measured_positions_leave_no_doubt():
    log, rng = log_of(1, reversed_), np.random.default_rng(1)
    state = WATCHED.begin_at(log.truth["east_m"][0], log.truth["north_m"][0], 5.0, rng)
    for epoch in epochs(log):
        here = GnssFix(
            *(float(np.interp(epoch.time_s, log.truth["time_s"], log.truth[name]))
              for name in ("east_m", "north_m")), 25.0, 25.0
        )  # fmt: skip
        state, _ = WATCHED.step(state, replace(epoch, fix=here), rng)
        assert state.held == ()


def test_a_state_with_such_beliefs_can_be_saved():
    _, _, _, states = followed(WATCHED, log_of(1, reversed_), 1)
    held = next(one for one in states if one.held)
    again = decode(encode({"state": held}), "made")["state"]
    assert [one.hold for one in again.held] == [one.hold for one in held.held]
    assert encode({"state": again}) == encode({"state": held})


def test_what_a_jump_is():
    rules = HoldRules()
    walked, far = MotionStep(1.4, 3.0), MotionStep(3.5, 3.0)
    assert jumps(0.0, walked, rules)
    # Angles wrap; small changes, long rows, rests and rows without a heading are no jumps.
    assert not jumps(-3.0, walked, rules)
    assert not jumps(2.2, walked, rules)
    assert not jumps(0.0, far, rules)
    assert not jumps(0.0, MotionStep(0.0, 3.0), rules)
    assert not jumps(0.0, MotionStep(1.4, np.nan), rules)
    assert not jumps(np.nan, walked, rules)
    assert not jumps(0.0, walked, replace(rules, watched=False))


def test_how_headings_are_read_after_a_jump():
    turned, mirror = Hold().straight_on(0.4, 0.4 + np.pi)
    assert turned.read(MotionStep(1.0, 0.9 + np.pi, 0.5)).heading_rad == pytest.approx(0.9)
    read = mirror.read(MotionStep(1.0, 0.9 + np.pi, 0.5))
    assert (read.heading_rad, read.turn_rad) == pytest.approx((-0.1, -0.5))
    # Turned back, headings are read as they are.
    back, _ = turned.straight_on(0.4 + np.pi, 0.4)
    assert back.is_usual
    assert not turned.is_usual
    again, _ = mirror.straight_on(1.0, 1.0)
    assert again.direction_rad(1.0) == pytest.approx(mirror.direction_rad(1.0))
    step = MotionStep(1.0, 0.3)
    assert Hold().read(step) is step


def test_vehicles_and_maps_without_cells_are_not_watched():
    assert AREA.holds.watched
    assert not BayesFilter(vehicle=True).over_area(TOWN.area()).holds.watched
