"""Predictions by each model and with each antenna."""

from dataclasses import replace

import numpy as np
import pytest
from msi_files import panel_losses
from numpy.typing import NDArray
from one_cell import predict_cell, predict_steep_cell

from mapfilter.errors import ConfigError, InputError
from mapfilter.lattice import Lattice
from mapfilter.propagation.empirical import friis_db, log_distance_db, okumura_hata_db
from mapfilter.propagation.line_of_sight import line_of_sight
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict, simulate_ground_truth
from mapfilter.propagation.remarks import high_antennas, off_frequency, upward_tilts
from mapfilter.propagation.tr38901 import hidden_loss_db, seen_loss_db, sight_probability
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import Cell, CellPlan

# On the central meridian of the zone, where grid north is true north.
CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 499500.0, 6673500.0, 10.0, 100, 100)
CENTRE = (500005.0, 6672995.0)
OMNI = Cell("A", "S", *CENTRE, 25.0, None, 50.0, 900.0, "omni")
NORTH = replace(OMNI, id="N", azimuth_deg=0.0, antenna="sector")
PLAIN = PredictionModel(shadowing_db=0.0)


def _offsets_m() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rows, cols = np.indices((LATTICE.rows, LATTICE.cols))
    east_m, north_m = LATTICE.east_north(rows, cols)
    return east_m - CENTRE[0], north_m - CENTRE[1]


DISTANCE_M = np.hypot(*_offsets_m())
PIXEL = np.unravel_index(np.argmin(DISTANCE_M), DISTANCE_M.shape)


def _model(name: str, **changes: object) -> PredictionModel:
    return replace(PLAIN, model=name, **changes)  # type: ignore[arg-type]


def _panel(**changes: object) -> MeasuredAntenna:
    every = np.arange(360.0)
    horizontal, vertical = panel_losses()
    antenna = MeasuredAntenna("panel", every, horizontal, every, vertical)
    return replace(antenna, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("model", "loss_db"),
    [
        (_model("friis"), friis_db(DISTANCE_M, 900.0)),
        (_model("log_distance"), log_distance_db(DISTANCE_M, 900.0, 3.0)),
        (
            _model(
                "log_distance",
                path_loss_exponent=3.5,
                reference_distance_m=50.0,
                reference_loss_db=70.0,
            ),
            log_distance_db(DISTANCE_M, 900.0, 3.5, 50.0, 70.0),
        ),
        (
            _model("okumura_hata", environment="suburban"),
            okumura_hata_db(DISTANCE_M, 900.0, 25.0, 1.5, "suburban"),
        ),
    ],
)
def test_level_is_eirp_less_the_loss(model: PredictionModel, loss_db: np.ndarray) -> None:
    np.testing.assert_allclose(predict_cell(OMNI, LATTICE, None, model), 50.0 - loss_db, atol=1e-4)


@pytest.mark.parametrize("scenario", ["uma", "umi"])
def test_tr_38901_takes_sight_from_the_buildings_or_from_its_table(scenario: str) -> None:
    heights = np.zeros((LATTICE.rows, LATTICE.cols), dtype=np.float32)
    heights[20:25, 30:70] = 30.0
    seen = line_of_sight(heights, LATTICE, (*CENTRE, 25.0), 1.5)
    at = (DISTANCE_M, 900.0, 25.0, 1.5)
    seen_db, hidden_db = seen_loss_db(scenario, *at), hidden_loss_db(scenario, *at)  # type: ignore[arg-type]
    model = _model(f"tr38901_{scenario}")
    level = predict_cell(OMNI, LATTICE, heights, model)
    np.testing.assert_allclose(level, 50.0 - np.where(seen, seen_db, hidden_db), atol=1e-4)
    assert 0 < (~seen).sum() < seen.size
    share = sight_probability(scenario, DISTANCE_M)  # type: ignore[arg-type]
    expected = 50.0 - share * seen_db - (1 - share) * hidden_db
    chance = replace(model, line_of_sight="probability")
    for raster in (None, heights):
        level = predict_cell(OMNI, LATTICE, raster, chance)
        np.testing.assert_allclose(level, expected, atol=1e-4)
    np.testing.assert_array_equal(
        predict_cell(OMNI, LATTICE, None, model), predict_cell(OMNI, LATTICE, None, chance)
    )


def test_slope_error_is_the_same_share_of_the_slope_in_every_model() -> None:
    for name, per_decade_db in (("friis", 20.0), ("log_distance", 30.0), ("tr38901_umi", 40.0)):
        model = _model(name)
        sight = np.ones(DISTANCE_M.shape, dtype=np.float32)
        heights = np.zeros_like(sight)
        plain = predict_cell(OMNI, LATTICE, heights, model)
        steep = predict_steep_cell(OMNI, LATTICE, heights, model, 1.01)
        far = DISTANCE_M > 250.0
        change = (plain - steep)[far] / np.log10(DISTANCE_M[far] / 100.0) / 0.01
        np.testing.assert_allclose(change, per_decade_db, rtol=0.25 if "umi" in name else 0.002)


def test_3gpp_antenna_has_a_vertical_cut_of_ten_degrees_unless_told() -> None:
    told = replace(NORTH, vertical_beamwidth_deg=10.0)
    unknown = replace(NORTH, antenna="3gpp")
    levels = [predict_cell(cell, LATTICE, None, PLAIN) for cell in (told, unknown, NORTH)]
    np.testing.assert_array_equal(levels[0], levels[1])
    assert (levels[1] < levels[2] - 1).any()


def test_electrical_tilt_is_alike_all_around_and_mechanical_tilt_is_not() -> None:
    base = replace(
        NORTH, antenna="3gpp", beamwidth_deg=360.0, side_lobe_db=100.0, max_attenuation_db=100.0
    )
    row, col = PIXEL
    at = [(row - 30, col), (row + 30, col), (row, col + 30)]
    down_deg = np.degrees(np.arctan2(23.5, 300.0))

    def gain(cell: Cell) -> list[float]:
        level = predict_cell(cell, LATTICE, None, PLAIN)
        plain = predict_cell(replace(OMNI, height_m=cell.height_m), LATTICE, None, PLAIN)
        around = [0.0, 12 * (180 / 360) ** 2, 12 * (90 / 360) ** 2]
        return [float(level[p] - plain[p]) + side for p, side in zip(at, around, strict=True)]

    flat = -12 * (down_deg / 10) ** 2
    np.testing.assert_allclose(gain(base), flat, atol=0.02)
    electric = gain(replace(base, downtilt_deg=4.0))
    np.testing.assert_allclose(electric, -12 * ((down_deg - 4) / 10) ** 2, atol=0.02)
    ahead, behind, beside = gain(replace(base, mechanical_downtilt_deg=4.0))
    assert ahead == pytest.approx(-12 * ((down_deg - 4) / 10) ** 2, abs=0.02)
    assert behind == pytest.approx(-12 * ((down_deg + 4) / 10) ** 2, abs=0.02)
    assert beside == pytest.approx(flat, abs=0.03)


def test_a_measured_antenna_is_turned_to_its_azimuth_the_right_way_round() -> None:
    horizontal = np.full(360, 20.0)
    horizontal[60:120] = 0.0
    lobe_right = _panel(horizontal_loss_db=horizontal, vertical_loss_db=np.full(360, 20.0))
    cell = replace(NORTH, antenna="odd.msi")
    level = predict_cell(cell, LATTICE, None, PLAIN, antennas={"odd.msi": lobe_right})
    row, col = PIXEL
    # A lobe on the right of an antenna that looks north is in the east.
    assert level[row, col + 30] > level[row, col - 30] + 5
    turned = replace(cell, azimuth_deg=90.0)
    level = predict_cell(turned, LATTICE, None, PLAIN, antennas={"odd.msi": lobe_right})
    assert level[row + 30, col] > level[row - 30, col] + 5


def test_downtilt_of_the_plan_counts_from_that_of_the_file() -> None:
    every = np.arange(360.0)
    horizontal, vertical = panel_losses(6.0)
    t06 = MeasuredAntenna("t06", every, horizontal, every, vertical, 6.0)
    cell, antennas = replace(NORTH, antenna="t06"), {"t06": t06}
    plain, same, lifted = (
        predict_cell(replace(cell, downtilt_deg=tilt), LATTICE, None, PLAIN, antennas=antennas)
        for tilt in (0.0, 6.0, 2.0)
    )
    np.testing.assert_array_equal(plain, same)
    row, col = PIXEL
    assert lifted[row - 45, col] > plain[row - 45, col] + 1


def test_antennas_that_are_not_there_are_told_together() -> None:
    plan = CellPlan(
        CRS,
        (
            replace(NORTH, id="a", antenna="x.msi"),
            replace(NORTH, id="b", antenna="sectr"),
            replace(OMNI, id="c", antenna="panel"),
        ),
    )
    with pytest.raises(InputError) as caught:
        next(iter(predict(plan, LATTICE, None, PLAIN, antennas={"panel": _panel()})))
    text = str(caught.value)
    assert all(part in text for part in ("'x.msi'", "'sectr'", "'c', azimuth_deg", "misspelt"))
    with pytest.raises(InputError, match="no folder of antennas"):
        next(iter(simulate_ground_truth(plan, LATTICE, None, PLAIN, GroundTruthErrors())))


def test_a_measured_omni_needs_no_azimuth() -> None:
    ring = _panel(horizontal_loss_db=np.zeros(360), vertical_loss_db=np.zeros(360))
    cell = replace(OMNI, antenna="ring")
    np.testing.assert_allclose(
        predict_cell(cell, LATTICE, None, PLAIN, antennas={"ring": ring}),
        predict_cell(OMNI, LATTICE, None, PLAIN),
        atol=1e-5,
    )


def test_the_ground_truth_turns_measured_antennas_too() -> None:
    plan, antennas = CellPlan(CRS, (replace(NORTH, antenna="p"),)), {"p": _panel()}
    errors = GroundTruthErrors(0.0, 50.0, 0.5, 0.0, 5.0, 0.0)
    ((_, real),) = simulate_ground_truth(plan, LATTICE, None, PLAIN, errors, antennas=antennas)
    ((_, predicted),) = predict(plan, LATTICE, None, PLAIN, antennas=antennas)
    assert 0.1 < np.abs(real - predicted).max() < 5


def test_antennas_measured_at_another_frequency_are_told() -> None:
    plan = CellPlan(CRS, (replace(NORTH, antenna="p"), replace(NORTH, id="M", antenna="p")))
    told = off_frequency(plan, {"p": _panel(frequency_mhz=1855.0)})
    assert told == ("2 cells ('N', 'M'): antenna 'p' was measured at 1855 MHz",)
    assert off_frequency(plan, {"p": _panel(frequency_mhz=925.0)}) == ()
    assert off_frequency(plan, {"p": _panel()}) == ()


def test_wrong_choices_are_told_together() -> None:
    with pytest.raises(ConfigError) as caught:
        _model(
            "cost231_hata",
            line_of_sight="probability",
            environment="town",
            path_loss_exponent=0.0,
            reference_distance_m=0.0,
            reference_loss_db=-1.0,
        )
    text = str(caught.value)
    for part in (
        "line_of_sight",
        "environment",
        "path_loss_exponent",
        "reference_distance_m",
        "reference_loss_db",
    ):
        assert part in text


def test_heights_of_feet_are_told() -> None:
    def plan(*heights_m, apart_m=500.0, **more):
        cells = (
            replace(NORTH, id=f"N{n}", height_m=h, east_m=NORTH.east_m + apart_m * n, **more)
            for n, h in enumerate(heights_m)
        )
        return CellPlan(CRS, tuple(cells))

    (told,) = high_antennas(plan(98.4, 30.0, 82.0))
    assert told.startswith("2 cells ('N0', 'N2'): antennas 75 m above the ground and higher")
    # A mast among others, and what stands for a height that is not known.
    assert high_antennas(plan(98.4, 30.0)) == ()
    assert high_antennas(plan(98.4, assumed="height_m")) == ()
    # Masts in the country, and three cells of one mast.
    assert high_antennas(plan(90.0, 90.0, 90.0, apart_m=8000.0)) == ()
    assert high_antennas(plan(90.0, 90.0, 90.0, apart_m=0.0))


def test_tilts_that_a_list_counts_upwards_are_told() -> None:
    def plan(*tilts_deg, **more):
        cells = (
            replace(NORTH, id=f"N{n}", downtilt_deg=t, **more) for n, t in enumerate(tilts_deg)
        )
        return CellPlan(CRS, tuple(cells))

    (told,) = upward_tilts(plan(-6.0, 0.0, -4.0))
    assert told.startswith("2 cells ('N0', 'N2'): downtilt_deg below 0, such as -6: above the hor")
    # One that looks up a slope, among others; none; and indoors.
    assert upward_tilts(plan(-2.0, 4.0, 6.0)) == upward_tilts(plan(0.0)) == ()
    assert upward_tilts(plan(-6.0, indoor=True)) == ()
    one = CellPlan(CRS, (replace(NORTH, mechanical_downtilt_deg=-3.0),))
    assert upward_tilts(one)[0].startswith("cell 'N': mechanical_downtilt_deg below 0, such as -3")
