"""Steps of a program of one's own are checked as those that a service gets."""

import pickle
from dataclasses import replace
from math import nan

import numpy as np
import pytest
from small_area import SOUTH_M, WEST_M, make_area

from mapfilter.errors import InputError
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.particle import ParticleOptions
from mapfilter.geodesy import unproject
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epoch_checks import check_epoch
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow

FEW = ParticleOptions(max_particles=300, min_search_particles=200, min_particles=100)
AREA = make_area()
POSITIONER = BayesPositioner(BayesModel(AREA), FEW)
EAST_M, NORTH_M = WEST_M + 35.0, SOUTH_M + 45.0
ROW = ReportRow("serving", AREA.cell_ids[0], None, None, -70.0, 0)
STEP = MotionStep(1.0, 0.0)
SATELLITE = Pseudorange("G07", 2.2e7, 5.0, (2.6e7, 0.0, 0.0))
DIFFERENCE = Difference("A", "B", 120.0)


def rng():
    return np.random.default_rng(1)


def refused(epoch):
    with pytest.raises(InputError) as caught:
        POSITIONER.step(POSITIONER.begin(), epoch, rng())
    return [str(fault) for fault in caught.value.faults]


@pytest.mark.parametrize("rad", [90.0, -300.0, 6.5])
def test_directions_beyond_a_turn_are_no_radians(rad):
    found = "\n".join(refused(Epoch(0.0, motion=(MotionStep(1.4, 0.1), MotionStep(1.4, rad, rad)))))
    expected = f"expected radians in -2π..2π, found {rad} (likely: degrees given for radians"
    assert f"epoch, motion[1].heading_rad: {expected}, or headings that count on" in found
    assert f"epoch, motion[1].turn_rad: {expected})" in found


def test_what_was_not_measured_is_nan_and_no_fault():
    row = ReportRow("neighbour", None, 600, None, nan, 0)
    step = MotionStep(nan, nan)
    fix = GnssFix(EAST_M, NORTH_M)
    for epoch in (
        Epoch(0.0),
        Epoch(1, (step,), (ROW, row), fix, (replace(SATELLITE, sigma_m=nan),), (DIFFERENCE,)),
        Epoch(np.float64(2.0), [MotionStep(np.float32(1.0), 0)], [replace(ROW, level_dbm=-70)]),
    ):
        check_epoch(epoch)


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        (
            {"level_dbm": None},
            "level_dbm: expected dBm in -200..0, found None "
            "(likely: give NaN where it was not measured)",
        ),
        (
            {"level_dbm": 40.0},
            "level_dbm: expected dBm in -200..0, found 40.0 (likely: raw RXLEV given for dBm)",
        ),
        ({"level_dbm": "-70"}, "level_dbm: expected dBm in -200..0, found '-70' "
         "(likely: a text given for a number)"),
        ({"timing_advance": None}, "timing_advance: expected steps in 0..3846, found None "
         "(likely: give NaN where it was not measured)"),
        ({"role": "server"}, "role: expected serving or neighbour, found 'server'"),
        ({"cell": 7}, "cell: expected a cell id, found 7 (likely: None where it is not known)"),
        ({"arfcn": -1, "cell": 7}, "arfcn: expected a carrier number, found -1"),
    ],
)  # fmt: skip
def test_a_row_that_is_none_of_a_log_is_named(row, fault):
    found = refused(Epoch(0.0, radio=(ROW, replace(ROW, **row))))
    assert f"epoch, radio[1].{fault}" in found


@pytest.mark.parametrize(
    ("epoch", "fault"),
    [
        (Epoch(None), "epoch, time_s: expected seconds, found None"),
        (Epoch(0.0, (MotionStep(1.0, 0.0, nan, nan, nan),)), "sampling_sd_m: expected metres >= 0"),
        (Epoch(0.0, (replace(STEP, turned_sd_rad=None),)), "turned_sd_rad: expected radians >= 0"),
        (Epoch(0.0, (replace(STEP, turned_sd_rad=nan),)), "turned_sd_rad: expected radians >= 0"),
        (Epoch(nan), "epoch, time_s: expected seconds, found nan"),
        (Epoch(0.0, motion=MotionStep(1.0, 0.0)), "epoch, motion: expected a tuple of MotionStep"),
        (Epoch(0.0, motion=(1.0,)), "epoch, motion[0]: expected a MotionStep, found 1.0"),
        (Epoch(0.0, motion=(MotionStep(1.0, 90.0),)), "motion[0].heading_rad: expected radians"),
        (Epoch(0.0, gnss=(1.0, 2.0)), "epoch, gnss: expected a GnssFix, found (1.0, 2.0)"),
        (
            Epoch(0.0, gnss=GnssFix(None, 2.0)),
            "epoch, gnss.east_m: expected metres east, found None",
        ),
        (
            Epoch(0.0, pseudoranges=(replace(SATELLITE, pseudorange_m="far"),)),
            "metres, found 'far'",
        ),
        (
            Epoch(0.0, pseudoranges=(replace(SATELLITE, place_m=(0.0, None, 0.0)),)),
            "place_m, y_m: ",
        ),
        (Epoch(0.0, tdoa=(replace(DIFFERENCE, cell=None),)), "[0].cell: expected a cell id"),
        ({"time_s": 0.0}, "epoch: expected an Epoch, found {'time_s': 0.0}"),
    ],
)
def test_other_faults_of_an_epoch(epoch, fault):
    with pytest.raises(InputError) as caught:
        check_epoch(epoch)
    assert fault in str(caught.value)


def test_all_faults_of_an_epoch_are_told_together():
    bad = Epoch(0.0, (MotionStep(None, 0.0),), (replace(ROW, level_dbm=None, role=None),))
    assert len(refused(bad)) == 3


def test_a_saved_state_goes_on_over_its_own_area_only():
    state, _ = POSITIONER.step(POSITIONER.begin(), Epoch(0.0, radio=(ROW,)), rng())
    saved = pickle.loads(pickle.dumps(state))
    step = Epoch(1.0, (MotionStep(1.0, 0.0),), (ROW,))
    found, expected = (POSITIONER.step(one, step, rng())[1].fix for one in (saved, state))
    assert (found.east_m, found.status) == (expected.east_m, expected.status)
    other = BayesPositioner(BayesModel(replace(AREA, floor_dbm=AREA.floor_dbm - 1)), FEW)
    with pytest.raises(InputError) as caught:
        other.step(saved, step, rng())
    assert str(caught.value) == (
        "state: expected a state of this database, of begin, begin_at or step, found one of "
        "another (likely: the database was built again; begin anew)"
    )
    with pytest.raises(InputError, match="state: expected a state of this database"):
        POSITIONER.step((state, None), step, rng())
    # Nobody stated what this one is of.
    POSITIONER.step(BayesState(sources=POSITIONER.begin().sources), step, rng())


@pytest.mark.parametrize("swapped", [False, True])
def test_a_start_in_degrees_is_refused(swapped):
    lon_deg, lat_deg = (float(one) for one in unproject(AREA.lattice.crs, EAST_M, NORTH_M))
    place = (lat_deg, lon_deg) if swapped else (lon_deg, lat_deg)
    with pytest.raises(InputError) as caught:
        POSITIONER.begin_at(*place, 5.0, rng())
    fault = str(caught.value)
    assert fault.startswith("start: expected a place in the area (latitude ")
    assert "or at most 500 m outside, found " in fault
    assert "degrees given for metres" in fault


@pytest.mark.parametrize(
    ("start", "fault"),
    [
        ((None, NORTH_M, 5.0), "start, east_m: expected metres east, found None"),
        ((EAST_M, nan, 5.0), "start, north_m: expected metres north, found nan"),
        ((EAST_M, NORTH_M, -5.0), "start, sd_m: expected metres in 0..100000, found -5.0"),
        ((EAST_M, NORTH_M, True), "start, sd_m: expected metres in 0..100000, found True"),
        ((NORTH_M, EAST_M, 5.0), "(likely: east and north swapped)"),
        ((EAST_M + 5000, NORTH_M, 5.0), "(likely: a position of another area or zone)"),
    ],
)
def test_a_start_that_is_none_of_the_area_is_refused(start, fault):
    with pytest.raises(InputError) as caught:
        POSITIONER.begin_at(*start, rng())
    assert fault in str(caught.value)


def test_a_start_may_lie_outside_by_its_deviation():
    POSITIONER.begin_at(np.float64(WEST_M - 400.0), NORTH_M, 5, rng())
    POSITIONER.begin_at(WEST_M - 3000.0, NORTH_M, 700.0, rng())
