"""Headings that jump in a walk: the walker has turned, or the phone was turned or mirrored."""

from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest
from made_town import walk_log
from true_places import error_m
from turned_walks import AREA, START_M, TOWN, WATCHED, begun, walked

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.particle import UpdateInfo
from mapfilter.positioning.bayes.beliefs.new_beliefs import NewBeliefs
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals import own_draws
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, NullHypothesis
from mapfilter.positioning.bayes.rivals.held import (
    HeldOtherwise,
)
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.bayes.rivals.own_draws import own_rng
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.merging import epochs
from mapfilter.serving.state_file import decode, encode
from mapfilter.tracks.log import make_log

UNWATCHED = replace(AREA, holds=HoldRules(watched=False))
SEEDS = range(1, 7)
TURNED_S = 120.0
FOOT_M = 0.3048


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


def begun_walk(positioner, log, seed):
    """The state at the known start of a log, and a generator."""
    rng = np.random.default_rng(seed)
    return positioner.begin_at(log.truth["east_m"][0], log.truth["north_m"][0], 5.0, rng), rng


def rows_of(positioner, log, state, rng, from_s=-np.inf, until_s=np.inf):
    """Errors, whether claimed, reasons, and whether other beliefs are held; and the state."""
    rows = []
    for epoch in epochs(log):
        if not from_s < epoch.time_s <= until_s:
            continue
        state, output = positioner.step(state, epoch, rng)
        claimed = output.fix.status in (Status.CONVERGED, Status.TRACKING)
        reasons = {one.reason for one in output.unused if one.kind == "motion"}
        rows.append((error_m(log, output.fix), claimed, reasons, bool(state.held)))
    return rows, state


@cache
def first_half(watched, seed):
    """Until headings are changed all of these walks are the same."""
    positioner, log = WATCHED if watched else UNWATCHED, log_of(seed)
    state, rng = begun_walk(positioner, log, seed)
    return *rows_of(positioner, log, state, rng, until_s=TURNED_S), rng


@cache
def followed(watched, seed, change=None):
    """Follow a walk from its known start: what is found at each epoch, and the last state."""
    rows, state, rng = first_half(watched, seed)
    positioner, log = WATCHED if watched else UNWATCHED, log_of(seed, change)
    later, state = rows_of(positioner, log, state, deepcopy(rng), from_s=TURNED_S)
    off_m, claimed, reasons, held = zip(*rows, *later, strict=True)
    return np.array(off_m), np.array(claimed), reasons, held, state


@pytest.mark.parametrize("change", [reversed_, mirrored])
def test_a_turned_phone_is_noticed_and_its_headings_are_read_otherwise(change):
    wrong, ends = {}, {}
    for watched in (True, False):
        found = []
        for seed in SEEDS:
            off_m, claimed, reasons, _, state = followed(watched, seed, change)
            found.append((np.mean(claimed & (off_m > 50)), np.median(off_m[-60:]) < 30))
            if watched and state.hold != Hold():
                assert any(Reason.PHONE_TURNED in one for one in reasons)
        wrong[watched], ends[watched] = np.mean(found, axis=0)
    assert wrong[True] < 0.75 * wrong[False]
    assert ends[True] > ends[False] + 0.3


def test_walks_whose_headings_do_not_jump_are_the_same_to_the_bit():
    """The town's corners, of 90° between rows short enough, are below the least jump and bend."""
    log = log_of(3)
    watched = replace(WATCHED, holds=replace(WATCHED.holds, jump_deg=140.0, bend_deg=140.0))
    rows, state = rows_of(watched, log, *begun_walk(watched, log, 3))
    assert state.belief.state.tobytes() == followed(False, 3)[-1].belief.state.tobytes()
    assert not any(row[3] for row in rows)


def test_walkers_who_turn_are_followed_as_before():
    """Beliefs with a turned phone have draws of their own, and do not take over."""
    for seed in (1, 2, 3):
        off_m, claimed, _, held, state = followed(True, seed)
        plain = followed(False, seed)
        assert any(held)
        assert state.hold == Hold()
        assert np.array_equal(off_m, plain[0])
        assert claimed.mean() > plain[1].mean() - 0.05


def with_a_fix(epoch, log):
    """An epoch with a fix at the true place, of 5 m."""
    truth = log.truth
    place = (float(np.interp(epoch.time_s, truth["time_s"], truth[name]))
             for name in ("east_m", "north_m"))  # fmt: skip
    return replace(epoch, gnss=GnssFix(*place, 25.0, 25.0))


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("change", [None, reversed_, lambda heading: heading + np.pi / 2])
def test_fixes_tell_whether_the_phone_was_turned(change, every):
    """Right after a jump they agree with both explanations, 15 m on the belief rejects them."""
    log, rng = log_of(1, change), np.random.default_rng(1)
    state = WATCHED.begin_at(log.truth["east_m"][0], log.truth["north_m"][0], 5.0, rng)
    off_m, claimed = [], []
    for k, epoch in enumerate(epochs(log)):
        measured = with_a_fix(epoch, log)
        state, output = WATCHED.step(state, epoch if k % every else measured, rng)
        truth, fix = measured.gnss, output.fix
        off_m.append(np.hypot(fix.east_m - truth.east_m, fix.north_m - truth.north_m))
        claimed.append(fix.status is Status.TRACKING)
    assert state.hold.is_usual is (change is None)
    assert np.median(off_m[-100:]) < 10
    assert not np.any(np.array(claimed) & (np.array(off_m) > 50))
    assert np.mean(claimed) > 0.8


@pytest.mark.parametrize("mistaken", [True, False])
def test_measured_positions_tell_how_headings_are_to_be_read(mistaken):
    """Positions of 100 s end a wrong reading; a few that agree with a right one leave it."""
    hold, until_s = (Hold(-1.0, 2.2), 100) if mistaken else (Hold(1.0, np.pi), 10)
    log, rng = log_of(2), np.random.default_rng(2)
    if not mistaken:
        motion = log.motion.assign(heading_rad=log.motion["heading_rad"] + np.pi)
        log = make_log(log.crs, motion=motion, radio=log.radio, truth=log.truth)
    state = WATCHED.begin_at(log.truth["east_m"][0], log.truth["north_m"][0], 5.0, rng)
    state, ends = replace(state, hold=hold), []
    for epoch in epochs(log):
        measured = epoch.time_s <= until_s
        state, output = WATCHED.step(state, with_a_fix(epoch, log) if measured else epoch, rng)
        truth, fix = with_a_fix(epoch, log).gnss, output.fix
        ends.append((np.hypot(fix.east_m - truth.east_m, fix.north_m - truth.north_m), fix.status))
    off_m, statuses = zip(*ends[-100:], strict=True)
    assert state.hold == (Hold() if mistaken else hold)
    assert np.median(off_m) < 30
    assert np.mean([one is Status.TRACKING for one in statuses]) > 0.8


RADIO = next(one.radio for one in epochs(log_of(1)) if one.radio)


def beside(belief, east_m=0.0, **changed):
    """A belief elsewhere."""
    state = belief.state.copy()
    state[0] += east_m
    return replace(belief, state=state, **changed)


def test_an_alternative_reads_headings_as_they_are_also_once_it_takes_over():
    state, rng = begun()
    other = beside(state.belief, -250.0, log_evidence=100.0)
    alternative = AlternativeHypothesis(other, 0.0, 0.0)
    state = replace(state, hold=Hold(1.0, np.pi), alternative=alternative)
    after, _ = walked(state, rng, (1.0, 5.0, 0.0))
    for then, before, moved_m in (
        (after.belief, state.belief, -5.0),
        (after.alternative.belief, other, 5.0),
    ):
        assert then.summary.mean[0] - before.summary.mean[0] == pytest.approx(moved_m, abs=1.0)
    # Whatever the reading says of a place that was chosen for the test.
    certain = replace(after.alternative, null=NullHypothesis(-40.0))
    after = replace(after, alternative=certain, recovery=Recovery())
    after, output = WATCHED.step(after, Epoch(2.0, (MotionStep(5.0, 0.0),), RADIO), rng)
    assert after.takeovers == 1
    assert after.hold == Hold()
    # It has converged by itself, or will have to.
    assert after.recovery is None
    assert Reason.PHONE_TURNED not in {one.reason for one in output.unused}


def test_takeovers_are_reported_also_where_reports_have_times_of_their_own():
    """Here half a second after the row of motion."""
    state, rng = begun()
    state, _ = walked(state, rng, (1.0, 5.0, 0.0))
    other = beside(state.belief, -250.0, log_evidence=100.0)
    sure = NullHypothesis(-40.0)
    in_feet = AlternativeHypothesis(other, 0.0, 0.0, null=sure, hold=Hold(step_unit_m=FOOT_M))
    turned = HeldOtherwise(other, Hold(1.0, np.pi), 3.0, 0.0, sure)
    for beside_it, reason in (
        ({"alternative": in_feet}, Reason.OTHER_UNIT),
        ({"held": (turned,)}, Reason.PHONE_TURNED),
    ):
        after, output = WATCHED.step(replace(state, **beside_it), Epoch(1.5, (), RADIO), rng)
        assert after.takeovers == 1
        assert reason in {one.reason for one in output.unused}


def test_steps_in_feet_are_no_other_reading_of_headings():
    """With a position there is nothing to compare, and a phone turned back is no turned phone."""
    in_feet, turned = Hold(step_unit_m=FOOT_M), Hold(1.0, np.pi, FOOT_M)
    state, rng = begun()
    row = (MotionStep(5.0, 0.0),)
    for hold, found in ((in_feet, []), (turned, [in_feet])):
        measured = Epoch(1.0, row, gnss=GnssFix(*START_M, 25.0, 25.0))
        after, _ = WATCHED.step(replace(state, hold=hold), measured, rng)
        assert [one.hold for one in after.held] == found
    other = beside(state.belief, -250.0, log_evidence=100.0)
    held = HeldOtherwise(other, in_feet, 3.0, 0.0, NullHypothesis(-40.0))
    after, output = WATCHED.step(
        replace(state, hold=turned, held=(held,)), Epoch(1.0, row, RADIO), rng
    )
    assert (after.takeovers, after.hold) == (1, in_feet)
    assert not [one for one in output.unused if one.kind == "motion"]


def test_few_hypotheses_are_enough_for_beliefs_in_which_the_phone_was_turned():
    few = BayesFilter(max_particles=600, min_search_particles=300, min_particles=200)
    positioner = few.over_area(TOWN.area())
    assert positioner.beliefs.held_otherwise.options.min_particles == 600


def test_rows_of_one_time_have_draws_of_their_own(monkeypatch):
    made = []
    monkeypatch.setattr(own_draws, "own_rng", lambda *key: made.append(key) or own_rng(*key))
    state, rng = begun()
    motion = tuple(MotionStep(1.4, heading) for heading in (0.0, 3.0, 3.0, 0.0, 0.0))
    state, _ = WATCHED.step(state, Epoch(1.0, motion), rng)
    assert len(state.held) == 4
    assert len(made) == len(set(made)) > 0


def test_who_stands_may_turn_there():
    walk = [(time_s, 1.4, 0.0) for time_s in (1.0, 2.0, 3.0)]
    rest = [(time_s, 0.0, 0.0) for time_s in (4.0, 5.0, 6.0, 7.0)]
    for rows, count in (
        ([*walk, (4.0, 1.4, 3.0)], 2),
        ([*walk, *rest[:1], (5.0, 1.4, 3.0)], 2),
        ([*walk, *rest, (8.0, 1.4, 3.0)], 0),
        ([*walk, (8.0, 1.4, 3.0)], 0),
    ):
        assert len(walked(*begun(), *rows)[0].held) == count


def test_a_contested_position_is_lost_and_a_spread_one_uncertain():
    state, rng = begun()
    held = HeldOtherwise(beside(state.belief, 200.0), Hold(1.0, 3.0), 3.0, 0.0, ahead_m=-7.0)
    rest = (1.0, 0.0, 0.0)
    state, output = walked(replace(state, held=(held,)), rng, rest)
    assert (output.fix.status, state.contested) == (Status.LOST, True)
    assert Reason.PHONE_TURNED in {one.reason for one in output.unused}
    # Of 90 % in one place nothing is claimed, but they are not contested.
    wide = state.belief.state.copy()
    wide[0, ::10] += 200.0
    state = replace(state, held=(), belief=replace(state.belief, state=wide))
    cleared, output = walked(state, rng, (2.0, 0.0, 0.0))
    assert (output.fix.status, cleared.contested) == (Status.UNCERTAIN, False)
    assert Reason.PHONE_TURNED not in {one.reason for one in output.unused}


SURE = NullHypothesis(-40.0)


def rivalled(state, log_prior, **changed):
    """The state beside a turned phone 200 m away, with such odds."""
    other = beside(state.belief, 200.0)
    held = HeldOtherwise(other, Hold(1.0, 3.0), log_prior, 0.0, SURE, ahead_m=-7.0)
    return replace(state, held=(held,), null=SURE, **changed)


@pytest.mark.parametrize(("log_prior", "contested"), [(-3.0, False), (3.0, True)])
def test_while_it_is_contested_a_position_is_searched_for_anew(log_prior, contested):
    """What is ahead of a belief in a wrong place may be in a wrong place, too."""
    state, _ = walked(*begun(), (1.0, 5.0, 0.0))
    before, rng = rivalled(state, log_prior), np.random.default_rng(6)
    after, output = WATCHED.step(before, Epoch(1.5, (), RADIO), rng)
    assert (after.alternative is not None) == contested
    assert (output.fix.status is Status.LOST) == contested
    # Whether steps are in another unit is another question.
    assert after.alternatives == 0


def test_an_alternative_stays_beside_a_turned_phone_that_takes_over():
    """Its odds against the position stay what they were."""
    state, _ = walked(*begun(), (1.0, 5.0, 0.0))
    main = state.belief
    place = beside(main, -250.0, status=Status.SEARCHING)
    alternative = AlternativeHypothesis(place, 0.0, main.log_evidence, null=SURE)
    before, rng = rivalled(state, -5.0, alternative=alternative), np.random.default_rng(6)
    (held,) = before.held
    ahead = replace(held, belief=replace(held.belief, log_evidence=main.log_evidence + 50.0))
    after, output = WATCHED.step(replace(before, held=(ahead,)), Epoch(1.5, (), RADIO), rng)
    assert (after.takeovers, output.fix.status) == (1, Status.UNCERTAIN)
    other = after.alternative
    assert (other.start_m, other.main_log_evidence) == (0.0, main.log_evidence + 5.0)


@pytest.mark.parametrize("fixed", [False, True])
def test_what_was_lost_is_claimed_after_readings_over_some_way_or_a_fix(fixed):
    log = log_of(1)
    rng = np.random.default_rng(5)
    state = WATCHED.begin_at(log.truth["east_m"][0], log.truth["north_m"][0], 5.0, rng)
    rows = list(epochs(log))
    for epoch in rows[:30]:
        state, _ = WATCHED.step(state, epoch, rng)
    assert (state.status, state.recovery) == (Status.TRACKING, None)
    state, found = replace(state, recovery=Recovery()), []
    for epoch in rows[30:90]:
        measured = with_a_fix(epoch, log) if fixed else epoch
        then_m = state.reckoning.travelled_m
        state, output = WATCHED.step(state, measured, rng)
        found.append((output.fix.status, state.recovery, then_m, bool(epoch.radio)))
    if fixed:
        assert found[0][:2] == (Status.TRACKING, None)
        return
    uncertain = [row for row in found if row[1] is not None]
    assert {row[0] for row in uncertain} == {Status.UNCERTAIN}
    assert sum(row[3] for row in uncertain) >= 2
    assert uncertain[-1][2] - uncertain[0][2] > WATCHED.options.switch_hold_m - 3
    assert found[-1][:2] == (Status.TRACKING, None)


def test_motion_that_is_read_otherwise_is_used():
    state, rng = begun()
    _, output = walked(replace(state, hold=Hold(1.0, np.pi)), rng, (1.0, 1.4, 0.0))
    assert not [one for one in output.unused if one.kind == "motion"]


def test_beliefs_that_a_reading_leaves_no_hypothesis_of_are_dropped():
    state, rng = begun()
    none = replace(state.belief, log_weight=np.full_like(state.belief.log_weight, -np.inf))
    good, gone = (HeldOtherwise(one, Hold(1.0, 3.0), 0.0, 0.0) for one in (state.belief, none))
    radio = Epoch(1.0, (MotionStep(5.0, 0.0),), RADIO)
    state, _ = WATCHED.step(replace(state, held=(gone, good)), radio, rng)
    assert len(state.held) == 1
    used, unused = (
        SimpleNamespace(update=lambda belief, *_, why=why: (belief, UpdateInfo(why, None, 1)))
        for why in (Reason.USED, Reason.NO_CANDIDATES_LEFT)
    )
    searching = replace(state.belief, status=Status.SEARCHING)
    state = replace(state, belief=searching, twin=MirroredTwin(searching, 0.0))
    for own, kept in ((used, True), (unused, False)):
        new_beliefs = NewBeliefs(SimpleNamespace(filter_of=lambda _, own=own: own), ())
        twin = new_beliefs.twin(state, object(), RadioReading(), rng, False)
        assert (twin is not None) == kept


def test_a_state_with_such_beliefs_can_be_saved_and_goes_on():
    log = log_of(1, reversed_)
    held, rng = begun_walk(WATCHED, log, 1)
    rest = iter(epochs(log))
    for epoch in rest:
        held, _ = WATCHED.step(held, epoch, rng)
        if held.held:
            break
    rows = list(islice(rest, 5))
    again = decode(encode({"state": held}), "made")["state"]
    assert [one.hold for one in again.held] == [one.hold for one in held.held]
    assert encode({"state": again}) == encode({"state": held})
    ends = []
    for state in (held, again):
        rng, now = np.random.default_rng(9), state
        for epoch in rows:
            now, _ = WATCHED.step(now, epoch, rng)
        ends.append(now)
    assert ends[0].held
    assert encode({"state": ends[0]}) == encode({"state": ends[1]})
