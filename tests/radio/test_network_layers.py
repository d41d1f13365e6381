"""Which cells of a network a phone chooses between by level."""

from dataclasses import replace

import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.layers import layer_numbers, layer_of, layers_of

CELL = Cell("A", "S", 5e5, 5e6, 30.0, None, 30.0, 1800.0, "omni")


def cell(technology, mhz=1800.0, arfcn=None, mnc=1, name="A"):
    return replace(
        CELL, id=name, technology=technology, frequency_mhz=mhz, arfcn=arfcn, mcc=262, mnc=mnc
    )


@pytest.mark.parametrize("technology", ["UMTS", "LTE", "NR"])
def test_cells_of_one_carrier_are_a_layer(technology):
    one = cell(technology, arfcn=10_600)
    # Two networks do not share a carrier but by sharing the cells.
    assert layer_of(one) == layer_of(cell(technology, 800.0, arfcn=10_600, mnc=2))
    assert layer_of(one) != layer_of(cell(technology, arfcn=10_650))
    unknown = cell(technology)
    assert layer_of(unknown) == layer_of(cell(technology))
    assert layer_of(unknown) != layer_of(cell(technology, 800.0))
    assert layer_of(unknown) != layer_of(cell(technology, mnc=2))
    assert layer_of(unknown) != layer_of(one)


def test_cells_of_gsm_are_a_layer_whatever_their_carriers():
    one = cell("GSM", 900.0, arfcn=20)
    assert layer_of(one) == layer_of(cell("GSM", 1800.0, arfcn=700))
    assert layer_of(one) != layer_of(cell("GSM", 900.0, arfcn=20, mnc=2))
    assert layer_of(one) != layer_of(cell("LTE", 900.0))
    assert layer_of(cell(None, 900.0, 20)) == layer_of(cell(None, 1800.0, 700, mnc=2))


def test_layers_are_numbered_in_the_order_of_their_first_cells():
    cells = [
        cell("LTE", 800.0, 6300, name="low"),
        cell("GSM", 900.0, name="old"),
        cell("LTE", 2600.0, 3050, name="high"),
        cell("LTE", 800.0, 6300, name="low too"),
    ]
    assert layer_numbers(cells).tolist() == [0, 1, 2, 0]
    assert layer_numbers([]).shape == (0,)
    plan = CellPlan("EPSG:32632", tuple(cells))
    assert layers_of(plan, ("high", "low too", "other", "high", "another")) == (0, 1, 2, 0, 2)
    assert layers_of(plan, ()) == ()
