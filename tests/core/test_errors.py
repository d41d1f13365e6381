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
    faults = Faults()
    for row in range(count):
        faults.add(f"row {row}", "a number", "text")
    with pytest.raises(StoreError) as caught:
        faults.raise_if_any(StoreError)
    shown = str(caught.value).splitlines()
    assert len(caught.value.faults) == count
    assert len(shown) == lines
    assert shown[19 if count > 20 else -1].startswith("row 19" if count > 19 else "row 18")
    if count > 20:
        assert shown[-1] == f"… and {count - 20} more faults"


@pytest.mark.parametrize("kind", KINDS)
def test_errors_of_every_kind_are_caught_by_their_base_and_come_back_from_workers(kind):
    error = fail(kind, "here", "this", 3.5, "that")
    assert isinstance(error, MapfilterError)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), again.faults, str(again)) == (kind, error.faults, str(error))
