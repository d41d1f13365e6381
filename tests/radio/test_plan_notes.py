"""Notes on plans: usual values, powers that phones do not report, and layers."""

from dataclasses import replace

import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.plan_notes import assumed_notes, carrier_notes, layer_notes

CRS = "EPSG:32632"
GSM = Cell("a", "s", 500_000.0, 5_000_000.0, 30.0, 90.0, 58.0, 900.0, "sector", technology="GSM")
LTE = replace(GSM, id="b", technology="LTE", frequency_mhz=1800.0)


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        ([GSM], 0),
        ([replace(LTE, eirp_dbm=46.0)], 0),
        ([GSM, LTE, replace(LTE, id="c", technology="NR")], 2),
        ([replace(GSM, technology=None)], 0),
    ],
)
def test_powers_of_whole_carriers_are_noted(cells, told):
    notes = carrier_notes(CellPlan(CRS, tuple(cells)))
    assert len(notes) == bool(told)
    assert all(note.startswith(f"eirp_dbm of {told} cells is that of a carrier") for note in notes)


def test_usual_values_are_counted():
    cells = (
        GSM,
        replace(LTE, assumed="height_m eirp_dbm", eirp_dbm=28.5),
        replace(LTE, id="c", assumed="height_m", eirp_dbm=28.5),
    )
    (note,) = assumed_notes(CellPlan(CRS, cells))
    assert "eirp_dbm of 1, height_m of 2 cells" in note
    assert assumed_notes(CellPlan(CRS, (GSM,))) == ()


def test_several_layers_are_counted_and_unknown_technologies_of_several_bands_named():
    low, high = replace(LTE, frequency_mhz=800.0), replace(LTE, id="c", arfcn=3050)
    assert layer_notes(CellPlan(CRS, (LTE, replace(LTE, id="c")))) == ()
    (note,) = layer_notes(CellPlan(CRS, (GSM, low, high)))
    assert note.startswith("3 layers")
    unknown = [
        replace(GSM, id=f"u{mhz}", technology=None, frequency_mhz=mhz) for mhz in (900.0, 1000.0)
    ]
    assert layer_notes(CellPlan(CRS, tuple(unknown))) == ()
    wide = (*unknown, replace(unknown[0], id="w", frequency_mhz=1842.5))
    (note,) = layer_notes(CellPlan(CRS, wide))
    assert note.startswith("technology of 3 cells is unknown, at 900 to 1842.5 MHz")
    alone = [replace(LTE, id=f"l{k}", arfcn=1300 + 50 * k) for k in range(3)]
    (few,), (many, lonely) = (layer_notes(CellPlan(CRS, tuple(alone[:k]))) for k in (2, 3))
    assert (few[:8], many[:8]) == ("2 layers", "3 layers")
    assert lonely.startswith("each of 3 cells of LTE has a carrier")
    pair = (*alone, replace(alone[0], id="twin"))
    assert len(layer_notes(CellPlan(CRS, pair))) == 1
    first, second = layer_notes(CellPlan(CRS, (*wide, low)))
    assert (first.startswith("2 layers"), second) == (True, note)
    assert layer_notes(CellPlan(CRS, ())) == ()
