"""Filters take the step of timing advance, and of levels, from the log that states them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.bayes.options import VEHICLE, BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import by_streets_alone, fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.vehicle_signs import vehicle_signs
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
LTE_M = 299_792_458 / 30.72e6 * 8


def log(**columns):
    rows = {"time_s": np.arange(4.0), "role": "serving", "cell": "A", "level_dbm": -80.0}
    rows |= {"timing_advance": 3} | columns
    return make_log(CRS, radio=pd.DataFrame(rows))


@pytest.mark.parametrize("options", [BayesFilter(), KalmanFilter(), KalmanFilter(method="ukf")])
def test_steps_of_timing_advance_by_technology(options):
    fitted, notes = fitted_to_log(options, log(technology="LTE"))
    assert fitted.timing_step_m == pytest.approx(LTE_M)
    assert notes == ("timing advance: steps of 78.07 m, by technology",)
    assert fitted_to_log(options, log(technology="GSM")) == (options, ())


@pytest.mark.parametrize(
    "columns",
    [
        {},
        {"technology": "NR"},
        {"technology": ["LTE", "LTE", "GSM", "LTE"]},
        {"technology": ["LTE", "LTE", None, "LTE"]},
        {"technology": "LTE", "timing_advance": None},
    ],
)
def test_nothing_is_assumed_where_the_step_is_not_known(columns):
    options = BayesFilter()
    assert fitted_to_log(options, log(**columns)) == (options, ())


def test_what_the_user_set_stays():
    options = BayesFilter(timing_step_m=100.0, level_error_db=6.0)
    given = log(technology="LTE", level_step_db=10.0)
    assert fitted_to_log(options, given) == (options, ())
    custom = object()
    assert fitted_to_log(custom, given) == (custom, ())
    assert fitted_to_log(CandidateFilter(), given)[0] == CandidateFilter()


def test_steps_of_levels_add_their_rounding_error():
    fitted, notes = fitted_to_log(BayesFilter(), log(level_step_db=12.0))
    usual_db = BayesFilter().level_error_db
    assert fitted.level_error_db == pytest.approx((usual_db**2 + 12.0**2 / 12) ** 0.5)
    assert "levels in steps of 12 dB" in notes[0]
    assert fitted_to_log(BayesFilter(), log(level_step_db=0.0))[1] == ()
    fitted, notes = fitted_to_log(KalmanFilter(), log(level_step_db=12.0))
    assert fitted == KalmanFilter(level_noise_db=(8.0**2 + 12.0) ** 0.5)
    assert "level_noise_db = 8.72" in notes[0]
    assert fitted_to_log(BayesFilter(), log(level_step_db=10.0, censored=1))[1] == ()


def test_a_vehicle_is_located_by_timing_advances_of_lte():
    """Circles of 78 m steps about three sites meet at the place, those of 553 m nowhere."""
    sites = {"A": (385_000.0, 6_672_000.0), "B": (388_000.0, 6_672_000.0)}
    sites["C"] = (385_500.0, 6_676_000.0)
    plan = CellPlan(
        CRS,
        tuple(
            Cell(name, name, *place, 30.0, None, 50.0, 1800.0, "omni", technology="LTE")
            for name, place in sites.items()
        ),
    )
    here = np.array([386_200.0, 6_673_600.0])
    rows = []
    for second in range(60):
        for name, place in sites.items():
            steps = int(np.hypot(*(here - place)) / LTE_M)
            rows.append(
                {
                    "time_s": float(second),
                    "role": "serving",
                    "cell": name,
                    "timing_advance": steps,
                    "technology": "LTE",
                }
            )
    motion = pd.DataFrame({"time_s": np.arange(60.0), "step_m": 0.0, "heading_rad": 0.0})
    given = make_log(CRS, radio=pd.DataFrame(rows), motion=motion)
    fitted, _ = fitted_to_log(KalmanFilter(), given)
    errors = []
    for options in (fitted, KalmanFilter()):
        track = locate(given, options.over_sites(plan), np.random.default_rng(0))
        place = np.array([track.estimate.east_m[-1], track.estimate.north_m[-1]])
        errors.append(np.hypot(*(place - here)))
    assert errors[0] < 200
    assert errors[1] > 500


def moving(**imu):
    motion = pd.DataFrame({"time_s": np.arange(50.0), "step_m": 4.0, "heading_rad": 0.0})
    return make_log(CRS, motion=motion, imu=ImuNoise(**imu))


def test_measured_errors_of_motion_are_those_that_are_assumed():
    given = moving(
        sigma_trans_m=0.1,
        sigma_orient_deg=8.0,
        bias_sd_deg=12.0,
        scale=0.07,
        drift_deg_per_sqrt_s=0.4,
    )
    fitted, notes = fitted_to_log(BayesFilter(), given)
    found = (fitted.step_sd_m, fitted.heading_sd_deg, fitted.bias_sd_deg, fitted.scale)
    # Rows of 4 m at 4 m/s, of which a step of 1.4 m is a part.
    assert found == (pytest.approx(0.1 * (1.4 / 4.0) ** 0.5), 8.0, 12.0, 0.07)
    # 0.4 degrees per root second at 4 m/s.
    assert fitted.drift_deg_per_sqrt_m == pytest.approx(0.2)
    assert notes[0].startswith(
        "errors of motion as the log states them: step_sd_m = 0.0592 (of a step of 1.4 m), "
        "scale = 0.07"
    )
    kept, _ = fitted_to_log(BayesFilter(heading_sd_deg=2.0), given)
    assert (kept.heading_sd_deg, kept.bias_sd_deg) == (2.0, 12.0)
    kalman, _ = fitted_to_log(KalmanFilter(), given)
    assert (kalman.step_sd_m, kalman.heading_sd_deg) == (0.1, 8.0)


def rows_of(row_m, period_s, vehicle=None):
    """Rows with an error of 9 m each."""
    rows = {"time_s": period_s * np.arange(50.0), "step_m": row_m, "heading_rad": 0.0}
    given = make_log(CRS, motion=pd.DataFrame(rows), imu=ImuNoise(sigma_trans_m=9.0))
    return replace(given, vehicle=vehicle)


@pytest.mark.parametrize("period_s", [1.0, 0.5])
def test_errors_of_a_vehicles_rows_do_not_jump_with_their_length(period_s):
    for row_m in (2.0, 5.6, 13.9, 14.9, 15.1):
        fitted, notes = fitted_to_log(BayesFilter(), rows_of(row_m, period_s, vehicle=True))
        assert fitted.step_sd_m == pytest.approx(9.0 * (1.4 / row_m) ** 0.5)
        assert f"step_sd_m = {fitted.step_sd_m:.3g} (of a step of 1.4 m)" in notes[-1]
        unsaid, _ = fitted_to_log(BayesFilter(), rows_of(row_m, row_m / 2.7))
        assert unsaid.step_sd_m == fitted.step_sd_m


@pytest.mark.parametrize(
    "given", [rows_of(0.7, 0.5), rows_of(1.4, 1.0), rows_of(8.4, 6.0), rows_of(1.2, 0.1, True)]
)
def test_rows_of_walks_and_short_rows_count_as_steps(given):
    fitted, notes = fitted_to_log(BayesFilter(), given)
    assert fitted.step_sd_m == 9.0
    assert "step_sd_m = 9" in notes[-1]
    assert "of a step" not in notes[-1]


@pytest.mark.parametrize(("row_m", "assumed_m"), [(15.0, 9.0), (35.0, 1.8)])
def test_errors_of_long_rows_are_those_of_their_whole_length(row_m, assumed_m):
    """Of 35 m, which are 25 typical steps of the map filter."""
    step_m = np.full(50, row_m)
    step_m[:20] = 0.0
    motion = pd.DataFrame({"time_s": 6.0 * np.arange(50.0), "step_m": step_m, "heading_rad": 0.0})
    given = make_log(CRS, motion=motion, imu=ImuNoise(sigma_trans_m=9.0))
    assert fitted_to_log(BayesFilter(), given)[0].step_sd_m == pytest.approx(assumed_m)
    # A Kalman filter's is that of a row.
    assert fitted_to_log(KalmanFilter(), given)[0].step_sd_m == 9.0
    assert fitted_to_log(BayesFilter(step_sd_m=0.7), given)[0].step_sd_m == 0.7


def test_errors_of_a_gyroscope_are_a_drift():
    given = moving(turns="gyro", gyro_noise_deg_per_sqrt_s=0.3, sigma_trans_m=0.0)
    fitted, _ = fitted_to_log(BayesFilter(), given)
    assert fitted.drift_deg_per_sqrt_m == pytest.approx(0.15)
    assert fitted.heading_sd_deg == BayesFilter().heading_sd_deg
    assert fitted.step_sd_m == 0.05
    # Also a larger one than other turns have.
    noisy = moving(turns="gyro", gyro_noise_deg_per_sqrt_s=2.0)
    kalman, _ = fitted_to_log(KalmanFilter(), noisy)
    assert kalman.turn_drift_deg_per_sqrt_m == pytest.approx(1.0)
    by_compass, _ = fitted_to_log(KalmanFilter(), moving(drift_deg_per_sqrt_s=2.0))
    assert by_compass.turn_drift_deg_per_sqrt_m == KalmanFilter().turn_drift_deg_per_sqrt_m


def biased_log(drift_degps, imu=None, **columns):
    """A straight drive of 10 m/s, with a fix each second."""
    time_s = np.arange(300.0)
    turn = np.radians(drift_degps)
    motion = {"time_s": time_s, "step_m": 10.0, "turn_rad": turn} | columns
    gnss = {"time_s": time_s, "east_m": 500_000.0 + 10 * time_s, "north_m": 4_600_000.0}
    return make_log(CRS, motion=pd.DataFrame(motion), gnss=pd.DataFrame(gnss), imu=imu)


def test_turns_that_drift_beside_the_fixes_have_a_lasting_error_as_large():
    fitted, notes = fitted_to_log(KalmanFilter(), biased_log(-1.5))
    assert fitted.turn_rate_sd_deg_per_s == pytest.approx(1.5, rel=0.01)
    assert notes[-1] == (
        "turns drift by 1.5 deg/s beside the course of the positions, as of a gyroscope with a "
        "bias: turn_rate_sd_deg_per_s is as large"
    )
    stated = ImuNoise(turns="gyro", gyro_bias_deg_per_s=0.4)
    assert fitted_to_log(KalmanFilter(), biased_log(1.5, stated))[0].turn_rate_sd_deg_per_s > 1.4
    assert fitted_to_log(KalmanFilter(), biased_log(0.35, stated))[0].turn_rate_sd_deg_per_s == 0.4
    for given in (biased_log(0.2), biased_log(1.5, heading_rad=0.0)):
        assert fitted_to_log(KalmanFilter(), given)[0].turn_rate_sd_deg_per_s == 0.05
    chosen = KalmanFilter(turn_rate_sd_deg_per_s=0.07)
    assert fitted_to_log(chosen, biased_log(1.5))[0] == chosen


def test_the_bias_of_a_gyroscope_is_a_lasting_error_of_the_rate_of_turns():
    given = moving(turns="gyro", gyro_bias_deg_per_s=0.2)
    assert fitted_to_log(KalmanFilter(), given)[0].turn_rate_sd_deg_per_s == 0.2
    kept = KalmanFilter(turn_rate_sd_deg_per_s=0.3)
    assert fitted_to_log(kept, given)[0].turn_rate_sd_deg_per_s == 0.3
    assert fitted_to_log(KalmanFilter(), moving())[0].turn_rate_sd_deg_per_s == 0.05


def turning(speed_mps, lasts_s=120, **columns):
    time_s = np.arange(lasts_s, dtype=np.float64)
    rows = {"time_s": time_s, "step_m": speed_mps, "turn_rad": 0.01} | columns
    return make_log(CRS, motion=pd.DataFrame(rows))


@pytest.mark.parametrize("options", [BayesFilter(), GridFilter()])
def test_turns_without_headings_at_a_vehicles_speed_are_a_vehicles(options):
    fitted, notes = fitted_to_log(options, turning(9.0))
    assert fitted.vehicle is True
    assert fitted.resolved.heading_sd_deg == VEHICLE["heading_sd_deg"]
    assert notes == (
        "motion: turns without headings, up to 9 m/s, gains of 4 m/s in 3 s: 0, turns of up to "
        "0 deg in 5 m: taken for a vehicle's (filter.bayes.vehicle)",
    )
    # Waiting at lights for most of the time does not make a walker of a car.
    in_traffic = np.where(np.arange(120) % 60 < 20, 9.0, 0.0)
    assert fitted_to_log(options, turning(in_traffic))[0].vehicle is True


@pytest.mark.parametrize(
    "given",
    [
        turning(1.4),
        turning(4.0),
        turning(9.0, heading_rad=0.1),
        turning(9.0, turn_rad=np.nan),
        turning(9.0, lasts_s=5),
        turning(np.where(np.arange(120) == 60, 40.0, 1.4)),
        make_log(CRS, motion=pd.DataFrame({"time_s": [0.0, 1.0], "turn_rad": 0.1})),
    ],
)
def test_other_motion_is_not_taken_for_a_vehicles(given):
    fitted, notes = fitted_to_log(BayesFilter(), given)
    assert fitted == BayesFilter()
    assert not any("taken for a" in note for note in notes)


def riding(sway_dps, speed_mps=7.0, frequency_hz=0.8, lasts_s=300, launches=0, gains_mps=9.0):
    """Return motion at 10 Hz with a steady speed, a swaying yaw rate, and starts from rest."""
    time_s = np.arange(0, lasts_s, 0.1)
    speed = np.full(len(time_s), speed_mps)
    for k in range(launches):
        begin = (k + 1) * lasts_s / (launches + 1)
        since_s = time_s - begin
        speed = np.where((since_s >= 0) & (since_s < 20), np.clip(since_s * 2, 0, gains_mps), speed)
    rate = np.radians(sway_dps) * np.sin(2 * np.pi * frequency_hz * time_s)
    rows = {"time_s": time_s, "step_m": 0.1 * speed, "turn_rad": 0.1 * rate}
    return make_log(CRS, motion=pd.DataFrame(rows))


@pytest.mark.parametrize(
    ("given", "vehicle"),
    [
        (riding(0.5), True),
        (riding(5.0), False),
        # A cyclist is no faster than 12 m/s, nor gains 4 m/s in 3 s again and again.
        (riding(5.0, speed_mps=14.0), True),
        (riding(5.0, launches=2), False),
        (riding(5.0, launches=5), True),
        # A car does not turn about in 5 m.
        (turning(np.where(np.arange(120) % 60 < 50, 9.0, 1.5), turn_rad=0.0), True),
        (
            turning(
                np.where(np.arange(120) % 60 < 50, 9.0, 1.5),
                turn_rad=np.where(np.arange(120) % 60 > 55, 0.8, 0.0),
            ),
            False,
        ),
        # A gyroscope that drifts at rest turns nothing.
        (turning(np.where(np.arange(120) % 60 < 20, 9.0, 0.0), turn_rad=0.1), True),
    ],
)
def test_cyclists_are_no_vehicles(given, vehicle):
    fitted, notes = fitted_to_log(BayesFilter(), given)
    assert (fitted.vehicle is True) == vehicle
    whose = "a vehicle's" if vehicle else "a cyclist's, no vehicle's"
    assert any(f"taken for {whose} (filter.bayes.vehicle)" in note for note in notes)


def test_signs_of_a_log_of_centuries_or_of_one_moment():
    time_s = np.r_[np.arange(60.0), 1e10]
    rows = pd.DataFrame({"time_s": time_s, "step_m": 9.0, "turn_rad": 0.01})
    signs = vehicle_signs(make_log(CRS, motion=rows))
    assert signs.top_mps < 1
    once = pd.DataFrame({"time_s": [5.0, 5.0, 5.0], "step_m": [1.0, 2.0, 3.0], "turn_rad": 0.1})
    assert not vehicle_signs(make_log(CRS, motion=once)).fast


def test_whose_motion_it_is_can_be_stated():
    assert fitted_to_log(BayesFilter(vehicle=False), turning(9.0))[0].vehicle is False
    assert fitted_to_log(BayesFilter(vehicle=True), turning(1.4))[0].vehicle is True
    assert BayesFilter().resolved == BayesFilter()
    assert fitted_to_log(CandidateFilter(), turning(9.0)) == (CandidateFilter(), ())


@pytest.mark.parametrize("options", [BayesFilter(), GridFilter()])
def test_what_a_log_states_of_its_vehicle_counts_more_than_signs(options):
    walked, driven = turning(1.0), turning(9.0)
    fitted, notes = fitted_to_log(options, replace(walked, vehicle=True))
    assert fitted.vehicle is True
    assert notes == ("motion: a vehicle's, as the log states it (filter.bayes.vehicle)",)
    fitted, notes = fitted_to_log(options, replace(driven, vehicle=False))
    assert fitted.vehicle is False
    assert notes == ("motion: no vehicle's, as the log states it (filter.bayes.vehicle)",)
    own = replace(options, vehicle=False)
    assert fitted_to_log(own, replace(walked, vehicle=True)) == (own, ())


def test_a_log_that_states_no_drift_leaves_the_assumed_one():
    fitted, _ = fitted_to_log(BayesFilter(), moving(sigma_trans_m=0.1, sigma_orient_deg=8.0))
    assert fitted.drift_deg_per_sqrt_m == BayesFilter().drift_deg_per_sqrt_m > 0


@pytest.mark.parametrize(
    ("speeds_mps", "usual_mps"),
    # Rows of less than 0.2 m/s stand; what stands always has no speed.
    [((0.8,), 0.8), ((0.3, 0.3, 4.0), 0.3), ((0.1, 0.1, 4.0), 4.0), ((0.1,), None)],
)
def test_a_drift_by_time_is_one_by_distance_at_the_usual_speed(speeds_mps, usual_mps):
    rows = {"time_s": np.arange(90.0), "step_m": np.resize(speeds_mps, 90), "heading_rad": 0.0}
    given = make_log(CRS, motion=pd.DataFrame(rows), imu=ImuNoise(drift_deg_per_sqrt_s=0.4))
    expected = 0.3 if usual_mps is None else 0.4 / usual_mps**0.5
    found, _ = fitted_to_log(BayesFilter(), given)
    assert found.drift_deg_per_sqrt_m == pytest.approx(expected)
    # Two rows of one time have no speed.
    rows["time_s"] = np.repeat(np.arange(45.0), 2)
    twice = make_log(CRS, motion=pd.DataFrame(rows), imu=ImuNoise(drift_deg_per_sqrt_s=0.4))
    assert np.isfinite(fitted_to_log(BayesFilter(), twice)[0].drift_deg_per_sqrt_m)
    assert fitted_to_log(BayesFilter(), twice)[0].drift_deg_per_sqrt_m > 0.15


def test_fine_steps_of_levels_count_too():
    fitted, _ = fitted_to_log(BayesFilter(), log(level_step_db=0.6))
    assert fitted.level_error_db == pytest.approx((8.7**2 + 0.36 / 12) ** 0.5)


def test_rows_of_more_than_fifteen_metres_are_no_steps():
    fitted, _ = fitted_to_log(BayesFilter(), rows_of(16.0, 10.0))
    assert fitted.step_sd_m == pytest.approx(9.0 * (1.4 / 16.0) ** 0.5)
    assert fitted_to_log(BayesFilter(), rows_of(14.9, 10.0))[0].step_sd_m == 9.0


@pytest.mark.parametrize(
    ("cells", "step_m", "alone"), [(("A",), 1.4, True), ((), 1.4, False), (("A",), np.nan, False)]
)
def test_streets_alone_start_the_filter_where_a_log_of_a_radio_map_has_but_motion(
    cells, step_m, alone
):
    given, database = headed_rows(step_m), SimpleNamespace(cell_ids=cells)
    assert by_streets_alone(BayesFilter(), given, database) is alone
    assert not by_streets_alone(GridFilter(), given, database)
    fix = pd.DataFrame({"time_s": [1.0], "east_m": [0.0], "north_m": [0.0]})
    # Positions tell as much over roads alone; cells and their times need the map's.
    assert by_streets_alone(BayesFilter(), replace(given, gnss=fix), database) is alone
    assert not by_streets_alone(BayesFilter(), replace(given, radio=log().radio), database)


def headed_rows(step_m):
    return make_log(
        CRS,
        motion=pd.DataFrame({"time_s": np.arange(60.0), "step_m": step_m, "heading_rad": 0.3}),
    )


@pytest.mark.parametrize(
    ("step_m", "mistake"),
    [(4.4, "lengths in feet"), (0.41, "metres taken for feet"), (14.0, "of a walker;")],
)
def test_steps_with_headings_whose_speed_is_no_walkers_are_noted(step_m, mistake):
    options, notes = fitted_to_log(BayesFilter(), headed_rows(step_m))
    assert options == BayesFilter()
    (note,) = notes
    assert note.startswith(f"motion: steps of {step_m:.1f} m/s, expected 0.6 to 2.6 m/s")
    assert mistake in note
    assert note.endswith("if a vehicle moved, set filter.bayes.vehicle = true")


def test_speeds_of_walkers_and_of_stated_vehicles_are_not_noted():
    assert fitted_to_log(BayesFilter(), headed_rows(1.3))[1] == ()
    assert fitted_to_log(BayesFilter(vehicle=True), headed_rows(4.4))[1] == ()
    driven = replace(headed_rows(4.4), vehicle=True)
    assert "a vehicle's, as the log states it" in fitted_to_log(BayesFilter(), driven)[1][0]
    # Who has measured the errors of steps knows their unit.
    measured = replace(headed_rows(4.4), imu=ImuNoise(sigma_trans_m=0.3))
    assert not any("m/s" in note for note in fitted_to_log(BayesFilter(), measured)[1])
    # Rests count neither way.
    rows = headed_rows(1.3).motion
    rows.loc[rows.index % 5 > 0, "step_m"] = 0.0
    assert fitted_to_log(BayesFilter(), make_log(CRS, motion=rows))[1] == ()
