"""The simulated ground truth: how far from its prediction, and over which distances alike.

Intervals are four standard errors, from the scatter of independently drawn fields.
"""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice
from mapfilter.propagation import predict as module
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict, simulate_ground_truth
from mapfilter.radio.cells import Cell, CellPlan

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 120, 120)
EAST, NORTH = 385300.0, 6672700.0
PLAN = CellPlan(
    CRS,
    tuple(
        Cell(f"{site}{i}", site, EAST, NORTH, 30.0, None, 50.0, 1800.0, "omni")
        for site in "AB"
        for i in range(2)
    ),
)
ONE = CellPlan(CRS, PLAN.cells[:1])
MODEL = PredictionModel(model="cost231_hata")
CLUTTERED = replace(MODEL, shadowing_db=6.0)
NONE = GroundTruthErrors(
    level_error_db=0.0, eirp_error_db=0.0, azimuth_error_deg=0.0, slope_error=0.0
)
SEEDS = range(30)


def levels(made):
    return np.array([level for _, level in made], dtype=np.float64)


def predicted(model=MODEL, plan=PLAN, heights=None, lattice=LATTICE):
    return levels(predict(plan, lattice, heights, model))


def real(errors, model=MODEL, plan=PLAN, heights=None, lattice=LATTICE):
    return levels(simulate_ground_truth(plan, lattice, heights, model, errors))


def drawn(errors, model=MODEL, plan=ONE):
    """Ground truths less the prediction's mean levels, (seeds, cells, rows, cols)."""
    mean = predicted(replace(model, shadowing_db=0.0), plan)
    return np.array([real(replace(errors, seed=s), model, plan) - mean for s in SEEDS])


def assert_mean(samples, expected, at_most):
    off = 4 * samples.std(ddof=1) / np.sqrt(samples.size)
    assert abs(samples.mean() - expected) < off, (samples.mean(), expected, off)
    assert off < at_most


def test_without_errors_it_is_the_prediction():
    np.testing.assert_array_equal(real(NONE), predicted())


def test_the_whole_error_is_what_its_parts_imply():
    """Uniform draws within ± a have the variance a² / 3; the slope counts by the decades."""
    errors = GroundTruthErrors(
        level_error_db=7.0, eirp_error_db=6.0, slope_error=0.2, azimuth_error_deg=5.0
    )
    difference = drawn(errors)[:, 0]
    rows, cols = np.indices((120, 120))
    distance_m = np.hypot(
        385000.0 + 5.0 * (cols + 0.5) - EAST, 6673000.0 - 5.0 * (rows + 0.5) - NORTH
    )
    slope_db = (44.9 - 6.55 * np.log10(30.0)) * np.log10(np.maximum(distance_m, 20.0) / 100.0)
    expected = 49.0 + 36.0 / 3 + 0.04 / 3 * np.mean(slope_db**2)
    assert_mean((difference**2).mean(axis=(1, 2)), expected, 25.0)
    assert expected > 60.0


@pytest.mark.parametrize(("share", "local_m"), [(0.0, 10.0), (0.5, 10.0), (1.0, 10.0), (0.5, 40.0)])
def test_shadowing_has_its_deviation_however_it_is_shared_between_lengths(share, local_m):
    """Its parts are independent: even of one length, their variances add up."""
    errors = replace(
        NONE, level_error_db=7.0, correlation_m=40.0, local_share=share, local_correlation_m=local_m
    )
    assert_mean((drawn(errors) ** 2).mean(axis=(1, 2, 3)), 49.0, 15.0)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_shadowing_is_correlated_over_both_its_lengths(share):
    errors = replace(
        NONE, level_error_db=7.0, correlation_m=100.0, local_share=share, local_correlation_m=15.0
    )
    field = drawn(errors)[:, 0] / 7.0
    for distance_m in (15, 50, 100):
        step = distance_m // 5
        # Half the mean square of the differences, which no offset of the field changes.
        along = 0.5 * (field[:, step:] - field[:, :-step]) ** 2
        across = 0.5 * (field[..., step:] - field[..., :-step]) ** 2
        samples = (along.mean(axis=(1, 2)) + across.mean(axis=(1, 2))) / 2
        kept = (1 - share) * np.exp(-distance_m / 100) + share * np.exp(-distance_m / 15)
        assert_mean(samples, 1 - kept, 0.2)


def test_sectors_of_a_site_share_part_of_both_shadowings():
    errors = replace(NONE, level_error_db=7.0, correlation_m=40.0, site_share=0.5)
    for changed in (errors, replace(errors, local_share=1.0, local_correlation_m=10.0)):
        field = drawn(changed, plan=PLAN) / 7.0
        assert_mean((field[:, 0] * field[:, 1]).mean(axis=(1, 2)), 0.5, 0.25)
        assert_mean((field[:, 0] * field[:, 2]).mean(axis=(1, 2)), 0.0, 0.25)


def test_clutter_of_its_own_is_as_large_as_the_predictions_and_another():
    """With the prediction's seed, too."""
    clutter, own = [], []
    for seed in SEEDS:
        model = replace(CLUTTERED, seed=seed)
        clutter.append(predicted(model, ONE) - predicted(plan=ONE))
        own.append(real(replace(NONE, seed=seed), model, ONE) - predicted(plan=ONE))
    one, other = np.array(clutter), np.array(own)
    assert_mean((other**2).mean(axis=(1, 2, 3)), 36.0, 12.0)
    assert_mean((one * other).mean(axis=(1, 2, 3)), 0.0, 6.0)
    # To the filter, the prediction's clutter is one more error.
    assert_mean(((other - one) ** 2).mean(axis=(1, 2, 3)), 72.0, 20.0)


def test_clutter_of_its_own_is_drawn_by_its_own_seed_and_beside_the_shadowing():
    model = replace(CLUTTERED, seed=3)
    first, again, another = (real(replace(NONE, seed=s), model, ONE) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - another).mean() > 1.0
    other_prediction = real(replace(NONE, seed=1), replace(model, seed=4), ONE)
    np.testing.assert_array_equal(first, other_prediction)
    both = replace(NONE, level_error_db=8.0)
    assert_mean((drawn(both, model) ** 2).mean(axis=(1, 2, 3)), 36.0 + 64.0, 30.0)


def test_shared_clutter_is_the_predictions():
    errors = replace(NONE, clutter="shared", seed=5)
    np.testing.assert_allclose(real(errors, CLUTTERED), predicted(CLUTTERED), atol=1e-4)
    with pytest.raises(ConfigError, match="expected 'own' or 'shared', found 'none'"):
        GroundTruthErrors(clutter="none")  # type: ignore[arg-type]


def test_every_part_is_drawn_by_the_seed():
    heights = np.zeros((120, 120), dtype=np.float32)
    heights[20:40, 20:100] = 25.0
    parts = [
        replace(NONE, level_error_db=7.0),
        replace(NONE, level_error_db=7.0, local_share=1.0),
        replace(NONE, eirp_error_db=2.0),
        replace(NONE, slope_error=0.1),
        replace(NONE, roof_error=0.2),
    ]
    walfisch = PredictionModel()
    for errors in parts:
        first, again, other = (
            real(replace(errors, seed=s), walfisch, heights=heights) for s in (1, 1, 2)
        )
        np.testing.assert_array_equal(first, again)
        assert np.abs(first - other).max() > 0.1, errors
        assert np.abs(first - predicted(walfisch, heights=heights)).max() > 0.1, errors


@pytest.mark.parametrize(
    "changed",
    [
        {"model": "tr38901_uma"},
        {"street_width_m": 12.0},
        {"building_separation_m": 70.0},
        {"default_roof_height_m": 20.0},
    ],
)
def test_the_ground_truth_follows_a_model_of_its_own(changed):
    walfisch = PredictionModel()
    found = real(replace(NONE, **changed), walfisch)
    np.testing.assert_allclose(found, predicted(replace(walfisch, **changed)), atol=1e-4)
    assert np.abs(found - predicted(walfisch)).max() > 0.5


def test_an_offset_is_added_to_all_levels():
    np.testing.assert_allclose(real(replace(NONE, offset_db=5.0)), predicted() + 5.0, atol=1e-4)


def test_roofs_are_off_by_a_factor_that_neighbours_share(monkeypatch):
    heights = np.full((120, 120), 20.0, dtype=np.float32)
    heights[:, 60:] = 0.0
    seen = []
    original = module.Surroundings.of

    def record(lattice, heights_m, model, antennas):
        seen.append(np.array(heights_m))
        return original(lattice, heights_m, model, antennas)

    monkeypatch.setattr(module.Surroundings, "of", record)
    for seed in range(60):
        next(
            simulate_ground_truth(
                ONE, LATTICE, heights, MODEL, replace(NONE, roof_error=0.2, seed=seed)
            )
        )
    factor = np.log(np.array(seen)[:, :, :60] / 20.0) / 0.2
    assert not np.array(seen)[:, :, 60:].any()
    assert_mean((factor**2).mean(axis=(1, 2)), 1.0, 0.3)
    near = (factor[:, 12:] * factor[:, :-12]).mean(axis=(1, 2))
    # 60 m apart, the middles of two blocks.
    assert_mean(near, np.exp(-1.0), 0.25)


def test_adding_a_cell_changes_no_other():
    errors = GroundTruthErrors(level_error_db=7.0, local_share=0.5)
    np.testing.assert_array_equal(real(errors, CLUTTERED)[:1], real(errors, CLUTTERED, ONE))
