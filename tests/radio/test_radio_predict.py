"""Predictions against their parts, and the simulated ground truth."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from one_cell import predict_cell, predict_steep_cell
from pyproj import Geod

from mapfilter.errors import ConfigError, InputError
from mapfilter.geodesy import project, unproject
from mapfilter.lattice import Lattice
from mapfilter.propagation.empirical import cost231_hata_db, cost231_walfisch_ikegami_db
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict, simulate_ground_truth
from mapfilter.propagation.remarks import outside_validity
from mapfilter.radio.cells import Cell, CellPlan

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 10.0, 120, 110)
PLAIN = PredictionModel(shadowing_db=0.0)
NO_ERRORS = GroundTruthErrors(0.0, 50.0, 0.5, 0.0, 0.0, 0.0)
CENTRE = LATTICE.east_north(60, 55)
OMNI = Cell("A", "S", *CENTRE, 30.0, None, 50.0, 1800.0, "omni")
SECTOR = replace(OMNI, id="B", azimuth_deg=90.0, antenna="sector")


def _distance_m(cell: Cell, lattice: Lattice = LATTICE) -> NDArray[np.float64]:
    rows, cols = np.indices((lattice.rows, lattice.cols))
    east_m, north_m = lattice.east_north(rows, cols)
    return np.asarray(np.hypot(east_m - cell.east_m, north_m - cell.north_m))


def _town() -> NDArray[np.float32]:
    heights = np.zeros((LATTICE.rows, LATTICE.cols), dtype=np.float32)
    heights[10:30, 10:40] = 18.0
    heights[50:70, 70:80] = 40.0
    heights[55:65, 50:60] = 12.0
    return heights


def test_without_buildings_it_is_eirp_less_the_model() -> None:
    level = predict_cell(OMNI, LATTICE, None, PLAIN)
    loss = cost231_walfisch_ikegami_db(
        _distance_m(OMNI), 1800, 30, 1.5, 12, 20, 40, 90, False, False
    )
    np.testing.assert_allclose(level, 50.0 - loss, atol=1e-4)
    hata = predict_cell(OMNI, LATTICE, None, replace(PLAIN, model="cost231_hata"))
    loss = cost231_hata_db(_distance_m(OMNI), 1800, 30, 1.5, False)
    np.testing.assert_allclose(hata, 50.0 - loss, atol=1e-4)


def test_buildings_decide_who_sees_the_antenna() -> None:
    level = predict_cell(OMNI, LATTICE, _town(), PLAIN)
    row, seen, hidden = 60, 69, 85
    distance = _distance_m(OMNI)
    canyon = cost231_walfisch_ikegami_db(
        distance[row, seen], 1800, 30, 1.5, 12, 20, 40, 90, False, True
    )
    assert level[row, seen] == pytest.approx(50.0 - canyon, abs=1e-4)
    # Behind the 40 m block only its own roofs are near.
    blocked = cost231_walfisch_ikegami_db(
        distance[row, hidden], 1800, 30, 1.5, 40, 20, 40, 90, False, False
    )
    assert level[row, hidden] == pytest.approx(50.0 - blocked, abs=1e-4)


def test_sectors_point_to_true_north_not_grid_north() -> None:
    # Three degrees west of the central meridian, grid and true north differ by 2.6°.
    for azimuth_deg in (0.0, 73.0, 200.0, 359.5):
        east_m, north_m = (float(v) for v in project(CRS, 24.0, 60.17))
        lattice = Lattice.covering(
            CRS, (east_m - 600, north_m - 600, east_m + 600, north_m + 600), 10.0
        )
        cell = replace(
            SECTOR, east_m=east_m, north_m=north_m, azimuth_deg=azimuth_deg, beamwidth_deg=20.0
        )
        gain = predict_cell(cell, lattice, None, PLAIN) - predict_cell(
            replace(cell, antenna="omni"), lattice, None, PLAIN
        )
        rows, cols = np.nonzero((gain > -0.02) & (_distance_m(cell, lattice) > 300))
        lon, lat = unproject(CRS, *lattice.east_north(rows, cols))
        start = [np.full(lon.shape, v) for v in (24.0, 60.17)]
        azimuths = np.radians(Geod(ellps="WGS84").inv(*start, lon, lat)[0])
        mean_deg = np.degrees(np.angle(np.exp(1j * (azimuths - np.radians(azimuth_deg))).mean()))
        assert abs(mean_deg) < 0.1


def test_downtilt_weakens_the_foot_of_the_mast() -> None:
    tilted = replace(SECTOR, downtilt_deg=4.0, vertical_beamwidth_deg=7.0)
    change = predict_cell(tilted, LATTICE, None, PLAIN) - predict_cell(SECTOR, LATTICE, None, PLAIN)
    # At 40 m east the antenna looks down 35.5°: side lobe; at 400 m 4.1°: the beam's middle.
    assert change[60, 59] == pytest.approx(-20.0, abs=1e-4)
    assert change[60, 95] == pytest.approx(0.0, abs=0.01)
    back = predict_cell(tilted, LATTICE, None, PLAIN) - predict_cell(OMNI, LATTICE, None, PLAIN)
    assert back.min() >= -25.0 - 1e-4


def test_an_indoor_cell_loses_its_penetration_outdoors_only() -> None:
    heights = _town()
    indoor = replace(OMNI, indoor=True, penetration_loss_db=15.0, height_m=4.0)
    open_air = replace(indoor, penetration_loss_db=0.0)
    loss = predict_cell(open_air, LATTICE, heights, PLAIN) - predict_cell(
        indoor, LATTICE, heights, PLAIN
    )
    inside = np.zeros_like(loss, dtype=bool)
    inside[55:65, 50:60] = True
    np.testing.assert_allclose(loss, np.where(inside, 0.0, 15.0), atol=1e-4)


def test_slope_stretches_the_loss_about_100_m() -> None:
    plain = predict_cell(OMNI, LATTICE, None, PLAIN)
    steep = predict_steep_cell(OMNI, LATTICE, None, PLAIN, 1.05)
    # The stretched distance, too, counts as 20 m when it is shorter.
    far = _distance_m(OMNI) > 25.0
    expected = 0.05 * 38.0 * np.log10(_distance_m(OMNI)[far] / 100.0)
    np.testing.assert_allclose((plain - steep)[far], expected, atol=1e-3)


def test_cells_do_not_depend_on_each_other() -> None:
    model = PredictionModel(seed=3)
    plan = CellPlan(CRS, (OMNI, SECTOR, replace(OMNI, id="C", site="T", east_m=385100.0)))
    heights = _town()
    levels = dict(predict(plan, LATTICE, heights, model))
    assert tuple(levels) == plan.ids
    for cell in plan.cells:
        np.testing.assert_array_equal(levels[cell.id], predict_cell(cell, LATTICE, heights, model))
        assert levels[cell.id].dtype == np.float32
    real = dict(simulate_ground_truth(plan, LATTICE, heights, model, GroundTruthErrors(seed=3)))
    fewer = dict(
        simulate_ground_truth(
            CellPlan(CRS, (SECTOR,)), LATTICE, heights, model, GroundTruthErrors(seed=3)
        )
    )
    np.testing.assert_array_equal(real["B"], fewer["B"])


def test_a_plan_in_another_crs_is_brought_over() -> None:
    # Off the pixel's centre, where a millimetre would turn the direction.
    plan = CellPlan(CRS, (replace(SECTOR, east_m=SECTOR.east_m + 3.0),))
    ((_, here),) = predict(plan, LATTICE, None, PLAIN)
    ((_, there),) = predict(plan.to_crs("EPSG:3067"), LATTICE, None, PLAIN)
    np.testing.assert_allclose(here, there, atol=1e-3)


def test_progress_is_told() -> None:
    told: list[tuple[int, int]] = []
    plan = CellPlan(CRS, (OMNI, SECTOR))
    list(predict(plan, LATTICE, None, PLAIN, lambda done, total: told.append((done, total))))
    list(
        simulate_ground_truth(
            plan, LATTICE, None, PLAIN, NO_ERRORS, lambda *step: told.append(step)
        )
    )
    assert told == [(1, 2), (2, 2)] * 2


def _difference(errors: GroundTruthErrors, cell: Cell = SECTOR) -> NDArray[np.float32]:
    plan, model = CellPlan(CRS, (cell,)), PredictionModel(seed=1)
    ((_, predicted),) = predict(plan, LATTICE, None, model)
    ((_, real),) = simulate_ground_truth(plan, LATTICE, None, model, errors)
    return real - predicted


def test_ground_truth_without_errors_is_the_prediction() -> None:
    assert not _difference(NO_ERRORS).any()


def test_eirp_is_off_by_up_to_what_is_stated_and_alike_everywhere() -> None:
    offsets = []
    for seed in range(60):
        change = _difference(replace(NO_ERRORS, eirp_error_db=2.0, seed=seed))
        assert np.ptp(change) < 1e-3
        offsets.append(change.mean())
    assert max(np.abs(offsets)) <= 2.0
    assert min(offsets) < -1.5
    assert max(offsets) > 1.5


def test_slope_is_off_by_up_to_what_is_stated() -> None:
    decades = np.log10(np.maximum(_distance_m(OMNI), 20.0) / 100.0)
    for seed in range(10):
        change = _difference(replace(NO_ERRORS, slope_error=0.05, seed=seed), OMNI)
        assert (np.abs(change) <= 0.05 * 38.0 * np.abs(decades) + 1e-3).all()
        assert np.abs(change).max() > 0.01


def test_azimuth_is_off_by_up_to_what_is_stated() -> None:
    for seed in range(10):
        change = _difference(replace(NO_ERRORS, azimuth_error_deg=5.0, seed=seed))
        # d/dφ 12 (φ/65)² is at most 24 · 93.8 / 65² = 0.533 dB per degree before the cap.
        assert 0.0 < np.abs(change).max() <= 0.55 * 5.0
        assert np.abs(change[60, 100]) <= 12 * (5.0 + 2.0) ** 2 / 65**2
    assert not _difference(replace(NO_ERRORS, azimuth_error_deg=5.0), OMNI).any()


def test_shadowing_of_the_ground_truth_has_its_deviation_and_is_not_the_predictions() -> None:
    model, plan = replace(PLAIN, shadowing_db=6.0, seed=1), CellPlan(CRS, (OMNI,))
    clutter = predict_cell(OMNI, LATTICE, None, model) - predict_cell(OMNI, LATTICE, None, PLAIN)
    squares, products = [], []
    for seed in range(40):
        errors = replace(NO_ERRORS, level_error_db=7.0, seed=seed, clutter="shared")
        ((_, real),) = simulate_ground_truth(plan, LATTICE, None, model, errors)
        error = (real - predict_cell(OMNI, LATTICE, None, model)).astype(np.float64)
        squares.append((error**2).mean())
        products.append((error * clutter).mean())
    for samples, expected in ((np.array(squares), 49.0), (np.array(products), 0.0)):
        assert abs(samples.mean() - expected) < 4 * samples.std(ddof=1) / np.sqrt(len(samples))


def test_heights_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="120 x 110 pixels"):
        predict_cell(OMNI, LATTICE, np.zeros((3, 3), dtype=np.float32), PLAIN)


def test_wrong_models_are_told_together() -> None:
    with pytest.raises(ConfigError) as caught:
        PredictionModel(
            model="free",  # type: ignore[arg-type]
            street_width_m=0.0,
            shadowing_db=-1.0,
            site_share=50.0,
            mobile_height_m=float("nan"),
            seed=-1,
        )
    text = str(caught.value)
    for part in ("model", "street_width_m", "shadowing_db", "per cent", "mobile_height_m", "seed"):
        assert part in text
    with pytest.raises(ConfigError, match="per cent given for a fraction"):
        GroundTruthErrors(slope_error=5.0)


def test_what_is_extrapolated_is_told_by_cell() -> None:
    low = replace(OMNI, id="low", height_m=3.0)
    plan = CellPlan(CRS, (OMNI, low))
    assert outside_validity(plan, LATTICE, PLAIN) == (
        "cell 'low': base_height_m 3 is outside 4..50",
    )
    many = CellPlan(CRS, tuple(replace(low, id=name) for name in "abcd"))
    hata = replace(PLAIN, model="cost231_hata")
    assert outside_validity(many, LATTICE, hata) == (
        "4 cells ('a', 'b', 'c' and 1 more): base_height_m 3 is outside 30..200",
        "4 cells ('a', 'b', 'c' and 1 more): distance_m 821 is outside 1000..20000",
    )
    wide = replace(LATTICE, resolution_m=100.0)
    assert outside_validity(CellPlan(CRS, (OMNI,)), wide, hata) == (
        "cell 'A': distance_m from 20 on is outside 1000..20000",
    )
    for model in ("friis", "log_distance"):
        assert outside_validity(many, wide, replace(PLAIN, model=model)) == ()
