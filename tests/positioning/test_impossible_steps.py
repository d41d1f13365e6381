"""Steps that nothing can have gone are read as steps without a length."""

from math import isnan, nan

import numpy as np
import pytest
from cross_world import make_plan, walk_log

from mapfilter.api.located import locate
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors.impossible_steps import without_impossible
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched

SMALL = BayesFilter(max_particles=1500, min_search_particles=800, min_particles=300)
WALKER = Pace(100.0, 100.0, 100, 1.0, 0.0, False, 1.4, 1.4, 2.0)


@pytest.fixture(scope="module")
def log():
    plain = walk_log()
    radio, truth = plain.radio.copy(), plain.truth
    for cell in make_plan().cells[:2]:
        away_m = np.hypot(truth["east_m"] - cell.east_m, truth["north_m"] - cell.north_m)
        radio.loc[radio["cell"] == cell.id, "level_dbm"] = -50 - 0.1 * away_m
    return walk_log(radio=radio)


def with_step(log, row, step_m):
    motion = log.motion.copy()
    motion.loc[row, "step_m"] = step_m
    return walk_log(motion=motion, radio=log.radio)


@pytest.mark.parametrize(
    ("since_s", "step_m", "kept"),
    # 50 m, and 150 m each second since the row before.
    [(1.0, 200.0, True), (1.0, 200.1, False), (1.0, -200.1, False), (0.0, 50.0, True),
     (0.0, 50.1, False), (60.0, 9050.0, True), (60.0, 9050.1, False)],
)  # fmt: skip
def test_a_step_is_possible_by_its_time(since_s, step_m, kept):
    motion = (MotionStep(1.0, 0.5, 0.1), MotionStep(step_m, 0.25, 0.2))
    found = without_impossible(WALKER, 100.0 + since_s, motion, 1.0)
    assert (found is motion) == kept
    assert found[0] == motion[0]
    assert isnan(found[1].step_m) != kept
    assert (found[1].heading_rad, found[1].turn_rad) == (0.25, 0.2)


def test_lengths_are_those_of_the_unit():
    feet = (MotionStep(300.0, 0.0),)
    assert without_impossible(WALKER, 101.0, feet, 0.3048) is feet
    assert isnan(without_impossible(WALKER, 101.0, feet, 1.0)[0].step_m)


def test_before_the_pace_is_known_and_where_it_is_no_vehicles_all_stays():
    motion = (MotionStep(1e6, 0.0),)
    young = Pace(20.0, 20.0, 20, 1.0, 0.0, False, 1.4, 1.4, 2.0)
    millimetres = Pace(100.0, 100.0, 100, 1.0, 0.0, False, 1400.0, 1400.0, 2000.0)
    for pace in (Pace(), young, millimetres):
        assert without_impossible(pace, 101.0, motion, 1.0) is motion
    assert without_impossible(millimetres, 101.0, motion, 0.001) is not motion


def through(motion_of, seconds=300, hz=1):
    """Lengths that reach a belief, of rows at fixed times after 60 s at 20 m/s."""
    watch, gone_m, reasons = SensorWatch(), 0.0, []
    for number in range((60 + seconds) * hz):
        time_s = number / hz
        step_m = 20.0 / hz if time_s < 60 else motion_of(number - 60 * hz)
        rows = (MotionStep(step_m, 0.5 + 1e-3 * number),)
        watch, seen, (why, _) = watched(watch, Epoch(time_s, rows))
        reasons.append(why)
        if time_s >= 60:
            gone_m += sum(step.step_m for step in seen.motion if not isnan(step.step_m))
    return gone_m, reasons


@pytest.mark.parametrize(("hz", "every_m"), [(10, 100.0), (5, 100.0), (1, 500.0), (1, 1000.0)])
def test_a_coarse_odometer_is_believed(hz, every_m):
    """Its rows are zero until a whole length has been gone."""
    rows = round(every_m / 20.0 * hz)
    gone_m, reasons = through(lambda n: every_m if n % rows == rows - 1 else 0.0, hz=hz)
    assert Reason.IMPOSSIBLE_STEP not in reasons
    assert gone_m >= 20.0 * 300 - every_m


def test_a_sum_after_rows_without_a_length_is_believed():
    _, reasons = through(lambda n: 61 * 20.0 if n % 61 == 60 else nan)
    assert Reason.IMPOSSIBLE_STEP not in reasons


def test_headings_beside_a_jump_do_not_become_stuck():
    """A jump is no way on which headings could have changed."""
    watch, reasons = SensorWatch(), []
    for number in range(160):
        rows = (MotionStep(1e6 if number == 120 else 1.4, 0.5),)
        watch, _, (why, _) = watched(watch, Epoch(float(number), rows))
        reasons.append(why)
    assert reasons[120] is Reason.IMPOSSIBLE_STEP
    assert set(reasons[:120] + reasons[121:]) == {Reason.USED}


def test_before_the_first_step_no_time_is_known():
    motion = (MotionStep(1e6, 0.0),)
    standing = Pace(100.0, nan, 100, 1.0, 0.0, True, 1.4, 1.4, 0.0)
    assert without_impossible(standing, 101.0, motion, 1.0) is motion


def test_rows_without_a_length_stay():
    motion = (MotionStep(nan, 0.0),)
    assert without_impossible(WALKER, 101.0, motion, 1.0) is motion


@pytest.mark.parametrize("others", [(), (MotionStep(1.4, 0.0),)])
def test_the_reason_is_told_and_the_way_is_unmeasured(others):
    watch = SensorWatch(pace=WALKER, moving_s=100.0, known_s=100.0)
    epoch = Epoch(101.0, (*others, MotionStep(5000.0, 0.0)))
    after, seen, (motion, radio) = watched(watch, epoch)
    assert (motion, radio) == (Reason.IMPOSSIBLE_STEP, Reason.USED)
    assert after.pace.fastest_mps == 2.0
    gone_m = [step.step_m for step in seen.motion if not isnan(step.step_m)]
    # Without any other row the usual pace of 1.4 m/s goes to all sides for a second.
    assert gone_m == pytest.approx([1.4])


def test_a_tracked_position_survives_a_sensor_that_jumps(database, log):
    plain = locate(log, database, SMALL).estimate
    jumped = locate(with_step(log, 320, 1e6), database, SMALL).estimate
    assert plain.status[320] is Status.TRACKING
    assert set(jumped.status[320:]) == {Status.TRACKING}
    assert [one.time_s for one in jumped.unused if one.reason is Reason.IMPOSSIBLE_STEP] == [321.0]
    apart_m = np.hypot(jumped.east_m - plain.east_m, jumped.north_m - plain.north_m)[321:]
    assert apart_m.max() < 15.0


def test_a_grid_whose_mass_has_left_the_area_begins_anew(database, log):
    # The pace is not known yet, so that the step is believed.
    found = locate(with_step(log, 4, 1e6), database, "grid").estimate
    assert np.isnan(found.east_m[5:7]).any()
    assert found.reason[5] is Reason.NO_CANDIDATES_LEFT
    assert found.status[5] is Status.SEARCHING
    assert np.isfinite(found.east_m[20:]).all()
    assert found.status[-1] is Status.TRACKING


def test_a_grid_that_tracked_and_is_carried_off_is_lost_and_found(database, log):
    motion = log.motion.copy()
    # Not beyond 50 m and 150 m/s, so believed, and out of an area of 400 m.
    motion.loc[300:303, "step_m"] = 190.0
    carried = walk_log(motion=motion, radio=log.radio)
    found = locate(carried, database, "grid").estimate
    assert found.status[299] is Status.TRACKING
    begun = [i for i, why in enumerate(found.reason) if why is Reason.NO_CANDIDATES_LEFT]
    assert begun
    assert np.isnan(found.east_m[begun[0]])
    assert found.status[begun[0]] in (Status.LOST, Status.OUTSIDE)
    claimed = {Status.CONVERGED, Status.TRACKING}
    assert not claimed & set(found.status[begun[0] : begun[0] + 20])
    assert np.isfinite(found.east_m[begun[0] + 20 :]).any()
