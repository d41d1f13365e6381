"""The RXLEV scale and the identity of neighbours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.rxlev import (
    HIGHEST_LEVEL_DBM,
    LOWEST_LEVEL_DBM,
    Censored,
    censored_from_rxlev,
    level_dbm_from_rxlev,
    quantise_level_dbm,
    resolve_neighbours,
    rxlev_from_level_dbm,
)


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
    assert rxlev_from_level_dbm(level_dbm) == rxlev


@given(st.integers(1, 62))
def test_bin_centres_are_fixed_points(n: int) -> None:
    centre = level_dbm_from_rxlev(n)
    assert centre == -110.5 + n
    assert rxlev_from_level_dbm(centre) == n
    assert censored_from_rxlev(n) == Censored.INSIDE


@given(st.floats(-200, 50))
def test_quantising_is_idempotent_and_within_half_a_decibel(level_dbm: float) -> None:
    quantised, censored = quantise_level_dbm(level_dbm)
    assert quantise_level_dbm(quantised) == (quantised, censored)
    if censored == Censored.INSIDE:
        assert abs(quantised - level_dbm) <= 0.5
    assert (censored == Censored.BELOW) == (level_dbm < LOWEST_LEVEL_DBM)
    assert (censored == Censored.ABOVE) == (level_dbm >= HIGHEST_LEVEL_DBM)


def test_nan_stays_nan_in_a_report_but_has_no_rxlev() -> None:
    level_dbm, censored = quantise_level_dbm([np.nan, -80.0])
    assert np.isnan(level_dbm[0])
    assert censored.tolist() == [0, 0]
    with pytest.raises(InputError, match="NaN"):
        rxlev_from_level_dbm([np.nan])


@pytest.mark.parametrize("wrong", [-1, 64, 3.5, np.nan])
def test_values_off_the_scale_are_refused(wrong: float) -> None:
    with pytest.raises(InputError, match=r"0\.\.63"):
        level_dbm_from_rxlev([10, wrong])


def test_dbm_given_for_rxlev_is_named() -> None:
    with pytest.raises(InputError, match="dBm given for RXLEV"):
        level_dbm_from_rxlev(-80)


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
