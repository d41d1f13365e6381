"""What a program gives to a filter beside epochs, and tables with points, by hand."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.place_tables import with_points
from mapfilter.positioning.step_arguments import (
    check_generator,
    check_kinds_given,
    check_later,
    check_state_kind,
    check_step,
)

RNG = np.random.default_rng(0)
STATE = SimpleNamespace(time_s=10.0)


def fault_of(check, *given):
    with pytest.raises(InputError) as caught:
        check(*given)
    (fault,) = caught.value.faults
    return fault


@pytest.mark.parametrize("kinds", [(), ["motion"], {"motion", "gnss"}])
def test_kinds_that_are(kinds):
    check_kinds_given(kinds)


@pytest.mark.parametrize(
    ("kinds", "got"),
    [("motion", "'motion'"), (["motion", "moton", 3, "gps"], "'moton', 3, 'gps'"), (7, "7")],
)
def test_kinds_that_are_none_are_all_named(kinds, got):
    fault = fault_of(check_kinds_given, kinds)
    assert (fault.where, fault.got) == ("kinds", got)
    assert fault.expected.startswith("a collection of ")
    assert "gnss, " in fault.expected


def test_a_state_is_one_of_its_class():
    check_state_kind(STATE, SimpleNamespace)
    fault = fault_of(check_state_kind, STATE, Epoch)
    assert fault.where == "state"
    assert fault.expected == "a state of this filter, of begin or step"
    assert fault.got == "a SimpleNamespace"


def test_time_does_not_go_backwards():
    for last_s in (9.0, 10.0, float("nan")):
        check_later(Epoch(10.0), last_s)
    fault = fault_of(check_later, Epoch(9.5), 10.0)
    assert (fault.where, fault.got) == ("epoch, time_s", "9.5")
    assert fault.expected == "10.0 or later, as the epoch before is of that time"
    assert "begin anew after a pause" in fault.hint


def test_a_seed_is_no_generator():
    check_generator(RNG)
    fault = fault_of(check_generator, 3)
    assert (fault.where, fault.expected, fault.got) == ("rng", "a numpy.random.Generator", "3")
    assert fault.hint == "numpy.random.default_rng(seed), once for all"


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"epoch": None}, "epoch"),
        ({"kind": Epoch}, "state"),
        ({"epoch": Epoch(9.0)}, "epoch, time_s"),
        ({"rng": 3}, "rng"),
    ],
)
def test_a_step_checks_all_that_it_is_given(changes, where):
    given = {"state": STATE, "kind": SimpleNamespace, "epoch": Epoch(10.0), "rng": RNG}
    check_step(**given)
    assert fault_of(check_step, *(given | changes).values()).where == where


def test_rows_without_a_position_have_no_point():
    table = pd.DataFrame(
        {"east_m": [500_000.0, np.nan, 500_010.0], "north_m": [1.0, np.nan, 2.0], "n": [4, 5, 6]},
        index=[7, 8, 9],
    )
    found = with_points(table, "EPSG:32629")
    assert found.index.tolist() == [0, 1]
    assert found["n"].tolist() == [4, 6]
    assert [(one.x, one.y) for one in found.geometry] == [(500_000.0, 1.0), (500_010.0, 2.0)]
    assert found.crs.to_epsg() == 32629
    assert table.shape == (3, 3)
