"""What a phone and its unit report on the walks of the benchmark.

Intervals are four standard errors.
"""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from grid_town import levels, streets

from mapfilter.experiments.benchmarks.cases import CASES, USUAL
from mapfilter.experiments.benchmarks.journeys import displaced_walk, log_of, walk
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.simulate import SimulationSettings
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.imu_noise import ImuNoise

SEED = 11
SHORT = JourneyPlan(length_m=280.0)
QUIET = ReportModel(averaging_s=0.0, hysteresis_db=0.0, fading_db=0.0, quantise=False)
PERFECT = ImuNoise(sigma_trans_m=0.0, sigma_orient_deg=0.0)
FIXED = frozenset({"imu.sigma_orient_deg"})
ERRORLESS = frozenset(
    f"imu.{name}" for name in ("sigma_orient_deg", "bias_sd_deg", "drift_deg_per_sqrt_s", "scale")
)


@pytest.fixture(scope="module")
def town():
    return streets()


@pytest.fixture(scope="module")
def short_walks(town):
    return [walk(town, JourneyPlan(length_m=140.0), SEED, number) for number in range(60)]


def made(town, name, number=0, *, walked=None, fixed=frozenset(), **settings):
    """Return truth and log of a case on a walk of 200 s."""
    walked = walked or walk(town, SHORT, SEED, number)
    given = SimulationSettings(**settings)
    return walked, log_of(CASES[name], walked, levels, town, given, SEED, number, fixed)


@pytest.mark.parametrize("make", [walk, displaced_walk])
def test_walkers_keep_out_of_the_towns_buildings(town, make):
    """Where everything is built over, they stay on the centre lines."""
    e, n = town.network.east_m, town.network.north_m
    lines = shapely.union_all(
        [
            shapely.LineString([(e[a], n[a]), (e[b], n[b])])
            for a, b in zip(town.network.node_a, town.network.node_b, strict=True)
        ]
    )
    beside = replace(SHORT, walker=WalkerModel(8.0))

    def away_m(streets):
        truth = make(streets, beside, SEED, 0).truth
        places = shapely.points(truth["east_m"], truth["north_m"])
        return np.median(shapely.distance(places, lines))

    assert away_m(town) > 5.0
    assert away_m(replace(town, heights_m=np.ones((150, 150), np.float32))) < 0.1


def chords(walked):
    east, north = walked.truth["east_m"].to_numpy(), walked.truth["north_m"].to_numpy()
    return np.hypot(np.diff(east), np.diff(north)), np.arctan2(np.diff(north), np.diff(east))


def wrapped(angle):
    return np.angle(np.exp(1j * angle))


def test_a_walk_is_as_long_as_planned_and_routes_differ(town):
    walks = [walk(town, SHORT, SEED, number) for number in range(3)]
    for walked in walks:
        assert len(walked.truth) == 201
        assert walked.displaced_at_s == np.inf
    starts = {(w.truth["east_m"][0], w.truth["north_m"][0]) for w in walks}
    starts.add(tuple(walk(town, SHORT, SEED + 1, 0).truth[["east_m", "north_m"]].iloc[0]))
    assert len(starts) == 4
    assert walk(town, SHORT, SEED, 0).truth.equals(walks[0].truth)


@pytest.mark.parametrize("name", USUAL)
def test_dead_reckoning_is_noisy_in_every_case_by_its_size(town, name):
    """Steps by 0.2 m; headings by the case's noise, about the journey's own lasting error."""
    make = displaced_walk if CASES[name].recovery_within_m > 0 else walk
    walked = make(town, SHORT, SEED, 0)
    _, log = made(town, name, walked=walked)
    step_m, heading = chords(walked)
    carried = np.arange(step_m.size) == np.searchsorted(
        walked.truth["time_s"], walked.displaced_at_s
    )
    count = step_m.size
    scale = log.motion["step_m"][~carried].sum() / step_m[~carried].sum()
    error_m = (log.motion["step_m"] - scale * step_m)[~carried]
    assert abs(error_m.std() / 0.2 - 1) < 4 / np.sqrt(2 * count)
    sigma = np.radians(int(name.split("-")[1]) if name.split("-")[1].isdigit() else 6)
    if not CASES[name].compass:
        assert log.motion["heading_rad"].isna().all()
        turn = wrapped(log.motion["turn_rad"].to_numpy() - np.diff(heading, prepend=np.nan))[1:]
        assert abs(turn.std() / (np.sqrt(2) * sigma) - 1) < 4 / np.sqrt(count)
        return
    change = np.diff(wrapped(log.motion["heading_rad"] - heading)[~carried])
    # The drift of at most 0.4° a second is far below the noise.
    assert abs(wrapped(change).std() / (np.sqrt(2) * sigma) - 1) < 4 / np.sqrt(count)


@pytest.mark.parametrize(
    ("name", "bias_sd_deg", "scale", "drift_deg"),
    [
        ("levels-6", 0.0, 0.0, 0.0),
        ("levels-bias10", 10.0, 0.05, 0.2),
        ("smooth-bias10", 10.0, 0.05, 0.2),
        ("cell-bias10", 10.0, 0.05, 0.2),
        ("levels-bias20", 20.0, 0.1, 0.4),
    ],
)
def test_lasting_errors_are_those_of_the_case(
    town, short_walks, name, bias_sd_deg, scale, drift_deg
):
    biases, scales, count = [], [], len(short_walks)
    for number, walked in enumerate(short_walks):
        _, log = made(
            town, name, number, walked=walked, imu=PERFECT, fixed=FIXED,
            reports=replace(QUIET, report_period_s=100.0),
        )  # fmt: skip
        step_m, heading = chords(walked)
        biases.append(wrapped(log.motion["heading_rad"].to_numpy() - heading)[[0, 99]])
        scales.append(np.log(log.motion["step_m"].sum() / step_m.sum()))
    off = 4 / np.sqrt(2 * count)
    first, drift = np.degrees(np.array(biases)[:, 0]), np.degrees(np.ptp(biases, axis=1))
    assert abs(first.std() - np.hypot(bias_sd_deg, drift_deg)) <= off * bias_sd_deg + 1e-9
    assert abs(np.sqrt(np.mean(drift**2)) - drift_deg * np.sqrt(99)) <= off * 10 * drift_deg + 1e-9
    assert abs(np.std(scales) - scale) <= off * scale + 1e-9


@pytest.mark.parametrize("name", [name for name in USUAL if not CASES[name].levels])
def test_cells_alone_have_neither_levels_nor_neighbours(town, name):
    _, log = made(town, name)
    assert set(log.radio["role"]) == {"serving"}
    assert log.radio["level_dbm"].isna().all()
    assert not log.radio["censored"].any()
    assert len(log.radio) == 201
    _, whole = made(town, "levels-6")
    serving = whole.radio[whole.radio["role"] == "serving"]
    assert log.radio["cell"].tolist() == serving["cell"].tolist()


@pytest.mark.parametrize("name", [name for name in USUAL if CASES[name].levels])
def test_all_other_cases_have_levels_and_neighbours(town, name):
    _, log = made(town, name)
    assert log.radio["level_dbm"].notna().all()
    assert (log.radio["role"] == "neighbour").sum() > 3 * 201
    assert log.radio.equals(made(town, "levels-6")[1].radio)


def test_only_the_case_without_a_compass_has_no_headings(town):
    for name in USUAL:
        _, log = made(town, name)
        assert log.motion["heading_rad"].isna().all() == (name == "levels-nocompass"), name
        assert log.motion["turn_rad"][1:].notna().all()
        assert log.motion["step_m"].notna().all()


def test_cases_of_one_noise_have_the_same_noise(town):
    same = [made(town, name)[1].motion for name in ("levels-6", "cell-6", "levels-missing10")]
    assert same[0].equals(same[1])
    assert same[0].equals(same[2])
    assert not same[0].equals(made(town, "levels-10")[1].motion)
    assert not same[0]["step_m"].equals(made(town, "levels-6", 1)[1].motion["step_m"])


def test_reports_have_the_worlds_fading_and_offset(town):
    def errors_db(number, **model):
        """Levels of serving cells less the true ones, in reports whose neighbours tell nothing."""
        settings = replace(QUIET, **model)
        walked, log = made(town, "levels-6", number, reports=settings)
        serving = log.radio[log.radio["role"] == "serving"]
        at = serving["time_s"].to_numpy()
        east, north = (
            np.interp(at, walked.truth["time_s"], walked.truth[n]) for n in ("east_m", "north_m")
        )
        cell = [int(name[1:]) for name in serving["cell"]]
        return serving["level_dbm"].to_numpy() - levels(east, north)[np.arange(at.size), cell]

    np.testing.assert_allclose(errors_db(0), 0.0, atol=1e-9)
    # One cell serves throughout: no choice of the strongest among noisy ones.
    fading = errors_db(0, fading_db=3.5, hysteresis_db=500.0)
    assert abs(fading.std() / 3.5 - 1) < 4 / np.sqrt(2 * 201)
    offsets = np.array([errors_db(n, phone_offset_sd_db=4.0) for n in range(40)])
    np.testing.assert_allclose(np.ptp(offsets, axis=1), 0.0, atol=1e-9)
    assert abs(offsets[:, 0].std() / 4.0 - 1) < 4 / np.sqrt(2 * 40)


def test_handover_waits_for_the_worlds_hysteresis(town):
    walked = walk(town, JourneyPlan(), SEED, 0)
    level = levels(walked.truth["east_m"].to_numpy(), walked.truth["north_m"].to_numpy())

    def below_best_db(hysteresis_db):
        model = replace(QUIET, hysteresis_db=hysteresis_db)
        _, log = made(town, "levels-6", walked=walked, reports=model)
        cells = log.radio.loc[log.radio["role"] == "serving", "cell"]
        served = level[np.arange(len(level)), [int(cell[1:]) for cell in cells]]
        return level.max(axis=1) - served

    assert not below_best_db(0.0).any()
    assert 3.0 < below_best_db(4.0).max() <= 4.0
    assert 6.5 < below_best_db(8.0).max() <= 8.0


def test_errors_that_were_set_hold_in_all_cases(town):
    errors = replace(PERFECT, sigma_orient_deg=2.0)
    for name in ("levels-3", "levels-20", "levels-bias10"):
        _, log = made(town, name, imu=errors, fixed=ERRORLESS)
        assert log.motion.equals(made(town, "levels-6", imu=errors, fixed=ERRORLESS)[1].motion)
    # Only the heading's noise was set: the lasting error is still the case's.
    walked, log = made(town, "levels-bias20", imu=errors, fixed=FIXED)
    error = wrapped(log.motion["heading_rad"].to_numpy() - chords(walked)[1])
    assert np.degrees(abs(error.mean())) > 1.0


@pytest.mark.parametrize("period_s", [0.5, 1.0, 2.0])
def test_the_units_period_is_the_worlds(town, period_s):
    walked, log = made(town, "levels-6", imu=replace(PERFECT, period_s=period_s), fixed=ERRORLESS)
    time_s = log.motion["time_s"].to_numpy()
    np.testing.assert_allclose(time_s, period_s * np.arange(1, round(200 / period_s) + 1))
    start = walked.truth[["east_m", "north_m"]].iloc[0]
    east, north = dead_reckon(*start, log.motion["step_m"], log.motion["heading_rad"])
    np.testing.assert_allclose(
        east, np.interp(time_s, walked.truth["time_s"], walked.truth["east_m"])
    )
    assert abs(north[-1] - walked.truth["north_m"].iloc[-1]) < 1e-6
