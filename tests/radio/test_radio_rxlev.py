"""The RXLEV scale and the identity of neighbours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.rxlev import quantise_level_dbm, resolve_neighbours

BELOW, INSIDE, ABOVE = -1, 0, 1


@pytest.mark.parametrize(
    ("level_dbm", "rxlev"),
    [
        (-110.01, 0),
        (-110.0, 1),
        (-109.01, 1),
        (-109.0, 2),
        (-48.01, 62),
        (-48.0, 63),
        (-np.inf, 0),
        (np.inf, 63),
    ],
)
def test_bins_of_ts_45_008(level_dbm: float, rxlev: int) -> None:
    censored = {0: BELOW, 63: ABOVE}.get(rxlev, INSIDE)
    assert quantise_level_dbm(level_dbm) == (-110.5 + rxlev, censored)


@given(st.integers(1, 62))
def test_bin_centres_are_fixed_points(n: int) -> None:
    assert quantise_level_dbm(-110.5 + n) == (-110.5 + n, INSIDE)


@given(st.floats(-200, 50))
def test_quantising_is_idempotent_and_within_half_a_decibel(level_dbm: float) -> None:
    quantised, censored = quantise_level_dbm(level_dbm)
    assert quantise_level_dbm(quantised) == (quantised, censored)
    if censored == INSIDE:
        assert abs(quantised - level_dbm) <= 0.5
    assert (censored == BELOW) == (level_dbm < -110)
    assert (censored == ABOVE) == (level_dbm >= -48)


def test_nan_stays_nan_in_a_report() -> None:
    level_dbm, censored = quantise_level_dbm([np.nan, -80.0])
    assert np.isnan(level_dbm[0])
    assert censored.tolist() == [0, 0]


def _cell(name: str, arfcn: int | None, bsic: int | None) -> Cell:
    return Cell(name, "S", 5e5, 6e6, 30, None, 50, 1800, "omni", arfcn=arfcn, bsic=bsic)


def test_neighbours_resolve_to_all_candidates_in_the_plans_order() -> None:
    cells = (_cell("B", 600, 7), _cell("A", 600, 7), _cell("C", 600, 8), _cell("D", None, None))
    plan = CellPlan("EPSG:32635", cells)
    assert resolve_neighbours(plan, 600, 7) == ("B", "A")
    assert resolve_neighbours(plan, 600, 8) == ("C",)
    assert resolve_neighbours(plan, 600, None) == ("B", "A", "C")
    assert resolve_neighbours(plan, 601, 7) == ()
    assert resolve_neighbours(plan, None, 7) == ()
