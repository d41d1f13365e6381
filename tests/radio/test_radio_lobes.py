"""Lobes are found where they are; numbers are told for what they are."""

import numpy as np
import pytest

from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.check.lobes import (
    azimuth_mistakes,
    best_labels,
    find_lobe,
)
from mapfilter.check.place_fits import peak_m
from mapfilter.check.raster_kinds import above_free_space_db, falls_with_distance
from mapfilter.check.samples import RasterSample
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import simulate_ground_truth
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell, CellPlan

# On the central meridian, so that grid north is true north.
LATTICE = Lattice("EPSG:32635", 499_000.0, 6_670_000.0, 20.0, 80, 100)
SITE = (499_900.0, 6_669_300.0)


def sector(azimuth_deg, noise_db=6.0, seed=1, site=SITE, lattice=LATTICE):
    """Levels of one sector: a distance law, the pattern, white noise."""
    rows, cols = np.mgrid[: lattice.rows, : lattice.cols]
    east, north = lattice.east_north(rows, cols)
    distance = np.hypot(east - site[0], north - site[1]) + 10
    values = -30 - 35 * np.log10(distance)
    if azimuth_deg is not None:
        offset = np.arctan2(north - site[1], east - site[0])
        offset = offset - heading_from_azimuth_rad(azimuth_deg)
        values += sector_gain_db(offset, np.radians(65), 25)
    values += np.random.default_rng(seed).normal(0, noise_db, values.shape)
    return RasterSample("A", lattice, values.astype(np.float32), "")


@pytest.mark.parametrize("azimuth_deg", range(0, 360, 25))
def test_lobes_are_found_within_ten_degrees(azimuth_deg):
    lobe = find_lobe(sector(azimuth_deg), *SITE, 65.0)
    assert lobe is not None
    assert abs(lobe.offset_deg(azimuth_deg)) <= 10
    assert lobe.score(azimuth_deg) > 0.8
    assert lobe.score(azimuth_deg + 180) < -0.3
    assert lobe.contrast_db == pytest.approx(25, abs=5)


def test_convergence_turns_the_lobe():
    """5° west of the central meridian at 60° north, grid north is 4.3° west of true north."""
    lattice = Lattice("EPSG:32635", 220_000.0, 6_670_000.0, 20.0, 80, 100)
    site = (220_900.0, 6_669_300.0)
    exact = sector(90, 0.0, site=site, lattice=lattice)
    lobe = find_lobe(exact, *site, 65.0)
    assert lobe is not None
    # Drawn 90° from grid north, which is 86° from true north.
    assert lobe.score(85) > lobe.score(90) > lobe.score(95)


def test_no_lobe_of_an_even_raster_nor_in_a_corner():
    lobe = find_lobe(sector(None), *SITE, 65.0)
    assert lobe is None or lobe.contrast_db < 6 or lobe.scores.max() < 0.25
    west, south, _, _ = LATTICE.bounds_m
    assert find_lobe(sector(10, site=(west, south)), west, south, 65.0) is None
    empty = RasterSample("A", LATTICE, np.full((80, 100), np.nan, np.float32), "")
    assert find_lobe(empty, *SITE, 65.0) is None


def test_levels_fall_about_their_own_site_only():
    sample = sector(None)
    assert falls_with_distance(sample, *SITE) > 0.7
    assert falls_with_distance(sample, 500_900.0, 6_668_450.0) < 0.2
    assert peak_m(sample) == pytest.approx(SITE, abs=60)


def cells_and_lobes(azimuths_deg, site="S"):
    cells = tuple(
        Cell(f"{site}{n}", site, *SITE, 30.0, azimuth, 43.0, 1800.0)
        for n, azimuth in enumerate(azimuths_deg)
    )
    lobes = {
        c.id: find_lobe(sector(c.azimuth_deg, seed=n), *SITE, 65.0) for n, c in enumerate(cells)
    }
    return cells, lobes


def test_labels_go_to_the_azimuths_that_fit():
    cells, lobes = cells_and_lobes((10, 130, 250))
    turned = {"S0": 130.0, "S1": 250.0, "S2": 10.0}
    assert best_labels(lobes, {c.id: c.azimuth_deg for c in cells}) == {i: i for i in turned}
    assert best_labels(lobes, turned) == {"S0": "S2", "S1": "S0", "S2": "S1"}


def test_azimuths_that_fit_are_no_mistake():
    assert azimuth_mistakes(*cells_and_lobes((10, 130, 250))) == ()
    assert azimuth_mistakes(*cells_and_lobes((40, 100))) == ()


def test_one_site_whose_azimuths_are_all_off_by_ninety():
    """Four sectors could also have exchanged labels; three uneven ones cannot."""
    cells, lobes = cells_and_lobes((10, 110, 250))
    given = [cell.__class__(**_fields(cell, (cell.azimuth_deg + 90) % 360)) for cell in cells]
    (mistake,) = azimuth_mistakes(given, lobes)
    assert mistake.mistake == "azimuth-off-by-90"
    assert mistake.reading == "to be 90° less"
    assert mistake.offset_deg == pytest.approx(90, abs=10)
    assert mistake.offset_read_deg <= 10


def given_as(read, *sites):
    """Lobes of the true azimuths of sites, and cells with what ``read`` makes of them."""
    cells, lobes = [], {}
    for name, azimuths_deg in zip("STUVW", sites, strict=False):
        some, found = cells_and_lobes(azimuths_deg, name)
        cells += [cell.__class__(**_fields(cell, read(cell.azimuth_deg))) for cell in some]
        lobes |= found
    return cells, lobes


def test_azimuths_in_gons_are_told_by_all_sectors():
    told = azimuth_mistakes(
        *given_as(lambda a: a / 0.9, (10, 130, 250), (60, 180, 300), (100, 310))
    )
    assert [mistake.mistake for mistake in told] == ["azimuth-gons"]
    assert told[0].offset_read_deg < told[0].offset_deg


def test_other_mistakes_and_lobes_that_stray_are_no_gons():
    """Counter-clockwise plans of 0, 120 and 240 were, as 216 is nearer to 120 than 240 is."""
    rough = (0, 125, 230), (0, 118, 245), (0, 112, 236)
    (mistake,) = azimuth_mistakes(*given_as(lambda a: round(-a / 120) * 120 % 360, *rough))
    assert mistake.mistake == "azimuth-counter-clockwise"
    # The lobe of one sector was enough, where it is 40° off, and the others are not.
    sites = (0, 120, 260), (0, 120, 80)
    assert azimuth_mistakes(*given_as(lambda a: 300 if a == 260 else a, *sites)) == ()


def _fields(cell, azimuth_deg):
    return {name: getattr(cell, name) for name in cell.__slots__} | {"azimuth_deg": azimuth_deg}


def test_free_space_is_not_exceeded_by_itself():
    """32.44 dB at 1 km and 1 MHz (ITU-R P.525, 32.45)."""
    cell = Cell("A", "S", *SITE, 30.0, 0.0, 43.0, 1000.0)
    rows, cols = np.mgrid[:80, :100]
    east, north = LATTICE.east_north(rows, cols)
    metres = np.sqrt((east - SITE[0]) ** 2 + (north - SITE[1]) ** 2 + 28.5**2)
    levels = 43.0 - (32.44 + 60.0 + 20 * np.log10(metres / 1000))
    for above in (0.0, 7.5):
        sample = RasterSample("A", LATTICE, (levels + above).astype(np.float32), "")
        assert above_free_space_db(sample, cell) == pytest.approx(above, abs=1e-4)
    behind = north < SITE[1]
    sample = RasterSample("A", LATTICE, np.where(behind, levels + 30, levels - 7).astype("f4"), "")
    assert above_free_space_db(sample, cell) == pytest.approx(-7, abs=1e-4)
    empty = RasterSample("A", LATTICE, np.full(levels.shape, np.nan, np.float32), "")
    assert above_free_space_db(empty, cell) == -np.inf


@pytest.mark.parametrize(
    "model",
    ["friis", "log_distance", "okumura_hata", "cost231_walfisch_ikegami", "tr38901_umi"],
)
def test_levels_tell_an_eirp_that_is_forty_db_off(model):
    """Of six cells of any model, with the shadowing of prediction and ground truth together."""
    cells = [Cell(f"{n}", f"{n}", *SITE, 30.0, 60.0 * n, 43.0, 1800.0) for n in range(6)]
    plan, wanted = CellPlan(LATTICE.crs, tuple(cells)), PredictionModel(model=model)
    real = dict(simulate_ground_truth(plan, LATTICE, None, wanted, GroundTruthErrors()))
    samples = [RasterSample(cell.id, LATTICE, real[cell.id], "") for cell in cells]
    above_db = np.median([above_free_space_db(s, c) for s, c in zip(samples, cells, strict=True)])
    assert above_db < 10 < above_db + 40
