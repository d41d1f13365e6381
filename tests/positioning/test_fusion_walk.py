"""A Kalman-type filter's walk step by step: motion, starts, noise that lasts, statuses."""

from dataclasses import asdict, replace
from math import cos, exp, hypot, inf, log10, nan, pi, radians, sin

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import EKF
from mapfilter.models.state import MOVING, POSITION
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.filter import KalmanSmoother
from mapfilter.positioning.kalman.level_errors import CellSlots, with_levels
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.readings import SiteReadings, site_readings
from mapfilter.positioning.kalman.reckoning import RECKONED
from mapfilter.positioning.kalman.report_model import aged, report_model
from mapfilter.positioning.kalman.start import first_belief
from mapfilter.positioning.kalman.state import KalmanState
from mapfilter.positioning.kalman.step import KalmanStep
from mapfilter.positioning.sensors.unmeasured import way_spread_m2
from mapfilter.radio.cells import Cell, CellPlan

CRS = "EPSG:32629"
# On the central meridian of the zone.
EAST, NORTH = 500_000.0, 4_600_000.0


def begun(step, fix, given):
    return first_belief(step.sites, step.own, fix, given)


def cell(name, east_m, **more):
    given = {"height_m": 30.0, "azimuth_deg": None, "eirp_dbm": 50.0, "frequency_mhz": 1800.0,
             "antenna": "omni"}  # fmt: skip
    return Cell(name, name, EAST + east_m, NORTH, **(given | more))


PLAN = CellPlan(CRS, (
    cell("A", 0.0, arfcn=600, bsic=1), cell("B", 2000.0, arfcn=601, bsic=2),
    cell("C", 3000.0, antenna="sector", azimuth_deg=90.0, arfcn=601, bsic=3),
))  # fmt: skip
SITES = SiteModels(PLAN, KalmanOptions(fix_lasting_share=0.0))
MAY_BE_0 = (
    "fix_lasting_m",
    "fix_lasting_share",
    "bias_sd_deg",
    "drift_deg_per_sqrt_m",
    "turn_drift_deg_per_sqrt_m",
    "turn_rate_sd_deg_per_s",
    "scale",
)
NOTHING = SiteReadings((), (), (), (), ())


def walk(*, reckoned=True, sites=SITES):
    return KalmanStep(sites, EKF, KalmanState(RECKONED if reckoned else MOVING))


def started(reckoned=True, **more):
    made = walk(reckoned=reckoned, **more)
    size = made.layout.size
    mean, variances = np.full(size, 5.0), np.full(size, 9.0)
    if reckoned:
        # Headings and lengths of steps have no errors that last.
        mean[2:] = variances[2:] = 0.0
    made.belief = SumBelief.start(mean, np.diag(variances))
    made.time_s = 10.0
    return made


def test_the_usual_options():
    assert asdict(KalmanOptions()) == {
        "level_error_db": 12.0, "level_memory_m": 300.0, "level_offset_db": 10.0,
        "level_offset_memory_m": 3000.0, "level_noise_db": 8.0, "level_noise_memory_m": 40.0,
        "timing_step_m": pytest.approx(553.46, abs=0.01),
        "timing_sd_m": 200.0, "timing_memory_m": 500.0,
        "fix_sd_m": 10.0, "fix_lasting_share": 0.7, "fix_lasting_m": 0.0, "fix_lasting_s": 30.0,
        "acceleration_mps_per_sqrt_s": 0.7, "speed_sd_mps": 8.0, "step_sd_m": 0.3,
        "heading_sd_deg": 11.459155902616464, "bias_sd_deg": 10.0, "drift_deg_per_sqrt_m": 0.6,
        "turn_drift_deg_per_sqrt_m": 0.3, "turn_rate_sd_deg_per_s": 0.05,
        "scale": 0.03, "drift_m_per_sqrt_s": 0.3, "start_sd_m": 1500.0,
        "start_parts": 21, "start_spacing_m": 600.0, "reach_m": 35_000.0,
        "converged_radius_m": 1000.0,
    }  # fmt: skip
    for name in asdict(KalmanOptions()):
        for value in (0, -1.0, inf, nan):
            if value == 0 and name in MAY_BE_0:
                continue
            with pytest.raises(ConfigError, match=f"KalmanOptions, {name}: expected a .*r (>|in)"):
                KalmanOptions(**{name: value})
        if name != "fix_lasting_share":
            assert getattr(KalmanOptions(**{name: 7}), name) == 7
    with pytest.raises(ConfigError, match=r"fix_lasting_share: expected a number .*0\.7"):
        KalmanOptions(fix_lasting_share=0.71)
    with pytest.raises(ConfigError, match=r"start_parts: expected a whole number in 1\.\.100"):
        KalmanOptions(start_parts=101)
    # To the last digit what it was in radians.
    assert radians(KalmanOptions().heading_sd_deg) == 0.2


def test_steps_shift_and_spread():
    made = started()
    steps = (MotionStep(2.0, 0.5), MotionStep(3.0, nan), MotionStep(nan, 0.1), MotionStep(1.0, 2.0))
    made.moved_m = 7.0
    transition, noise, shift = made._move(Epoch(14.0, steps), ())
    np.testing.assert_array_equal(transition[:, :2], np.eye(5)[:, :2])
    # A heading error of 1 rad shifts each step to its left, a scale of 1 doubles it.
    lengths, headings = np.array([2.0, 1.0]), np.array([0.5, 2.0])
    along = np.stack([np.cos(headings), np.sin(headings)])
    left = np.stack([-along[1], along[0]])
    np.testing.assert_allclose(transition[:2, 2:4], np.stack([left @ lengths, along @ lengths], 1))
    np.testing.assert_array_equal(transition[2:], np.eye(5)[2:])
    assert not transition[:2, 4].any()
    expected = 0.09 * 4.0 * np.eye(2)
    way = np.zeros(2)
    for length_m, heading in ((2.0, 0.5), (1.0, 2.0)):
        along = np.array([cos(heading), sin(heading)])
        across = np.array([-along[1], along[0]])
        way += length_m * along
        expected += 0.09 * np.outer(along, along)
        expected += (0.2 * length_m) ** 2 * np.outer(across, across)
    # Without a direction it may have led anywhere: by the length of its step, in any direction.
    expected += way_spread_m2(3.0) / 2 * np.eye(2)
    assert way_spread_m2(3.0) == pytest.approx(9.0, rel=0.02)
    np.testing.assert_allclose(shift, [*way, 0.0, 0.0, 0.0])
    # The error of headings drifts: the last step has the drift of the 5 m before it, of which 3 m
    # are without a compass.
    before = radians(0.6) ** 2 * 2.0 + radians(0.3) ** 2 * 3.0
    expected += before * 1.0**2 * np.outer(left[:, 1], left[:, 1])
    np.testing.assert_allclose(noise[:2, :2], expected)
    np.testing.assert_allclose(noise[2, :2], before * left[:, 1])
    drifted = before + radians(0.6) ** 2 * 1.0
    # A rate of turns that is known wanders within 150 s by 0.05 degrees a second.
    wandered = radians(0.05) ** 2 * (1 - exp(-4.0 / 150.0))
    np.testing.assert_allclose(noise[2:, 2:], np.diag([drifted, 0.0, wandered]))
    assert made.moved_m == 13.0
    np.testing.assert_allclose(made.belief.means[0], [*(5.0 + way), 0.0, 0.0, 0.0])
    np.testing.assert_allclose(made.belief.covariances[0, :2, :2], 9.0 * np.eye(2) + expected)
    assert [one.reason for one in made.unused] == [Reason.NO_HEADING, Reason.NO_STEP]
    assert {(one.time_s, one.kind, one.what) for one in made.unused} == {(14.0, "motion", "")}


def test_without_dead_reckoning_one_keeps_going():
    made = started(reckoned=False)
    made.moved_m = 1.0
    transition, noise, shift = made._move(Epoch(12.0), ())
    pair = np.array([[1.0, 2.0], [0.0, 1.0]])
    np.testing.assert_array_equal(transition, np.kron(np.eye(2), pair))
    own = 0.49 * np.array([[8 / 3, 2.0], [2.0, 2.0]])
    np.testing.assert_allclose(noise, np.kron(np.eye(2), own))
    assert not shift.any()
    np.testing.assert_allclose(made.belief.means[0], [15.0, 5.0, 15.0, 5.0])
    # Two seconds at the root of 50 m/s.
    assert made.moved_m == pytest.approx(1.0 + 2.0 * hypot(5.0, 5.0))
    slow = started(reckoned=False)
    slow.belief = replace(slow.belief, means=np.array([[0.0, 0.6, 0.0, 0.8]]))
    slow.moved_m = 0.0
    slow._move(Epoch(14.0), ())
    assert slow.moved_m == 6.0
    # No time, or time that goes back, changes nothing.
    for time_s in (10.0, 9.0):
        made = started(reckoned=False)
        transition, noise, _ = made._move(Epoch(time_s), ())
        np.testing.assert_array_equal(transition, np.eye(4))
        assert not noise.any()


def test_before_the_start_nothing_moves():
    made = walk()
    fix = made.take(Epoch(3.0, (MotionStep(1.0, 0.0),) * 2))
    assert [one.reason for one in made.unused] == [Reason.NOT_STARTED] * 2
    assert (fix.status, fix.hypotheses, fix.reason) == (Status.SEARCHING, 0, Reason.NO_READING)
    assert (fix.way_id, np.isnan(fix.east_m), np.isnan(fix.mass_50m)) == (0, True, True)
    assert made.time_s == 3.0
    heard = (ReportRow("serving", "Z", None, None, -70.0, 0),)
    assert made.take(Epoch(4.0, radio=heard)).reason is Reason.UNKNOWN_CELL
    assert made.take(Epoch(5.0, gnss=GnssFix(nan, 1.0))).reason is Reason.NO_READING
    assert made.unused[-1].kind == "gnss"
    assert made.belief is None


def test_where_a_belief_starts():
    made = walk(reckoned=False)
    at_fix = begun(made, GnssFix(1.0, 2.0), NOTHING)
    np.testing.assert_array_equal(at_fix.means, [[1.0, 0.0, 2.0, 0.0]])
    np.testing.assert_array_equal(at_fix.covariances[0], np.diag([1500.0, 8, 1500, 8]) ** 2)
    about = begun(walk(), None, SiteReadings(("B",), (-70.0,), (), (), ()))
    assert about.means.shape == (441, 5)
    np.testing.assert_allclose(about.weights @ about.means, [EAST + 2000.0, NORTH, 0.0, 0.0, 0.0])
    expected = np.diag([1500.0, 1500.0, radians(10.0), 0.03, radians(0.05)]) ** 2
    np.testing.assert_allclose(about.moments.covariance, expected, rtol=1e-6, atol=1e-3)
    np.testing.assert_array_equal(
        about.covariances[:, 2:, 2:], np.tile(expected[2:, 2:], (441, 1, 1))
    )
    on_circle = begun(walk(), None, SiteReadings(("B",), (-70.0,), ("A",), (2,), ()))
    radius = 2.5 * KalmanOptions().timing_step_m
    # 8 694 m around by 600 m.
    assert on_circle.means.shape == (14, 5)
    np.testing.assert_allclose(on_circle.weights, 1 / 14)
    np.testing.assert_allclose(np.hypot(*(on_circle.means[:, :2] - [EAST, NORTH]).T), radius)
    np.testing.assert_allclose(on_circle.means[0], [EAST + radius, NORTH, 0.0, 0.0, 0.0])
    assert on_circle.means[1, 1] > NORTH
    np.testing.assert_allclose(on_circle.covariances[0, :2, :2], 600.0**2 * np.eye(2))
    near = begun(walk(), None, SiteReadings((), (), ("A",), (0,), ()))
    assert near.weights.size == 8
    far = begun(walk(), None, SiteReadings((), (), ("A",), (60,), ()))
    assert far.weights.size == 64
    around = 0.7 * 2 * pi * 60.5 * KalmanOptions().timing_step_m / 64
    np.testing.assert_allclose(far.covariances[0, :2, :2], around**2 * np.eye(2))


def test_errors_that_last_are_told_once():
    model = SITES.of(POSITION, ("A",), ("B",))
    sigma = hypot(200.0, KalmanOptions().timing_step_m / 12**0.5)
    np.testing.assert_allclose(model.noise, np.diag([64.0, sigma**2]))
    # Before the first report nothing has been told.
    np.testing.assert_allclose(aged(model, [100.0, 500.0], inf).noise, model.noise)
    after = aged(model, [100.0, 500.0], 25.0).noise
    np.testing.assert_allclose(after, np.diag([64.0 * 4, sigma**2 * 20]))
    assert aged(model, [100.0, 500.0], 0.0).noise[0, 0] == pytest.approx(64.0 * 1000)


def test_errors_of_more_cells_than_are_kept_are_noise():
    """For the first report both are the same."""

    def radius_m(count):
        slots = CellSlots.empty(count)
        made = KalmanStep(SITES, EKF, KalmanState(with_levels(RECKONED, slots), slots=slots))
        heard = tuple(ReportRow("serving", name, None, None, -70.0, 0) for name in ("B", "A"))
        made.take(Epoch(0.0, radio=heard))
        return float(made._fix(0.0, Reason.USED).radii_m[2])

    kept, noise = radius_m(2), radius_m(1)
    assert noise == pytest.approx(kept, rel=1e-3)


def test_errors_of_cells_that_are_not_kept_last_longer_than_noise():
    """Of two reports 30 m apart: noise lasts for 40 m, an error of 300 m counts once in 600 m."""
    made = KalmanStep(SITES, EKF, KalmanState(RECKONED, slots=CellSlots.empty(1)))
    made.layout = with_levels(RECKONED, made.slots)
    heard = (-70.0, -80.0)
    made._move(Epoch(0.0), ("B", "A"))
    given = SiteReadings(("B", "A"), heard, (), (), ())
    known = SITES, made.layout, given
    first = report_model(*known, made.slots, made.growth, made.moved_m)
    np.testing.assert_allclose(first.noise, np.diag([64.0, 64.0 + 144.0]))
    made.moved_m = 30.0
    made.slots = replace(made.slots, ago_m={"B": 30.0, "A": 30.0})
    made._move(Epoch(0.0), ("B", "A"))
    second = report_model(*known, made.slots, made.growth, made.moved_m)
    lasting_db2 = 64.0 * 40 / 30
    np.testing.assert_allclose(second.noise, np.diag([lasting_db2, lasting_db2 + 144.0 * 20]))


def test_noise_of_fixes():
    def gain(**variances):
        made = started()
        made._update_fix(GnssFix(9.0, 5.0, **variances), 10.0)
        return (made.belief.means[0, :2] - 5.0) / 4.0

    np.testing.assert_allclose(gain(), [9 / 109, 0.0], atol=1e-12)
    assert gain(var_east_m2=3.0, var_north_m2=1.0)[0] == pytest.approx(9 / 12)
    told = gain(var_east_m2=3.0, var_north_m2=2.0, cov_east_north_m2=1.0)
    spread = np.array([[12.0, 1.0], [1.0, 11.0]])
    np.testing.assert_allclose(told, 9.0 * np.linalg.inv(spread)[:, 0])
    for odd in ({"var_east_m2": 0.0, "var_north_m2": 1.0},
                {"var_east_m2": -1.0, "var_north_m2": -1.0},
                {"var_east_m2": 1.0, "var_north_m2": nan},
                {"var_east_m2": 1.0, "var_north_m2": 1.0, "cov_east_north_m2": 1.0}):  # fmt: skip
        np.testing.assert_allclose(gain(**odd), [9 / 109, 0.0], atol=1e-12)


def test_statuses():
    made = started()
    made._set_status(1000.1)
    assert made.status is Status.SEARCHING
    made._set_status(1000.0)
    assert made.status is Status.CONVERGED
    made._set_status(5000.0)
    assert made.status is Status.UNCERTAIN
    made._set_status(1000.0)
    assert made.status is Status.TRACKING
    made.recent_nis = [5.1] * 9
    made._set_status(5.0)
    assert made.status is Status.TRACKING
    made.recent_nis = [5.0] * 10
    made._set_status(5.0)
    assert made.status is Status.TRACKING
    made.recent_nis = [0.0] * 9 + [50.1]
    made._set_status(5.0)
    assert made.status is Status.LOST
    # Ten readings are remembered, each by its square for one component.
    for _ in range(12):
        made._update_fix(GnssFix(5.0, 5.0 + 1e-9), 10.0)
    assert len(made.recent_nis) == 10
    far = started()
    far._update_fix(GnssFix(5.0 + 109**0.5 * 2, 5.0), 10.0)
    assert far.recent_nis == [pytest.approx(2.0)]


def test_an_epoch_is_moved_and_then_measured():
    made, smoother = walk(), KalmanSmoother()
    heard = (ReportRow("serving", "A", None, None, -70.0, 0, 1.0),)
    first = made.take(Epoch(0.0, radio=heard))
    assert (first.reason, made.moved_m) == (Reason.USED, 0.0)
    smoother.add(None, made.state)
    assert first.hypotheses == made.belief.weights.size > 1
    assert 0.0 < first.mass_50m < made.belief.weights.max()
    made.take(Epoch(1.0, (MotionStep(30.0, 0.0),)))
    assert made.moved_m == 30.0
    smoother.add(None, made.state)
    np.testing.assert_array_equal(smoother.history.shifts[1], [30.0, 0.0, 0.0, 0.0, 0.0])
    at = GnssFix(EAST + 700.0, NORTH, 4.0, 4.0)
    fix = made.take(Epoch(2.0, gnss=at))
    assert (fix.status, fix.reason, made.moved_m) == (Status.CONVERGED, Reason.USED, 30.0)
    assert hypot(fix.east_m - EAST - 700.0, fix.north_m - NORTH) < 2.0
    assert fix.mass_50m == pytest.approx(1.0, abs=1e-6)


def test_which_rows_are_taken():
    rows = (
        ReportRow("serving", "A", None, None, -70.0, 0),
        ReportRow("neighbour", None, 601, 2, -80.0, 0),
        ReportRow("neighbour", None, 601, None, -81.0, 0),
        ReportRow("neighbour", None, 700, 1, -82.0, 0),
        ReportRow("neighbour", "C", None, None, -110.0, -1),
        ReportRow("neighbour", "Z", 1, 1, -83.0, 0, 5.0),
        ReportRow("neighbour", None, None, None, -84.0, 0),
        ReportRow("serving", "B", None, None, nan, 0, 4.0),
    )
    found = site_readings(SITES, Epoch(3.0, radio=rows))
    assert (found.cells, found.levels_dbm) == (("A", "B"), (-70.0, -80.0))
    assert (found.timed, found.steps) == (("B",), (4,))
    assert [(one.kind, one.what, one.reason) for one in found.unused] == [
        ("neighbour", "ARFCN 601, BSIC unknown", Reason.AMBIGUOUS_CELL),
        ("neighbour", "ARFCN 700, BSIC 1", Reason.UNKNOWN_CELL),
        ("neighbour", "Z", Reason.UNKNOWN_CELL),
        ("neighbour", "", Reason.NO_CELL),
        ("neighbour", "C", Reason.NOT_USED_BY_FILTER),
    ]
    assert {one.time_s for one in found.unused} == {3.0}


def test_levels_fall_as_cost_231_hata_says():
    # The formula for a medium town: 1800 MHz, 30 m and 1.5 m above ground.
    lift = (1.1 * log10(1800.0) - 0.7) * 1.5 - (1.56 * log10(1800.0) - 0.8)
    at_km = 46.3 + 33.9 * log10(1800.0) - 13.82 * log10(30.0) - lift
    slope = 44.9 - 6.55 * log10(30.0)
    model = SITES.of(POSITION, ("A", "C"), ())
    for away_m in (500.0, 1000.0, 4000.0):
        expected = 50.0 - at_km - slope * log10(away_m / 1000)
        # The sector looks east.
        plain = model.mean([EAST + away_m, NORTH])[0]
        assert plain == pytest.approx(expected, abs=1e-6)
        ahead = model.mean([EAST + 3000.0 + away_m, NORTH])[1]
        behind = model.mean([EAST + 3000.0 - away_m, NORTH])[1]
        assert ahead == pytest.approx(expected, abs=1e-3)
        assert behind == pytest.approx(expected - PLAN.cells[2].max_attenuation_db, abs=1e-6)
    near = SITES.of(POSITION, ("A",), ()).mean([[EAST + 20.0, NORTH], [EAST + 3.0, NORTH]])
    assert near[0] == near[1]
    low = SiteModels(CellPlan(CRS, (cell("L", 0.0, height_m=4.0, indoor=True,
                                         penetration_loss_db=15.0),)), KalmanOptions())  # fmt: skip
    at_10 = 46.3 + 33.9 * log10(1800.0) - 13.82 * log10(10.0) - lift
    found = low.of(POSITION, ("L",), ()).mean([EAST + 1000.0, NORTH])[0]
    assert found == pytest.approx(50.0 - at_10 - 15.0, abs=1e-6)


def test_a_repeated_fix_is_one_measurement():
    """What a receiver or a program repeats to the last digit makes the belief no narrower."""
    made = walk()
    fix = GnssFix(EAST + 700.0, NORTH, 100.0, 100.0, 0.0)
    first = made.take(Epoch(0.0, (MotionStep(0.0, 0.0),), gnss=fix))
    for _ in range(9):
        last = made.take(Epoch(0.0, (MotionStep(0.0, 0.0),), gnss=fix))
    # A step of no length with a heading spreads it a little.
    assert last.radii_m[2] == pytest.approx(first.radii_m[2], rel=0.01)
    assert [one.reason for one in made.unused if one.kind == "gnss"] == [Reason.REPEATED_FIX] * 9
    other = made.take(Epoch(0.0, (MotionStep(0.0, 0.0),), gnss=replace(fix, north_m=NORTH + 1.0)))
    assert other.radii_m[2] < 0.8 * first.radii_m[2]


def test_a_vehicle_that_waits_stays_where_its_receiver_says_without_dead_reckoning():
    """Positions in whole steps repeat themselves at a red light; the estimate must not coast on."""
    made = walk(reckoned=False)
    east_m = [*np.arange(0.0, 300.0, 10.0), *300.0 + np.cumsum([8.0, 6.0, 4.0, 2.0]), *[320.0] * 60]
    for time_s, at_m in enumerate(east_m):
        found = made.take(Epoch(float(time_s), gnss=GnssFix(EAST + at_m, NORTH, 9.0, 9.0, 0.0)))
    assert abs(found.east_m - EAST - 320.0) < 5.0
    assert not made.unused


@pytest.mark.parametrize(
    ("last", "repeats"),
    [
        (None, False),
        (GnssFix(1.0, 2.0), True),
        (GnssFix(1.0, 2.0, 9.0, 9.0), False),
        (GnssFix(1.0, 2.5), False),
    ],
)
def test_what_a_repeated_fix_is(last, repeats):
    assert GnssFix(1.0, 2.0).repeats(last) is repeats
