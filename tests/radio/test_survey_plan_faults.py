"""What readings say against the plan: sectors exchanged, and levels far from those predicted."""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.lattice import Lattice
from mapfilter.propagation.shadowing import correlated_field
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.plan_faults import plan_faults

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385_000.0, 6_673_200.0, 10.0, 120, 120)
SITES = {"S": (385_350.0, 6_672_400.0, 20.0), "T": (385_850.0, 6_672_800.0, 50.0)}
PLAN = CellPlan(
    CRS,
    tuple(
        Cell(f"{site}{letter}", site, east, north, 25.0, azimuth + turn, 52.0, 1800.0)
        for site, (east, north, azimuth) in SITES.items()
        for letter, turn in zip("ABC", (0.0, 120.0, 240.0), strict=True)
    ),
)
TURNED = {f"{site}{a}": f"{site}{b}" for site in SITES for a, b in ("AB", "BC", "CA")}
OPTIONS = SurveyOptions()


def predicted_dbm(cell, east_m, north_m):
    """Path loss and the antenna's pattern, not as the check has them."""
    east_m, north_m = east_m - cell.east_m, north_m - cell.north_m
    off_rad = np.arctan2(east_m, north_m) - np.radians(cell.azimuth_deg)
    loss_db = 38.0 + 33.0 * np.log10(np.hypot(np.hypot(east_m, north_m), 23.5))
    return cell.eirp_dbm - loss_db + sector_gain_db(off_rad, np.radians(65.0), 25.0)


def levels_of(cell):
    return lambda east_m, north_m: predicted_dbm(cell, east_m, north_m)


PREDICTED = {cell.id: levels_of(cell) for cell in PLAN.cells}


def driven(seed, strongest=6):
    """A drive through streets in both directions: the strongest cells, with 7 dB of shadowing."""
    rng = np.random.default_rng(seed)
    west, south, east, north = LATTICE.bounds_m
    at_m = np.arange(0.0, 1200.0, 12.0)
    lines = [(west + at_m, np.full(at_m.size, y)) for y in np.arange(south + 50, north, 250)]
    lines += [(np.full(at_m.size, x), south + at_m) for x in np.arange(west + 50, east, 250)]
    east_m, north_m = (np.concatenate(axis) for axis in zip(*lines, strict=True))
    row, col = (np.minimum(axis, 119) for axis in LATTICE.row_col(east_m, north_m))
    level = np.array(
        [
            PREDICTED[cell.id](east_m, north_m)
            + correlated_field(LATTICE, 7.0, 50.0, rng)[row, col]
            + rng.normal(0, 2, east_m.size)
            for cell in PLAN.cells
        ]
    )
    rank = np.argsort(np.argsort(-level, axis=0), axis=0)
    cell, place = np.nonzero(rank < strongest)
    count = cell.size
    return Measurements(
        CRS,
        tuple(cell.id for cell in PLAN.cells),
        {},
        ("drive",),
        cell.astype(np.int32),
        np.zeros(count, np.int32),
        5.0 * place,
        east_m[place],
        north_m[place],
        np.round(level[cell, place]),
        np.full(count, 5.0),
    )


def renamed(measurements, names):
    ids = list(measurements.cell_ids)
    new = np.array([ids.index(names.get(one, one)) for one in ids], dtype=np.int32)
    return replace(measurements, cell=new[measurements.cell])


def notes(measurements, predicted=PREDICTED, plan=PLAN):
    survey = fit_survey(measurements, OPTIONS, plan=plan, predicted=predicted)
    return plan_faults(survey, plan, predicted)


@pytest.mark.parametrize("strongest", [1, 2, 6])
@pytest.mark.parametrize("predicted", [None, PREDICTED])
def test_of_right_measurements_nothing_is_said(strongest, predicted):
    for seed in range(2):
        assert notes(driven(seed, strongest), predicted) == ()


@pytest.mark.parametrize("strongest", [1, 2, 6])
@pytest.mark.parametrize("predicted", [None, PREDICTED])
def test_sectors_turned_all_around_are_said(strongest, predicted):
    (note,) = notes(renamed(driven(0, strongest), TURNED), predicted)
    assert note.startswith("levels contradict the plan's sectors at ")
    # The readings of A are named B: they lie where A points.
    assert "SB where SA points" in note or "TB where TA points" in note
    assert "as if azimuths were 120° less" in note
    assert "likely: cells exchanged in the measurements, or azimuths in the plan" in note


@pytest.mark.parametrize("predicted", [None, PREDICTED])
def test_two_sectors_of_one_site_exchanged_are_said(predicted):
    swapped = renamed(driven(1, 3), {"SA": "SC", "SC": "SA"})
    (note,) = notes(swapped, predicted)
    assert "at 1 site: those of SA where SC points, SC where SA points (log odds" in note


def test_an_offset_over_all_is_said_and_a_usual_one_is_not():
    drive = driven(2, 3)
    for offset_db, word in ((-20.0, "below"), (25.0, "above")):
        (note,) = notes(replace(drive, level_dbm=drive.level_dbm + offset_db))
        assert f" dB {word} the prediction (median of 6 cells), which is calibrated away" in note
        assert "more than the 12 dB" in note
    for offset_db in (-10.0, 8.0):
        assert notes(replace(drive, level_dbm=drive.level_dbm + offset_db)) == ()
    # Without a prediction there is nothing to compare with.
    assert notes(replace(drive, level_dbm=drive.level_dbm - 20.0), None) == ()


def test_exchanged_sectors_are_no_offset():
    """Levels of the wrong sector are far off those predicted for it."""
    found = notes(renamed(driven(0, 1), TURNED))
    assert len(found) == 1
    assert "sectors" in found[0]


def test_cells_that_do_not_point_are_not_compared():
    omni = CellPlan(CRS, tuple(replace(c, antenna="omni", azimuth_deg=None) for c in PLAN.cells))
    assert notes(renamed(driven(0), TURNED), None, omni) == ()
    alike = CellPlan(CRS, tuple(replace(c, azimuth_deg=10.0) for c in PLAN.cells))
    assert notes(driven(0), None, alike) == ()
    few = driven(0).where(np.arange(len(driven(0))) < 20)
    assert notes(few, None) == ()


def test_a_survey_without_a_plan_has_no_sectors():
    survey = fit_survey(driven(0, 2), OPTIONS)
    assert plan_faults(survey, None, None) == ()
