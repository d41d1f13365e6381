"""Faults: all of them together, each as one line that tells where and what."""

import pickle

import pytest

from mapfilter.errors import (
    ConfigError,
    Fault,
    Faults,
    InputError,
    MapfilterError,
    OutputError,
    StoreError,
    fail,
)

KINDS = [ConfigError, InputError, StoreError, OutputError]


def test_a_fault_is_one_line_with_its_likely_mistake_where_there_is_one():
    fault = Fault("cells.csv row 3, lat", "degrees", "4.5e6", "metres given for degrees")
    line = "cells.csv row 3, lat: expected degrees, found 4.5e6"
    assert str(fault) == f"{line} (likely: metres given for degrees)"
    assert str(Fault("cells.csv row 3, lat", "degrees", "4.5e6")) == line


def test_all_faults_come_together_in_the_order_found():
    faults = Faults()
    faults.add("a", "1", 2)
    faults.add("b", "x", None, "left out")
    with pytest.raises(InputError) as caught:
        faults.raise_if_any(InputError)
    assert caught.value.faults == (Fault("a", "1", "2"), Fault("b", "x", "None", "left out"))
    assert str(caught.value).splitlines() == [
        "a: expected 1, found 2",
        "b: expected x, found None (likely: left out)",
    ]


def test_no_fault_raises_nothing_and_collectors_are_apart():
    other = Faults()
    other.add("a", "1", 2)
    Faults().raise_if_any(InputError)


@pytest.mark.parametrize(("count", "lines"), [(19, 19), (20, 20), (21, 21), (500, 21)])
def test_twenty_faults_are_shown_and_the_rest_are_counted(count, lines):
    names = [f"{a}{b}" for a in "abcdefghijklmnopqrstuvwxyz" for b in "abcdefghijklmnopqrst"]
    error = StoreError(tuple(Fault(name, "a number", "text") for name in names[:count]))
    shown = str(error).splitlines()
    assert len(error.faults) == count
    assert len(shown) == lines
    assert shown[min(count, 20) - 1].startswith(names[min(count, 20) - 1])
    if count > 20:
        assert shown[-1] == f"… and {count - 20} more {'fault' if count == 21 else 'faults'}"


def test_of_faults_that_differ_in_their_numbers_three_are_shown():
    faults = [Fault(f"cells.csv row {row}, lat", "degrees", f"{row}e6") for row in range(2, 17)]
    faults.insert(5, Fault("cells.csv row 6, lon", "degrees", "x"))
    assert str(InputError(tuple(faults))).splitlines() == [
        "cells.csv row 2, lat: expected degrees, found 2e6",
        "cells.csv row 3, lat: expected degrees, found 3e6",
        "cells.csv row 4, lat: expected degrees, found 4e6 … and 12 more like this",
        "cells.csv row 6, lon: expected degrees, found x",
    ]


def test_faults_beyond_the_twentieth_line_are_counted_not_their_lines():
    letters = "abcdefghijklmnopqrstuvwxyz"
    faults = [Fault(f"{name} row {row}", "1", "2") for name in letters for row in range(10)]
    shown = str(InputError(tuple(faults))).splitlines()
    assert len(shown) == 6 * 3 + 1
    assert shown[-1] == f"… and {20 * 10} more faults"


@pytest.mark.parametrize("kind", KINDS)
def test_errors_of_every_kind_are_caught_by_their_base_and_come_back_from_workers(kind):
    error = fail(kind, "here", "this", 3.5, "that")
    assert isinstance(error, MapfilterError)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), again.faults, str(again)) == (kind, error.faults, str(error))
