"""Errors in a custom filter: which are named with file and line, and which are passed on."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

from mapfilter.errors import ConfigError, InputError, StoreError, fail
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.custom_filter import CustomEpochFilter, custom_filter
from mapfilter.positioning.step_output import Fix, StepOutput
from mapfilter.positioning.user_errors import wrap_user_errors


class Own:
    """A filter of this file."""

    def call(self, function):
        return function()


def raised(error):
    def function():
        raise error

    return function


@pytest.mark.parametrize("kind", [InputError, StoreError, ConfigError])
def test_errors_of_ours_are_passed_on_as_they_are(kind):
    """They say already where, and what was expected."""
    ours = fail(kind, "cells.csv", "a table", "none")
    with pytest.raises(kind) as caught, wrap_user_errors("package:Own", Own()):
        raise ours
    assert caught.value is ours


def test_what_goes_well_is_left_alone():
    with wrap_user_errors("package:Own", Own()):
        found = Own().call(lambda: 3)
    assert found == 3


@pytest.mark.parametrize("owner", [Own, Own()], ids=["class", "object"])
def test_an_error_is_named_with_the_last_line_of_its_owners_file(owner):
    """Not that of a library that it has called; the message is of one line."""
    with (
        pytest.raises(ConfigError) as caught,
        wrap_user_errors("package:Own", owner),
    ):
        Own().call(lambda: json.loads("{"))
    (fault,) = caught.value.faults
    assert fault.where.startswith("filter package:Own, test_own_filter_errors.py line ")
    assert fault.where.endswith("in <lambda>")
    assert fault.got.startswith("JSONDecodeError: Expecting property name")
    assert isinstance(caught.value.__cause__, json.JSONDecodeError)
    with (
        pytest.raises(ConfigError, match=r"ValueError: one two \(likely"),
        wrap_user_errors("package:Own", owner),
    ):
        Own().call(raised(ValueError("one\n  two")))


def test_a_name_of_a_module_is_where_its_lines_are_looked_for():
    with pytest.raises(ConfigError) as caught, wrap_user_errors(f"{__name__}:Own"):
        Own().call(lambda: json.loads("{"))
    assert ", test_own_filter_errors.py line " in caught.value.faults[0].where


def test_without_lines_of_its_own_the_last_of_all_is_named():
    """As of a filter whose file is not known, which calls a library."""
    with pytest.raises(ConfigError) as caught, wrap_user_errors("no_such_module:F"):
        json.loads("{")
    assert ", decoder.py line " in caught.value.faults[0].where
    assert "in raw_decode" in caught.value.faults[0].where


def test_a_name_whose_module_has_no_file_has_an_empty_text():
    assert custom_filter("time:time").source_sha256 == sha256(b"").hexdigest()


FROM_ELSEWHERE = json.loads
"""Called with a database, it would make a filter."""


def test_the_text_is_that_of_the_module_in_which_a_filter_stands():
    text = Path(json.__file__).read_bytes()
    assert custom_filter(f"{__name__}:FROM_ELSEWHERE").source_sha256 == sha256(text).hexdigest()


class Plain:
    """A filter over epochs, which cannot be prepared, and shows nothing but its outputs."""

    def begin(self, kinds):
        return f"begun with {len(kinds)}"

    def step(self, state, epoch, rng):
        assert (epoch, rng) == ("epoch", "rng")
        return f"{state}, stepped", OUTPUT


class Whole(Plain):
    """One that has all that a filter may have."""

    uses = ("motion",)
    prepared = None

    def warm_up(self, merged):
        self.prepared = merged

    def smoother(self):
        return "smoother"

    def hypotheses(self, state):
        return f"hypotheses of {state}"


OUTPUT = StepOutput(Fix.nowhere(3.0, Status.SEARCHING, Reason.USED))


def test_a_filter_over_epochs_is_asked_for_what_it_has():
    plain, whole = (CustomEpochFilter(one(), "package:Own", "EPSG:32632") for one in (Plain, Whole))
    assert (plain.name, plain.crs) == ("package:Own", "EPSG:32632")
    assert (whole.uses, set(plain.uses) > {"motion", "serving"}) == (("motion",), True)
    for one in (plain, whole):
        one.warm_up(["merged"])
        assert one.begin(("motion", "gnss")) == "begun with 2"
        assert one.step("state", "epoch", "rng") == ("state, stepped", OUTPUT)
    assert whole.filter.prepared == ["merged"]
    assert (plain.smoother(), whole.smoother()) == (None, "smoother")
    assert (plain.hypotheses("state"), whole.hypotheses("state")) == (None, "hypotheses of state")


def test_a_step_without_an_output_breaks_the_contract():
    own = Plain()
    own.step = lambda *_: ("state", "no output")
    with pytest.raises(ConfigError, match=r"step: expected it to return \(state, StepOutput\)"):
        CustomEpochFilter(own, "package:Own", "EPSG:32632").step("state", "epoch", "rng")


def test_a_status_of_a_step_is_no_text():
    own = Plain()
    fix = replace(Fix.nowhere(3.0, Status.SEARCHING, Reason.USED), status="SEARCHING")
    own.step = lambda *_: ("state", StepOutput(fix))
    with pytest.raises(
        ConfigError, match="step: expected it to return a Status, found 'SEARCHING'"
    ):
        CustomEpochFilter(own, "package:Own", "EPSG:32632").step("state", "epoch", "rng")


@pytest.mark.parametrize("name", ["warm_up", "smoother", "hypotheses", "begin"])
def test_errors_in_any_part_of_a_filter_are_named(name):
    def failing(*_):
        raise ValueError("no luck")

    own = Whole()
    setattr(own, name, failing)
    given = () if name == "smoother" else ("given",)
    with pytest.raises(ConfigError, match="no luck"):
        getattr(CustomEpochFilter(own, "package:Own", "EPSG:32632"), name)(*given)
