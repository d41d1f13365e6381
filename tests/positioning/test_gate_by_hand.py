"""How far off satellites may be, by hand: deviations of 3 m, and nothing unknown but the clock."""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.geodesy import project
from mapfilter.gnss.sky import GridFrame
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.sources.evidence import FixedTerm
from mapfilter.positioning.epochs import Epoch, Pseudorange
from mapfilter.positioning.gnss.gate import GnssComparison, GnssGate, _neutral
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.state import GnssState

CRS = "EPSG:32632"
EAST_M, NORTH_M = (float(one) for one in project(CRS, 9.3, 48.5))
OPTIONS = GnssOptions(
    gate=4.0, echo_m=0.0, reflection_times=0.0, height_m=300.0, height_sd_m=0.0, drift_sd_mps=0.0
)
GATE = GnssGate(OPTIONS, CRS, (EAST_M - 500.0, NORTH_M - 400.0), 1e6)
AZIMUTH, ELEVATION = np.radians([[10, 80, 150, 230, 300, 30], [70, 30, 45, 25, 55, 20]])


def place():
    """Ten hypotheses at one place."""
    state = np.zeros((STATES, 10), dtype=np.float32)
    state[EAST], state[NORTH] = 500.0, 400.0
    return ParticleBelief(
        state, np.full(10, -np.log(10.0)), Bins.over((0.0, 0.0, 1000.0, 1000.0)),
        np.empty((0, 10), dtype=np.float32), status=Status.TRACKING,
    )  # fmt: skip


def ranges(*late_m, clock_m=2000.0):
    frame = GridFrame(CRS, EAST_M, NORTH_M, 300.0).local
    flat = np.cos(ELEVATION) * [np.sin(AZIMUTH), np.cos(AZIMUTH)]
    places = 2.1e7 * np.vstack([flat, np.sin(ELEVATION)]).T @ frame.axes + frame.origin_m
    return tuple(
        Pseudorange(f"G{k}", 2.1e7 + clock_m + late, 3.0, tuple(map(float, places[k])))
        for k, late in enumerate(late_m)
    )


def left_out(*late_m, known=None, clock_m=2000.0, spacing_m=0.0):
    """The satellites that are not used, at the time at which the others were, or as the first."""
    belief, state = (known.belief, known.state) if known else (place(), GnssState())
    epoch = Epoch(10.0, (), pseudoranges=ranges(*late_m, clock_m=clock_m))
    return [name for _, name, _ in GATE.compare(belief, state, epoch, 100.0, spacing_m).unused]


@pytest.fixture(scope="module")
def known():
    """After six satellites without errors, which leave 1.5 m² to the clock."""
    found = GATE.compare(
        place(), GnssState(), Epoch(10.0, (), pseudoranges=ranges(*[0.0] * 6)), 100.0, 0
    )
    assert found.state.receiver.covariance[0, 0] == pytest.approx(1.5, rel=1e-3)
    return found


@pytest.mark.parametrize("spacing_m", [0.0, 60.0])
@pytest.mark.parametrize(("apart_m", "used"), [(12.6, True), (12.8, False)])
def test_an_unknown_clock_explains_one_of_the_first_satellites(apart_m, used, spacing_m):
    """Of two the difference is left, of 18 m²: 9 times that, 12.73 m, is at a gate of 4.

    How far particles are apart makes no difference.
    """
    assert (left_out(apart_m, 0.0, spacing_m=spacing_m) == []) is used


@pytest.mark.parametrize(("apart_m", "used"), [(9.4, True), (9.6, False)])
def test_so_does_a_clock_that_jumped_at_half_the_gate(known, apart_m, used):
    """5 times 18 m² then: 9.49 m."""
    assert (left_out(apart_m, 0.0, known=known, clock_m=52_000.0) == []) is used


@pytest.mark.parametrize(("late_m", "used"), [(9.6, True), (9.8, False)])
def test_a_satellite_is_judged_alone_where_another_is_far_off(known, late_m, used):
    """9 times the 10.5 m² of its own and of the clock: 9.72 m."""
    expected = ["G0"] if used else ["G0", "G1"]
    assert left_out(900.0, late_m, 0.0, 0.0, 0.0, 0.0, known=known) == expected


@pytest.mark.parametrize(("late_m", "used"), [(7.6, True), (7.7, False)])
def test_those_that_are_left_are_judged_together(known, late_m, used):
    """Of five, two to either side are 2 d² / 9 off together; 13 is at the gate: 7.65 m."""
    expected = ["G0"] if used else [f"G{k}" for k in range(6)]
    assert left_out(900.0, late_m, -late_m, 0.0, 0.0, 0.0, known=known) == expected


@pytest.mark.parametrize(("late_m", "used"), [(7.8, True), (8.0, False)])
def test_a_clock_that_is_known_explains_none(known, late_m, used):
    """Of six, two to either side; 14 is at the gate: 7.94 m."""
    both = left_out(late_m, -late_m, 0.0, 0.0, 0.0, 0.0, known=known)
    assert (both == []) is used


def test_a_fix_and_pseudoranges_keep_the_sum_of_weights_that_steps_have_changed():
    """Weights of 0.2 and 0.3; likelihoods of 2 and 1 by the fix, of 0.5 and 4 by pseudoranges.

    0.2 · 1 + 0.3 · 4 are 2.8 times the sum of 0.5 before.
    """
    belief = replace(place(), state=np.zeros((STATES, 2), "f4"), log_weight=np.log([0.2, 0.3]))
    terms = FixedTerm(np.log([2.0, 1.0])), FixedTerm(np.log([0.5, 4.0]))
    fix, pseudoranges = _neutral(GnssComparison(belief, GnssState(), terms)).terms
    assert fix == terms[0]
    np.testing.assert_allclose(np.exp(pseudoranges.value), [0.5 / 2.8, 4 / 2.8], rtol=1e-12)
