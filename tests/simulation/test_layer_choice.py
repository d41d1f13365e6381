"""Which layer of a network serves a simulated phone, by hand and against what must hold."""

from dataclasses import replace

import numpy as np
import pandas as pd
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.simulation.layer_choice import layers_by_priority, layers_served
from mapfilter.simulation.reports import ReportModel, reports

EXACT = ReportModel(averaging_s=0.0, fading_db=0.0, quantise=False, sensitivity_dbm=-104.0)
CELL = Cell("A", "S", 0.0, 0.0, 30.0, None, 30.0, 950.0, "omni")


def plan_of(*kinds):
    """Cells of a technology, a frequency and a carrier each, named by their order."""
    return CellPlan(
        "EPSG:32629",
        tuple(
            replace(CELL, id=f"C{k}", technology=kind, frequency_mhz=mhz, arfcn=arfcn, bsic=k)
            for k, (kind, mhz, arfcn) in enumerate(kinds)
        ),
    )


def radio_of(sequence, plan, model=EXACT):
    truth = pd.DataFrame({"time_s": np.arange(float(len(sequence))), "east_m": 0.0, "north_m": 0.0})
    level = np.asarray(sequence, dtype=float)
    return reports(truth, lambda *_: level, plan, model, np.random.default_rng(1))


def serving_of(radio):
    return radio.loc[radio["role"] == "serving", "cell"].tolist()


def test_the_newest_technology_comes_first_and_then_the_highest_frequency():
    kinds = [
        ("GSM", 950.0, 10), ("LTE", 806.0, 6300), ("UMTS", 2112.0, 10562), ("NR", 763.0, 152600),
        ("LTE", 1815.0, 1300), (None, 900.0, None), ("GSM", 945.0, 50), ("LTE", 1815.0, 1300),
    ]  # fmt: skip
    assert layers_by_priority(plan_of(*kinds)).tolist() == [4, 2, 3, 0, 1, 5, 4, 1]


def test_a_phone_is_on_the_weaker_carrier_until_that_has_not_enough():
    plan = plan_of(("LTE", 806.0, 6300), ("LTE", 1815.0, 1300))
    sequence = [
        (-60, -90),  # the higher frequency, though 30 dB weaker
        (-60, -94),  # exactly 10 dB above the sensitivity
        (-60, -94.1),  # left
        (-60, -92),  # not back before 4 dB more
        (-60, -90.1),
        (-60, -90),  # back
        (-102, -99),  # neither has enough: it stays
        (-94.5, -99),  # another is more than 4 dB stronger
        (-99, -95),  # within the hysteresis
        (-99, -94),  # enough, which the other has not
    ]
    expected = ["C1", "C1", "C0", "C0", "C0", "C1", "C1", "C0", "C0", "C1"]
    assert serving_of(radio_of(sequence, plan)) == expected


def test_neighbours_are_of_the_serving_layer():
    plan = plan_of(("LTE", 806.0, 6300), ("LTE", 1815.0, 1300), ("LTE", 1815.0, 1300),
                   ("LTE", 806.0, 6300))  # fmt: skip
    radio = radio_of([(-60, -90, -92, -65), (-60, -100, -98, -65)], plan)
    assert serving_of(radio) == ["C1", "C0"]
    others = radio[radio["role"] == "neighbour"]
    assert others["arfcn"].tolist() == [1300, 6300]
    assert others["level_dbm"].tolist() == [-92.0, -65.0]


def test_as_predicted_has_no_memory():
    plan = plan_of(("LTE", 806.0, 6300), ("LTE", 1815.0, 1300))
    model = replace(EXACT, radio="as_predicted")
    sequence = [(-60, -90), (-60, -95), (-60, -94), (-99, -98), (-97, -98)]
    assert serving_of(radio_of(sequence, plan, model)) == ["C1", "C0", "C1", "C1", "C0"]


def test_in_one_layer_the_strongest_serves_as_ever():
    plan = plan_of(("LTE", 1815.0, 1300), ("LTE", 1815.0, 1300))
    radio = radio_of([(-60, -90), (-101, -95), (-103, -102)], plan)
    assert serving_of(radio) == ["C0", "C1", "C1"]


@given(
    arrays(float, (12, 4), elements=st.floats(-120, -50)),
    st.lists(st.integers(0, 2), min_size=4, max_size=4),
    st.floats(0, 10),
)
def test_a_preferred_layer_with_enough_is_never_passed_over(mean, layer, hysteresis_db):
    layer = np.unique(layer, return_inverse=True)[1]
    received = mean >= -104.0
    served = layers_served(mean, received, layer, -94.0, hysteresis_db)
    for level, got, now in zip(mean, received, served, strict=True):
        best = [np.max(level[(layer == k) & got], initial=-np.inf) for k in range(layer.max() + 1)]
        assert all(one < -94.0 + hysteresis_db for one in best[:now])
        if best[now] < -94.0:
            assert max(best) < -94.0
            assert max(best) <= best[now] + hysteresis_db or not got.any()
