"""Sensors that died while the log goes on: what notices them, and how fast the belief grows."""

from dataclasses import replace

import numpy as np
import pytest
from made_town import Town, walk_log
from made_watch import CELLS, NO_STEP, STEP, STILL, report, told, walked
from scipy.stats import multivariate_normal
from true_places import error_m

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.rest_levels import carried_nats_of
from mapfilter.tracks.log import make_log


def unmeasured(found):
    """Distance and mean square of all unmeasured ways."""
    steps = [step for epoch, *_ in found for step in epoch.motion if np.isfinite(step.spread_m)]
    return sum(step.step_m for step in steps), sum(step.spread_m**2 for step in steps)


def test_rows_that_end_are_missing_and_the_way_is_that_of_a_walker():
    """Its mean square is that of a velocity that forgets its direction after a minute."""
    end_s = 320.0
    radio = [Epoch(second, (), report([-70.0])) for second in np.arange(20.0, end_s + 1, 5.0)]
    _, found = told(walked() + radio)
    reasons = [why for _, why, _ in found]
    assert set(reasons[:20]) == {Reason.USED}
    # Rows came every second: after five without any they are missing, from the last one on.
    assert [reasons[20], reasons[21]] == [Reason.USED, Reason.MOTION_MISSING]
    assert set(reasons[21:]) == {Reason.MOTION_MISSING}
    rng, seconds = np.random.default_rng(1), round(end_s - 19.0)
    angle = np.cumsum(rng.normal(0, np.sqrt(2 / 60.0), (4000, seconds)), axis=1)
    speed = 1.4 * np.exp(1j * angle)
    distance_m, mean_square_m2 = unmeasured(found)
    assert distance_m == pytest.approx(1.4 * seconds)
    assert mean_square_m2 == pytest.approx((np.abs(speed.sum(axis=1)) ** 2).mean(), rel=0.08)


def test_the_way_of_steps_without_a_length_is_made_up_at_once():
    _, found = told([*walked(), Epoch(20.0, NO_STEP), Epoch(21.0, STEP), Epoch(22.0, STILL)])
    assert [why for _, why, _ in found[20:]] == [Reason.NO_STEP, Reason.USED, Reason.USED]
    (way,) = found[20][0].motion
    assert way.step_m == pytest.approx(1.4)
    assert way.spread_m == pytest.approx(1.4, rel=0.02)
    assert not np.isfinite(way.heading_rad)
    assert found[21][0].motion == STEP


@pytest.mark.parametrize("always", [True, False])
def test_rows_that_come_with_steps_only_are_missing_at_rest(always):
    """A pedometer has no rows at rest: then levels must tell."""
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.4, 0.7, 30))
    rows = [Epoch(float(time_s), STEP) for time_s in times]
    if always:
        rows.append(Epoch(float(times[-1]) + 1, STILL))
    later = [Epoch(100.0 + second, (), report([-70.0, -80.0])) for second in range(60)]
    _, found = told(rows + later)
    assert {why for _, why, _ in found[len(rows) :]} == {
        Reason.MOTION_MISSING if always else Reason.USED
    }


def test_a_rest_that_was_measured_is_none_of_the_way():
    """After 20 minutes at rest one row lacks a length: a second's way, not one of 20 minutes."""
    rest = [Epoch(float(second), STILL) for second in range(20, 1200)]
    watch, _ = told(walked() + rest)
    _, ((epoch, why, _),) = told([Epoch(1200.0, NO_STEP)], watch)
    assert why is Reason.NO_STEP
    assert epoch.motion[-1].step_m == pytest.approx(1.4)
    _, ((epoch, why, _),) = told([Epoch(1206.0, (), report([-70.0]))], watch)
    assert why is Reason.MOTION_MISSING
    assert epoch.motion[-1].step_m == pytest.approx(7 * 1.4)


def test_turns_without_a_length_are_kept():
    turn = MotionStep(float("nan"), float("nan"), 1.5)
    _, found = told([*walked(), Epoch(20.0, (turn,))])
    kept, way = found[20][0].motion
    assert kept is turn
    assert way.step_m == pytest.approx(1.4)


def test_a_step_after_a_rest_without_rows_is_no_rest():
    """A pedometer's first row after a minute covers a step, not the minute."""
    times = np.cumsum(np.random.default_rng(3).uniform(0.4, 0.7, 30))
    rows = []
    for start_s in (0.0, 80.0):
        rows += [Epoch(start_s + float(time_s), STEP) for time_s in times]
        end_s = rows[-1].time_s
        rows += [Epoch(end_s + k, (), report([-70.0, -80.0])) for k in range(1, 60)]
    watch, found = told(rows)
    assert not watch.pace.reports_always
    assert {why for _, why, _ in found} == {Reason.USED}


def test_the_speed_is_that_of_all_the_time():
    """Two rows a millisecond apart, of 0.7 m each, every second."""
    times = sorted([*range(60), *(second + 0.001 for second in range(60))])
    watch, _ = told([Epoch(float(time_s), (MotionStep(0.7, 0.0),)) for time_s in times])
    assert 1.0 < watch.pace.speed_mps < 2.1


def at_rest(rng, seconds, elsewhere_db_per_s=0.0, motion=STILL):
    """Levels of seven cells, as they fade at rest, or wander as one is carried on."""
    lasting, levels = rng.normal(0, 2.0, 7), rng.uniform(-100, -70, 7)
    for second in range(seconds):
        lasting = 0.98 * lasting + 0.4 * rng.normal(size=7)
        levels = levels + elsewhere_db_per_s**0.5 * rng.normal(size=7)
        heard = np.round(levels + lasting + rng.normal(0, 3.3, 7))
        yield Epoch(20.0 + second, motion, report(heard))


def test_a_phone_at_rest_for_20_minutes_is_at_rest():
    for seed in range(20):
        _, found = told([*walked(), *at_rest(np.random.default_rng(seed), 1200)])
        assert {why for _, why, _ in found} == {Reason.USED}, seed
        assert unmeasured(found) == (0.0, 0.0)


def test_steps_of_zero_while_levels_wander_are_stuck():
    """A variance of 1.2 dB² a second, as 49 dB² over 60 m of a walk, is found within minutes."""
    after_s = []
    for seed in range(20):
        _, found = told([*walked(), *at_rest(np.random.default_rng(seed), 300, 1.2)])
        stuck = [k for k, (_, why, _) in enumerate(found) if why is Reason.MOTION_STUCK]
        assert stuck, seed
        after_s.append(stuck[0] - 20)
        assert stuck == list(range(stuck[0], len(found)))
        # The whole way since the last step is made up for.
        assert unmeasured(found)[0] == pytest.approx(1.4 * (len(found) - 20), rel=0.02)
    assert np.median(after_s) < 90


STROLL = (MotionStep(0.35, 0.0),)


def walked_before(steps, rng, db_per_s, mps=1.4):
    """Watch a minute of steps at a speed, then five with these steps and levels that wander."""
    before = [Epoch(second - 40.0, (MotionStep(mps, 0.0),)) for second in range(60)]
    return told([*before, *at_rest(rng, 300, db_per_s, steps)])[1]


def test_steps_that_shrink_to_a_tenth_while_levels_change_as_before_are_stuck():
    after_s = []
    for seed in range(20):
        found = walked_before((MotionStep(0.14, 0.0),), np.random.default_rng(seed), 1.2)
        stuck = [k for k, (_, why, _) in enumerate(found) if why is Reason.MOTION_STUCK]
        assert stuck, seed
        after_s.append(stuck[0] - 60)
        # What was measured until then is in the belief already.
        measured_m = 0.14 * after_s[-1]
        assert 0.85 * 420 < unmeasured(found)[0] + measured_m <= 420
    assert np.median(after_s) < 150


def test_a_stroll_is_as_slow_as_it_is_measured():
    """Levels wander as along a street at 0.35 m/s: in five minutes few are taken for carried on.

    A vehicle in a jam is slow, too.
    """
    stuck = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        found = walked_before(STROLL, rng, 0.3)
        stuck += Reason.MOTION_STUCK in {why for _, why, _ in found}
        found = walked_before((MotionStep(1.0, 0.0),), rng, 1.2, mps=10.0)
        assert {why for _, why, _ in found} == {Reason.USED}, seed
    assert stuck <= 8


def test_one_who_always_strolls_moves():
    watch, _ = told([Epoch(float(second), STROLL) for second in range(400)])
    assert watch.rest is None
    assert watch.pace.speed_mps == pytest.approx(0.35, abs=0.01)


def test_serving_cells_one_after_another_are_stuck_too():
    rows = [Epoch(20.0 + 30 * k, STILL, report([np.nan] * 7, cell)) for k, cell in enumerate(CELLS)]
    _, found = told([*walked(), *rows])
    assert [why is Reason.MOTION_STUCK for _, why, _ in found[20:]] == [False] * 5 + [True] * 2
    pair = [Epoch(20.0 + 30 * k, STILL, report([np.nan] * 7, CELLS[k % 3])) for k in range(40)]
    assert {why for _, why, _ in told([*walked(), *pair])[1]} == {Reason.USED}


def test_a_night_at_rest_with_cell_ids_alone_is_a_rest():
    """Three cells serve in turns, now and then for half a minute others."""
    rng, epochs_ = np.random.default_rng(4), [*walked()]
    for second in range(20, 8 * 3600, 30):
        cell = CELLS[3 + rng.integers(4)] if rng.random() < 0.02 else CELLS[rng.integers(3)]
        epochs_.append(Epoch(float(second), STILL, report([np.nan] * 7, cell)))
    assert {why for _, why, _ in told(epochs_)[1]} == {Reason.USED}


@pytest.mark.parametrize(("sd_m", "status"), [(5.0, "TRACKING"), (40.0, "SEARCHING")])
def test_a_start_known_to_a_hundred_metres_is_searched_from(sd_m, status):
    state = AREA.begin_at(500_400.0, 4_500_400.0, sd_m, np.random.default_rng(0))
    assert state.status is Status(status)
    state, output = AREA.step(state, Epoch(1.0, STEP), np.random.default_rng(1))
    assert output.fix.status is Status(status)


def test_a_measured_step_ends_the_doubt():
    watch, _ = told([*walked(), *at_rest(np.random.default_rng(0), 300, 1.2)])
    assert watch.rest.is_carried
    watch, ((epoch, why, _),) = told([Epoch(320.0, STEP)], watch)
    assert (why, watch.rest, watch.unmeasured_s, epoch.motion) == (Reason.USED, None, 0.0, STEP)


@pytest.mark.parametrize("changes", [(3.0,), (2.0, -9.0), (8.0, 7.5, 9.0), (-12.0, 3.0, 0.0, 9.5)])
def test_likelihoods_of_changes_are_those_of_normal_vectors(changes):
    first = dict.fromkeys(CELLS[: len(changes)], (-160.0, 2))
    now = {cell: (3 * (-80.0 + x), 3) for cell, x in zip(CELLS, changes, strict=False)}
    count = len(changes)

    def log_density(sd_db):
        return multivariate_normal.logpdf(
            changes, np.zeros(count), sd_db**2 * np.eye(count) + 36.0 * np.ones((count, count))
        )

    expected = 0.5 * (log_density(9.0) - log_density(4.0))
    assert carried_nats_of(first, now, 0.0) == pytest.approx(expected)
    assert carried_nats_of(first, {"Z": (-80.0, 1)}, 0.0) == 0.0


def test_a_log_that_begins_without_motion_is_left_alone():
    rows = [Epoch(float(k), (), report([-70 - k, -80])) for k in range(20)]
    assert told(rows)[1] == [(epoch, Reason.USED, Reason.USED) for epoch in rows]


TOWN = Town.of(1)
AREA = BayesFilter(claim_mass=0.95).over_area(TOWN.area())


def faulty(log, fault):
    """Return a log whose sensors fail after 120 of 240 s."""
    motion, radio, half_s = log.motion.copy(), log.radio, 120.0
    late = motion["time_s"] > half_s
    if fault == "ended":
        motion = motion[~late]
    elif fault == "stuck":
        motion.loc[late, "step_m"] = 0.0
    elif fault == "no length":
        motion.loc[late, "step_m"] = np.nan
    elif fault == "paused":
        # Nothing at all is recorded for 50 s, in which one goes on for 250 m.
        motion, radio = (rows[~rows["time_s"].between(120.0, 170.0)] for rows in (motion, radio))
        radio = radio.reset_index(drop=True)
    elif fault == "reversed":
        motion.loc[late, "heading_rad"] += np.pi
    motion = motion.reset_index(drop=True)
    return make_log(log.crs, motion=motion, radio=radio, truth=log.truth)


def tracked(log, seed, positioner):
    """Track a log from its known start; return how far off each epoch is, its radius and status."""
    rng = np.random.default_rng(seed)
    truth = {name: log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")}
    state = positioner.begin_at(truth["east_m"][0], truth["north_m"][0], 5.0, rng)
    rows, reasons = [], set()
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
        fix = output.fix
        off_m = error_m(log, fix)
        claimed = fix.status in (Status.CONVERGED, Status.TRACKING)
        rows.append((fix.time_s, off_m, fix.radii_m[-1], claimed))
        reasons.update(one.reason for one in output.unused if one.kind == "motion")
    return np.array(rows), reasons


def test_an_unmeasured_way_before_the_start_leaves_the_compass():
    rng, log = np.random.default_rng(1), walk_log(TOWN, 1, error_db=3.0)
    state = AREA.begin()
    rows = [epoch for epoch in epochs(log) if epoch.motion]
    for epoch in rows[:2]:
        state, _ = AREA.step(state, replace(epoch, radio=(), motion=NO_STEP), rng)
    heard = next(epoch for epoch in rows[2:] if epoch.radio)
    state, _ = AREA.step(state, replace(heard, motion=NO_STEP), rng)
    assert state.belief is not None
    assert state.compass


def test_the_walks_are_tracked_while_all_sensors_work():
    for seed in (1, 2, 3):
        found, reasons = tracked(walk_log(TOWN, seed, error_db=3.0), seed, AREA)
        assert found[:, 3].mean() > 0.9
        assert np.median(found[:, 1]) < 15
        assert not reasons


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("ended", "motion_missing"),
        ("paused", "motion_missing"),
        ("stuck", "motion_stuck"),
        ("no length", "no_step"),
    ],
)
def test_without_motion_a_position_is_not_claimed_for_long(fault, reason):
    """One goes on at 5 m/s; only levels tell that steps of zero are wrong, which takes longer."""
    noticed_s = 210.0 if fault == "stuck" else 160.0
    for seed in (1, 3):
        found, reasons = tracked(faulty(walk_log(TOWN, seed, error_db=3.0), fault), seed, AREA)
        late = found[:, 0] > noticed_s
        assert found[~late, 3].mean() > 0.6
        assert not (found[late, 3].astype(bool) & (found[late, 1] > found[late, 2])).any()
        assert found[late, 3].mean() < 0.1
        assert Reason(reason) in reasons


def test_a_phone_that_is_turned_in_its_pocket_is_found_again():
    """Headings are off by half a circle from the middle on; without the remedy all stay lost."""
    share = {}
    for remounts_per_m in (1e-3, 0.0):
        motion = replace(AREA.model.motion, remounts_per_m=remounts_per_m)
        positioner = replace(AREA, model=replace(AREA.model, motion=motion))
        logs = [
            (seed, faulty(walk_log(TOWN, seed, error_db=3.0), "reversed")) for seed in range(1, 7)
        ]
        ends = [tracked(log, seed, positioner)[0][-60:] for seed, log in logs]
        share[remounts_per_m] = np.mean([(end[:, 1] < 30).mean() for end in ends])
    assert share[1e-3] > 0.35
    assert share[0.0] < 0.1


def test_a_rest_remembers_the_first_levels_of_each_cell():
    rest = Rest(0.0)
    for second in range(25):
        rows = report([-70.0] if second < 10 else [-75.0, -90.0])
        rest = rest.heard(float(second), rows)
    assert rest.first == {"A": (-700.0, 10), "B": (-900.0, 10)}
    assert rest.present == {"A": (-375.0, 5), "B": (-450.0, 5)}
