"""Which cells of a network a phone chooses between by level."""

from dataclasses import replace

import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.layers import layer_numbers, layers_of

CELL = Cell("A", "S", 5e5, 5e6, 30.0, None, 30.0, 1800.0, "omni")
OWN, OTHER, UNKNOWN = (262, 1), (262, 2), (None, None)


def numbers(technology, *cells):
    """Layers of cells by frequency, carrier and network."""
    made = [
        replace(CELL, technology=technology, frequency_mhz=mhz, arfcn=arfcn, mcc=mcc, mnc=mnc)
        for mhz, arfcn, (mcc, mnc) in cells
    ]
    return layer_numbers(made).tolist()


@pytest.mark.parametrize("technology", ["UMTS", "LTE", "NR"])
def test_cells_of_one_carrier_are_a_layer(technology):
    # Two networks do not share a carrier but by sharing the cells.
    one, other = (1800.0, 10_600, OWN), (800.0, 10_600, OTHER)
    assert numbers(technology, one, other, (1800.0, 10_650, OWN), one) == [0, 0, 1, 0]


@pytest.mark.parametrize("technology", ["UMTS", "LTE", "NR"])
def test_without_a_carrier_cells_are_told_apart_by_frequency_and_network(technology):
    cells = [(mhz, None, network) for mhz, network in ((1800.0, OWN), (800.0, OWN))]
    assert numbers(technology, *cells, (1800.0, None, OTHER), cells[0]) == [0, 1, 2, 0]


def test_a_missing_carrier_is_the_only_one_of_its_network_at_its_frequency():
    one, lacking = (806.0, 6300, OWN), (806.0, None, OWN)
    assert numbers("LTE", lacking, one, (2650.0, 3050, OWN), lacking) == [0, 0, 1, 0]
    # Of two it may be either, and at other frequencies or in other networks neither.
    assert numbers("LTE", one, lacking, (806.0, 6350, OWN)) == [0, 1, 2]
    assert numbers("LTE", one, (1800.0, None, OWN)) == [0, 1]
    assert numbers("LTE", one, (806.0, None, OTHER)) == [0, 1]
    assert numbers("LTE", one, (806.0, None, UNKNOWN)) == [0, 0]


def test_cells_of_gsm_are_a_layer_for_each_network_whatever_their_carriers():
    low, high, other = (900.0, 20, OWN), (1800.0, 700, OWN), (900.0, 20, OTHER)
    assert numbers("GSM", low, high, other) == [0, 0, 1]
    # A missing network is the only one that is known.
    assert numbers("GSM", (900.0, 21, UNKNOWN), low, (900.0, 22, (262, None))) == [0, 0, 0]
    assert numbers("GSM", (900.0, 21, UNKNOWN), low, other) == [0, 1, 2]


def test_cells_of_unknown_technology_are_a_layer():
    assert numbers(None, (900.0, 20, OWN), (1800.0, 700, OTHER), (900.0, None, UNKNOWN)) == [0] * 3


def test_technologies_are_apart():
    kinds = ("GSM", "LTE", None, "UMTS", "NR", "LTE")
    cells = [replace(CELL, technology=one, mcc=262, mnc=1) for one in kinds]
    assert layer_numbers(cells).tolist() == [0, 1, 2, 3, 4, 1]
    # A network of another technology is not that of a cell without one.
    few = [replace(CELL, technology="GSM"), replace(cells[1], technology="LTE")]
    assert layer_numbers([*few, replace(few[0], mcc=262, mnc=3)]).tolist() == [0, 1, 0]


def test_layers_of_some_cells_are_numbered_as_they_come():
    kinds = {
        "low": ("LTE", 6300),
        "old": ("GSM", None),
        "high": ("LTE", 3050),
        "twin": ("LTE", 6300),
    }
    cells = tuple(
        replace(CELL, id=name, technology=technology, arfcn=arfcn)
        for name, (technology, arfcn) in kinds.items()
    )
    assert layer_numbers(cells).tolist() == [0, 1, 2, 0]
    assert layer_numbers(()).shape == (0,)
    plan = CellPlan("EPSG:32632", cells)
    assert layers_of(plan, ("high", "twin", "other", "high", "another")) == (0, 1, 2, 0, 2)
    assert layers_of(plan, ()) == ()


def test_what_a_cell_lacks_is_looked_up_in_the_whole_plan():
    """Also where only that cell and another one are received."""
    cells = tuple(
        replace(CELL, id=name, technology="LTE", frequency_mhz=mhz, arfcn=arfcn)
        for name, mhz, arfcn in (("a", 806.0, None), ("b", 806.0, 6300), ("c", 806.0, None))
    )
    assert layers_of(CellPlan("EPSG:32632", cells), ("c", "a")) == (0, 0)
    assert layers_of(CellPlan("EPSG:32632", cells), ("c", "b")) == (0, 0)


def test_a_cell_that_states_a_part_of_another_network_is_not_filled_in():
    cells = [(806.0, 6300, OWN), (806.0, None, (None, 2)), (806.0, None, (None, 1)),
             (806.0, None, (310, None))]  # fmt: skip
    assert numbers("LTE", *cells) == [0, 1, 0, 2]
