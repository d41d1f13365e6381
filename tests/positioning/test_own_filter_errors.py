"""Errors in a custom filter: which are named with file and line, and which are passed on."""

import json

import pytest

from mapfilter.errors import ConfigError, InputError, StoreError, fail
from mapfilter.positioning.custom_filter import wrap_user_errors


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
