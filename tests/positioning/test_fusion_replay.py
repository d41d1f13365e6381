"""Replaying logs by Kalman-type filters: identities, antennas, sums, hindsight, failures."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.filters.contract import Reason
from mapfilter.filters.gaussian import EKF, UKF, Method, SigmaPoints
from mapfilter.filters.kalman import smooth
from mapfilter.filters.trials import run_trials
from mapfilter.models.motion import constant_velocity
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import MOVING, POSITION
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels, compiled
from mapfilter.positioning.loop import locate
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.log import make_log

CRS = "EPSG:32629"
EAST, NORTH = 500_000.0, 4_600_000.0
ANGLES = np.radians(15 + 60 * np.arange(6))
PLACES = [(0.0, 0.0), *((1200 * np.cos(a), 1200 * np.sin(a)) for a in ANGLES)]


def cell(name, place, **more):
    given = {"height_m": 30.0, "azimuth_deg": None, "eirp_dbm": 55.0, "frequency_mhz": 1800.0}
    given["antenna"] = "sector" if "azimuth_deg" in more else "omni"
    return Cell(name, name, EAST + place[0], NORTH + place[1], **(given | more))


PLAN = CellPlan(
    CRS,
    tuple(
        cell(f"{i}-{s}", place, azimuth_deg=20.0 * i + 120 * s, arfcn=600 + 3 * i + s, bsic=10 + i)
        for i, place in enumerate(PLACES)
        for s in range(3)
    ),
)


def drive(seed, *, steps=120, speed=1.5, named=True, plan=PLAN, offset_db=0.0, own_db=0.0):
    """A walk among seven sites of three sectors: timing advance, levels with lasting errors.

    ``offset_db`` is the deviation of an error of all levels, ``own_db`` that of each cell's.
    """
    rng = np.random.default_rng(seed)
    heading = rng.uniform(-np.pi, np.pi) + np.cumsum(rng.normal(0, 0.02, steps))
    ways = speed * np.column_stack([np.cos(heading), np.sin(heading)])
    truth = np.array([EAST, NORTH]) + rng.uniform(-900, 900, 2) + np.cumsum(ways, axis=0)
    model = SiteModels(plan, KalmanOptions()).of(POSITION, plan.ids, ())
    lasting, error = np.exp(-speed / 50), rng.normal(0, 7, model.size)
    rows, serving = [], None
    stay = rng.normal(0, offset_db) + rng.normal(0, own_db, model.size) if own_db else 0.0
    for k, expected in enumerate(model.mean(truth)):
        error = lasting * error + np.sqrt(1 - lasting**2) * rng.normal(0, 7, model.size)
        level = expected + error + stay
        best = int(np.argmax(level))
        if serving is None or level[best] > level[serving] + 4:
            serving = best
        others = [i for i in np.argsort(-level) if i != serving][:6]
        for i in [serving, *others]:
            own = plan.cells[i]
            away = np.hypot(truth[k, 0] - own.east_m, truth[k, 1] - own.north_m)
            rows.append({
                "time_s": k + 1.0, "role": "serving" if i == serving else "neighbour",
                "cell": own.id if i == serving or named else None, "arfcn": own.arfcn,
                "bsic": own.bsic, "level_dbm": float(round(level[i])),
                "timing_advance": int(away / 553.5) if i == serving else None,
            })  # fmt: skip
    radio = pd.DataFrame(rows).astype({"timing_advance": "Int64"})
    motion = pd.DataFrame({
        "time_s": np.arange(1.0, steps + 1), "step_m": speed + rng.normal(0, 0.1, steps),
        "heading_rad": heading + rng.normal(0, 0.1, steps),
    })  # fmt: skip
    return make_log(CRS, radio=radio, motion=motion), truth


def located(log, method=EKF, plan=PLAN, **more):
    antennas = more.pop("antennas", None)
    bound = KalmanFilter(method=method.name, **more).over_sites(plan, antennas)
    return locate(log, bound, np.random.default_rng(0)).estimate


def unheard(estimate):
    return [reading for reading in estimate.unused if reading.kind == "neighbour"]


def errors_m(estimate, truth):
    return np.hypot(estimate.east_m - truth[:, 0], estimate.north_m - truth[:, 1])


def test_neighbours_are_told_by_carrier_and_bsic():
    named, unnamed = (located(drive(3, steps=20, named=flag)[0]) for flag in (True, False))
    np.testing.assert_array_equal(named.east_m, unnamed.east_m)
    assert not unheard(unnamed)


def test_two_cells_of_one_carrier_and_bsic_are_ambiguous_unless_one_is_far_away():
    log, _ = drive(3, steps=5, named=False)
    twin = {"arfcn": log.radio["arfcn"][1], "bsic": log.radio["bsic"][1]}
    near = CellPlan(CRS, (*PLAN.cells, cell("near", (3000.0, 0.0), **twin)))
    found = unheard(located(log, plan=near))
    assert found
    assert {reading.reason for reading in found} == {Reason.AMBIGUOUS_CELL}
    assert found[0].what == f"ARFCN {twin['arfcn']}, BSIC {twin['bsic']}"
    far = CellPlan(CRS, (*PLAN.cells, cell("far", (90_000.0, 0.0), **twin)))
    assert not unheard(located(log, plan=far))
    nobody = log.radio.assign(bsic=63)
    reasons = unheard(located(make_log(CRS, radio=nobody)))
    assert {reading.reason for reading in reasons} == {Reason.UNKNOWN_CELL}


def test_measured_antennas_are_those_of_their_files():
    angle = np.arange(360.0)
    loss = 12 * (1 - np.cos(np.radians(angle)))
    vertical = np.array([0.0, 10.0, 170.0, 190.0, 350.0]), np.array([0.0, 0.0, 24.0, 24.0, 0.0])
    antenna = MeasuredAntenna("made", angle, loss, *vertical)
    plan = CellPlan(CRS, (cell("A", (0, 0), azimuth_deg=90.0, antenna="made"),))
    with pytest.raises(InputError, match=r"cell 'A', antenna.*no folder of antennas"):
        SiteModels(plan, KalmanOptions())
    sites = SiteModels(plan, KalmanOptions(), {"made": antenna})
    round_about = SiteModels(
        CellPlan(CRS, (cell("A", (0, 0), azimuth_deg=90.0, antenna="omni"),)), KalmanOptions()
    )
    for bearing in (0.0, 40.0, 150.0, 280.0):
        way = np.radians(90.0 - bearing) + sites.convergence_rad
        at = np.array([EAST + 800 * np.cos(way), NORTH + 800 * np.sin(way)])
        less = sites.of(POSITION, ("A",), ()).mean(at) - round_about.of(POSITION, ("A",), ()).mean(
            at
        )
        assert less[0] == pytest.approx(-12 * (1 - np.cos(np.radians(bearing - 90))), abs=0.05)


def test_a_belief_holds_both_places_that_readings_allow():
    """Two sites on a line: what is left of it looks like what is right."""
    plan = CellPlan(CRS, (cell("A", (0, 0)), cell("B", (900, 0))))
    sites = SiteModels(plan, KalmanOptions())
    truth = np.array([EAST + 300, NORTH + 900])
    model = sites.of(POSITION, ("A", "B"), ())
    levels = model.mean(truth)
    rows = [
        {"time_s": 1.0, "role": role, "cell": name, "level_dbm": level, "timing_advance": steps}
        for role, name, level, steps in zip(
            ("serving", "neighbour"), "AB", levels, (1, None), strict=True
        )
    ]
    radio = pd.DataFrame(rows).astype({"timing_advance": "Int64"})
    found = located(make_log(CRS, radio=radio), plan=plan)
    assert found.hypotheses[0] > 2
    # Between the two, and as unsure as they are apart.
    assert abs(found.north_m[0] - NORTH) < 1.0
    assert found.covariance_m2[0, 1, 1] > 500**2
    assert found.radii_m[0, 2] > 900


def test_starts_by_levels_find_the_place_and_say_how_sure_they_are():
    """A single Gaussian is 300 to 400 m off and has the place in its 95 % at a tenth of them."""
    inside, errors = [], []
    for seed in range(6):
        log, truth = drive(seed)
        found = located(log)
        error = errors_m(found, truth)
        errors.append(error[60:].mean())
        inside.append((error <= found.radii_m[:, 2])[60:].mean())
    assert np.mean(errors) < 200
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("method", [EKF, UKF], ids=lambda one: one.name)
def test_radii_hold_where_the_formula_of_a_cell_stays_wrong(method):
    """Its antenna and surroundings are the same at each report: many of them tell it no better."""
    inside = []
    for seed in range(3):
        log, truth = drive(seed, steps=300, offset_db=10.0, own_db=9.0)
        radio = log.radio.assign(timing_advance=pd.array([None] * len(log.radio), "Int64"))
        found = located(make_log(CRS, radio=radio, motion=log.motion), method)
        inside.append((errors_m(found, truth) <= found.radii_m[:, 2])[100:].mean())
    assert np.mean(inside) > 0.8


def test_a_sum_of_one_is_its_filter_and_news_are_its_news():
    belief = SumBelief.start(np.zeros(4), np.diag([100.0, 4.0, 100.0, 4.0]))
    motion, model = constant_velocity(1.0, 0.3), position_fix(MOVING, np.eye(2) * 9)
    readings = np.random.default_rng(1).normal(0, 5, (1, 6, 2))
    run = run_trials(
        compiled(model), motion.transition, motion.noise, UKF, np.zeros(4),
        belief.covariances[0], readings, covariances=True,
    )  # fmt: skip
    for k in range(6):
        belief = belief.predict(motion.transition, motion.noise)
        belief, news = belief.update(compiled(model), readings[0, k], UKF)
        np.testing.assert_allclose(belief.moments.mean, run.means[0, k], atol=1e-10)
        np.testing.assert_allclose(belief.moments.covariance, run.covariances[0, k], atol=1e-10)
        assert news.evidence == pytest.approx(run.evidence[0, k])
        assert news.nis == pytest.approx(run.nis[0, k])


def test_parts_keep_weight_and_fall_together():
    belief = SumBelief.start(np.zeros(2), np.eye(2) * 1e6, {0: 7, 1: 7})
    model = position_fix(POSITION, np.eye(2) * 100.0)
    assert belief.weights.size == 49
    for _ in range(3):
        belief, news = belief.update(compiled(model), [30.0, -40.0], EKF)
        assert news.used
        assert belief.weights.sum() == pytest.approx(1.0)
    assert belief.weights.size < 5
    np.testing.assert_allclose(belief.moments.mean, [30.0, -40.0], atol=0.1)
    np.testing.assert_allclose(belief.moments.covariance, np.eye(2) * 100 / 3, atol=1.0)


def fixes(seed=0, steps=40):
    rng = np.random.default_rng(seed)
    time_s = np.arange(1.0, steps + 1)
    truth = np.array([EAST, NORTH]) + np.outer(time_s, [3.0, 1.0])
    seen = truth + rng.normal(0, 20, truth.shape)
    gnss = pd.DataFrame({
        "time_s": time_s, "east_m": seen[:, 0], "north_m": seen[:, 1], "var_east_m2": 400.0,
        "var_north_m2": 400.0, "cov_east_north_m2": 0.0,
    })  # fmt: skip
    motion = pd.DataFrame({"time_s": time_s, "step_m": np.hypot(3, 1), "heading_rad": 0.3217506})
    return gnss, motion, truth


def test_hindsight_is_the_smoother_of_the_filter():
    gnss, _, truth = fixes()
    log = make_log(CRS, gnss=gnss)
    plain = located(log, fix_lasting_share=0.0)
    later = located(log, smooth=True, fix_lasting_share=0.0)
    options = KalmanOptions()
    motion = constant_velocity(1.0, options.acceleration_mps_per_sqrt_s, noise="continuous")
    start = [options.start_sd_m, options.speed_sd_mps] * 2
    shifted = gnss[["east_m", "north_m"]].to_numpy() - [EAST, NORTH]
    mean = np.array([shifted[0, 0], 0.0, shifted[0, 1], 0.0])
    model = compiled(position_fix(MOVING, np.eye(2) * 400.0))
    still = run_trials(
        model, np.eye(4), np.zeros((4, 4)), EKF, mean, np.diag(start) ** 2, shifted[None, :1],
        covariances=True,
    )  # fmt: skip
    rest = run_trials(
        model, motion.transition, motion.noise, EKF, still.means[0, 0], still.covariances[0, 0],
        shifted[None, 1:], covariances=True,
    )  # fmt: skip
    means = np.concatenate([still.means, rest.means], axis=1)
    covariances = np.concatenate([still.covariances, rest.covariances], axis=1)
    told = smooth(motion.transition, motion.noise, means, covariances)
    np.testing.assert_allclose(later.east_m - EAST, told.means[0, :, 0], atol=1e-4)
    np.testing.assert_allclose(
        later.covariance_m2[:, 1, 1], told.covariances[0, :, 2, 2], rtol=1e-5
    )
    assert later.east_m[-1] == pytest.approx(plain.east_m[-1], abs=1e-6)
    assert errors_m(later, truth).mean() < 0.8 * errors_m(plain, truth).mean()


def test_hindsight_follows_dead_reckoning():
    gnss, motion, truth = fixes()
    log = make_log(CRS, gnss=gnss, motion=motion)
    plain = located(log, fix_lasting_share=0.0)
    later = located(log, smooth=True, fix_lasting_share=0.0)
    assert errors_m(later, truth).mean() < 0.7 * errors_m(plain, truth).mean()
    log, truth = drive(1, steps=60)
    plain, later = located(log), located(log, smooth=True)
    assert np.isfinite(errors_m(later, truth)).all()
    assert later.radii_m[:30, 2].mean() < plain.radii_m[:30, 2].mean()
    assert later.east_m[-1] == pytest.approx(plain.east_m[-1], abs=1.0)


def test_hindsight_of_nothing_is_nothing():
    log, truth = drive(1, steps=5)
    nobody = make_log(CRS, radio=log.radio.assign(cell="Z"))
    assert np.isnan(errors_m(located(nobody, smooth=True), truth)).all()


def test_a_reading_that_cannot_be_taken_in_is_labelled():
    """β far below 0 makes the covariance of the readings indefinite."""
    log, truth = drive(2, steps=5)
    wild = Method("wild", SigmaPoints(1.0, -1e9, 0.0))
    bound = replace(KalmanFilter().over_sites(PLAN), method=wild)
    found = locate(log, bound, np.random.default_rng(0)).estimate
    assert {str(reason) for reason in found.reason} == {"update_failed"}
    assert np.isfinite(errors_m(found, truth)).all()


def test_a_phone_on_a_site_stays_finite():
    gnss, _, _ = fixes(steps=3)
    log, _ = drive(2, steps=30)
    on_it = replace(
        log, gnss=make_log(CRS, gnss=gnss.assign(east_m=EAST, north_m=NORTH, var_east_m2=1e-6,
                                                 var_north_m2=1e-6)).gnss,
    )  # fmt: skip
    found = located(on_it)
    assert np.isfinite(found.east_m).all()
    assert np.isfinite(found.covariance_m2).all()


def test_protection_levels_are_beyond_the_radii_and_hold():
    rare, exceeded, epochs = [], 0, 0
    for seed in range(4):
        log, truth = drive(seed, steps=120)
        found = located(log)
        known = np.isfinite(found.radii_m[:, 2])
        assert (found.radius_99_m[known] >= found.radii_m[known, 2]).all()
        assert (found.protection_m[known] > found.radius_99_m[known]).all()
        rare.append(found.protection_m[known][-1])
        exceeded += int((errors_m(found, truth)[known] > found.protection_m[known]).sum())
        epochs += int(known.sum())
    assert epochs > 400
    assert exceeded <= 0.02 * epochs
    wide = locate(
        drive(3, steps=120)[0],
        KalmanFilter().over_sites(PLAN),
        np.random.default_rng(0),
        risk=1e-7,
    ).estimate
    assert wide.protection_m[-1] > 1.3 * rare[-1]
