"""Levels and timing advances that a cell plan predicts, by the published formulas."""

from dataclasses import asdict, replace
from math import atan, cos, log10, pi, radians, sin, tan

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.geodesy import unproject
from mapfilter.models.state import MOVING, POSITION
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import Cell, CellPlan

CRS, EAST_M, NORTH_M = "EPSG:32629", 700_000.0, 4_600_000.0
OPTIONS = KalmanOptions()
CELL = Cell("A", "A", EAST_M, NORTH_M, 101.5, None, 50.0, 1800.0, "omni")
OTHER = replace(CELL, id="Z", east_m=300_000.0)
ANGLES = np.arange(360.0)
OFF = np.minimum(ANGLES, 360 - ANGLES)
MEASURED = MeasuredAntenna("K", ANGLES, OFF / 10, ANGLES, OFF / 4, downtilt_deg=2.0)
"""It loses a tenth of a dB for each degree to a side, and a quarter for each one downwards."""


def hata_db(km, height_m=101.5, mhz=1800.0):
    """COST 231 outside metropolitan centres, of a phone at 1.5 m."""
    phone_db = (1.1 * log10(mhz) - 0.7) * 1.5 - (1.56 * log10(mhz) - 0.8)
    at_km_db = 46.3 + 33.9 * log10(mhz) - 13.82 * log10(height_m) - phone_db
    return at_km_db + (44.9 - 6.55 * log10(height_m)) * log10(km)


def convergence_rad():
    """Of the grid at the first cell: the meridian of zone 29 is 9 degrees west."""
    lon, lat = (radians(float(one)) for one in unproject(CRS, EAST_M, NORTH_M))
    return atan(tan(lon + radians(9.0)) * sin(lat))


def level_dbm(cell, azimuth_deg=0.0, km=1.0):
    """The level that a plan with this cell, and another one far away, predicts in a direction."""
    sites = SiteModels(CellPlan(CRS, (cell, OTHER)), OPTIONS, {"K": MEASURED})
    heading_rad = pi / 2 - radians(azimuth_deg) + convergence_rad()
    place = EAST_M + 1000 * km * cos(heading_rad), NORTH_M + 1000 * km * sin(heading_rad)
    model = sites.of(POSITION, ("A",), ())
    assert model.noise.tolist() == [[64.0]]
    return float(model.mean(place)[0])


def near(dbm):
    return pytest.approx(dbm, abs=2e-3)


@pytest.mark.parametrize("azimuth_deg", [None, 70.0])
def test_levels_of_antennas_all_around_are_those_of_hata(azimuth_deg):
    cell = replace(CELL, azimuth_deg=azimuth_deg)
    for km in (1.0, 3.0, 20.0):
        assert level_dbm(cell, 200.0, km) == near(50.0 - hata_db(km))
    # Within 20 m it is as there.
    for m, as_at_m in ((5.0, 20.0), (30.0, 30.0)):
        assert level_dbm(cell, 10.0, m / 1000) == near(50.0 - hata_db(as_at_m / 1000))
    low = replace(cell, height_m=4.0, eirp_dbm=43.0, frequency_mhz=1950.0)
    # No antenna counts as lower than 10 m.
    assert level_dbm(low) == near(43.0 - hata_db(1.0, 10.0, 1950.0))
    ten = replace(low, height_m=12.0)
    assert level_dbm(ten) == near(43.0 - hata_db(1.0, 12.0, 1950.0))


def test_indoor_cells_lose_what_walls_take():
    walls = replace(CELL, penetration_loss_db=18.0)
    assert level_dbm(walls) == near(50.0 - hata_db(1.0))
    assert level_dbm(replace(walls, indoor=True)) == near(32.0 - hata_db(1.0))


@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0])
def test_sectors_point_to_their_true_azimuth(azimuth_deg):
    """12 (φ / width)² dB are lost, at most 20; the grid is turned by 1.6 degrees."""
    assert np.degrees(convergence_rad()) == pytest.approx(1.59, abs=0.02)
    cell = replace(
        CELL, antenna="sector", azimuth_deg=azimuth_deg, beamwidth_deg=60.0, max_attenuation_db=20.0
    )
    for off_deg, lost_db in ((0.0, 0.0), (30.0, 3.0), (-45.0, 6.75), (170.0, 20.0)):
        expected = 50.0 - hata_db(1.0) - lost_db
        assert level_dbm(cell, azimuth_deg + off_deg) == near(expected)


@pytest.mark.parametrize("azimuth_deg", [None, 0.0, 90.0])
def test_measured_antennas_are_seen_from_a_kilometre(azimuth_deg):
    """100 m below: 5.71 degrees. Those without an azimuth point to the north."""
    cell = replace(CELL, antenna="K", azimuth_deg=azimuth_deg)
    down_deg, ahead_deg = np.degrees(atan(0.1)), azimuth_deg or 0.0
    whole_dbm = 50.0 - hata_db(1.0)
    assert level_dbm(cell, ahead_deg) == near(whole_dbm - down_deg / 4)
    # To the side a part of the loss below, of which the cut behind has its own.
    side = 45.0 / 180.0
    lost_db = 4.5 + (1 - side) * down_deg / 4 - side * (18.0 - (180.0 - down_deg) / 4)
    assert level_dbm(cell, ahead_deg + 45.0) == near(whole_dbm - lost_db)
    # A tilt of 6 degrees instead of the 2 that it was measured with, by phase or by leaning.
    expected = near(whole_dbm - (down_deg - 4.0) / 4)
    assert level_dbm(replace(cell, downtilt_deg=6.0), ahead_deg) == expected
    assert level_dbm(replace(cell, mechanical_downtilt_deg=4.0), ahead_deg) == expected


def test_antennas_that_are_not_there_are_told_together():
    plan = CellPlan(CRS, (CELL, replace(CELL, id="B", antenna="L"), replace(OTHER, antenna="M")))
    with pytest.raises(InputError, match=r"'L'[\s\S]*'M'"):
        SiteModels(plan, OPTIONS, {"K": MEASURED})
    with pytest.raises(InputError, match="'K'"):
        SiteModels(CellPlan(CRS, (replace(CELL, antenna="K"),)), OPTIONS)


def test_a_plan_without_cells_has_no_grid_to_be_turned():
    assert SiteModels(CellPlan(CRS, ()), OPTIONS).convergence_rad == 0.0


def test_timing_advances_are_distances_with_the_error_of_their_step():
    sites = SiteModels(CellPlan(CRS, (CELL, OTHER)), replace(OPTIONS, timing_step_m=120.0))
    model = sites.of(MOVING, ("Z",), ("A",))
    np.testing.assert_allclose(np.diag(model.noise), [64.0, 200.0**2 + 120.0**2 / 12])
    assert model.mean([EAST_M + 300.0, 0.0, NORTH_M + 400.0, 0.0])[1] == pytest.approx(500.0)


def test_a_neighbour_is_within_the_reach_of_the_serving_cell():
    places = (("A", 0.0, 1), ("B", 35_000.0, 7), ("C", 35_001.0, 8))
    cells = [
        replace(CELL, id=name, east_m=EAST_M + off_m, arfcn=arfcn, bsic=3)
        for name, off_m, arfcn in places
    ]
    sites = SiteModels(CellPlan(CRS, tuple(cells)), OPTIONS)
    assert sites.neighbours("A", 7, 3) == ("B",)
    assert sites.neighbours("A", 8, 3) == ()
    assert sites.neighbours(None, 8, 3) == ("C",)


def test_the_usual_options_of_kalman_type_filters():
    assert asdict(KalmanOptions()) == {
        "level_error_db": 12.0, "level_memory_m": 300.0, "level_offset_db": 10.0,
        "level_offset_memory_m": 3000.0, "level_noise_db": 8.0, "level_noise_memory_m": 40.0,
        "timing_step_m": pytest.approx(553.46, abs=0.01), "timing_sd_m": 200.0,
        "timing_memory_m": 500.0, "fix_sd_m": 10.0, "fix_lasting_share": 0.7,
        "fix_lasting_m": 0.0, "fix_lasting_s": 30.0,
        "step_sd_m": 0.3, "heading_sd_deg": pytest.approx(np.degrees(0.2)),
        "bias_sd_deg": 10.0, "drift_deg_per_sqrt_m": 0.6, "scale": 0.03,
        "turn_drift_deg_per_sqrt_m": 0.3, "turn_rate_sd_deg_per_s": 0.05,
        "drift_m_per_sqrt_s": 0.3, "acceleration_mps_per_sqrt_s": 0.7, "speed_sd_mps": 8.0,
        "start_sd_m": 1500.0, "start_parts": 21, "start_spacing_m": 600.0, "reach_m": 35_000.0,
        "converged_radius_m": 1000.0,
    }  # fmt: skip
