"""The ends of what each value of an epoch may be, and what is said beyond them, by hand."""

from dataclasses import replace
from math import inf, nan, nextafter, pi

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning import epoch_checks
from mapfilter.positioning.epoch_checks import check_epoch
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow

FULL = Epoch(
    10.0,
    (MotionStep(1.4, 0.3, 0.1),),
    (ReportRow("serving", "A", 60, 1, -70.0, 0, 3.0),),
    GnssFix(5.0, 6.0, 9.0, 8.0, 1.0),
    (Pseudorange("G07", 2.2e7, 5.0, (2.6e7, 0.0, 0.0)),),
    (Difference("A", "B", 40.0, 10.0),),
)
TURN = 2 * pi + 1e-9
"""With what a turn in degrees may be rounded by."""
ENDS = {
    "motion": {
        "step_m": (-1e6, 1e6), "heading_rad": (-TURN, TURN), "turn_rad": (-TURN, TURN),
        "spread_m": (0.0, inf), "sampling_sd_m": (0.0, 1e6), "turned_sd_rad": (0.0, 1e6),
        "rows": (1, 1_000_000),
    },
    "radio": {
        "arfcn": (0, 3_279_165), "bsic": (0, 1007), "level_dbm": (-200.0, 0.0),
        "censored": (-1, 1), "timing_advance": (0.0, 3846.0),
    },
    "gnss": {
        "var_east_m2": (0.0, 1e16), "var_north_m2": (0.0, 1e16),
        "cov_east_north_m2": (-1e16, 1e16),
    },
    "pseudoranges": {"pseudorange_m": (-1e12, 1e12), "sigma_m": (1e-3, 1e5)},
    "tdoa": {
        "difference_m": (-2e5, 2e5), "sigma_m": (1e-3, 1e5), "reference_sigma_m": (1e-3, 1e5),
    },
}  # fmt: skip
WHOLE = ("arfcn", "bsic", "censored", "rows")
NEVER_MISSING = ("sampling_sd_m", "turned_sd_rad", "rows")
FIELDS = [(part, name) for part, names in ENDS.items() for name in names]


def changed(part, **values):
    """The full epoch with other values in a row of its own."""
    given = getattr(FULL, part)
    row = replace(given[0] if isinstance(given, tuple) else given, **values)
    return replace(FULL, **{part: (row,) if isinstance(given, tuple) else row})


def where(part, name):
    return f"epoch, {part}.{name}" if part == "gnss" else f"epoch, {part}[0].{name}"


@pytest.fixture
def quick(monkeypatch):
    """What is well is so at the first look, or all epochs would take longer."""
    monkeypatch.setattr(epoch_checks, "Faults", None)


def fault_of(epoch):
    with pytest.raises(InputError) as caught:
        check_epoch(epoch)
    (fault,) = caught.value.faults
    return fault


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("part", "name"), FIELDS)
def test_both_ends_are_well(part, name):
    for value in ENDS[part][name]:
        check_epoch(changed(part, **{name: value}))
    if name not in WHOLE and name not in NEVER_MISSING:
        check_epoch(changed(part, **{name: nan}))


@pytest.mark.parametrize(("part", "name"), FIELDS)
def test_beyond_either_end_it_is_a_fault(part, name):
    low, high = ENDS[part][name]
    beyond = [(low, -inf), (high, inf)] if high < inf else [(low, -inf)]
    for end, away in beyond:
        value = int(end + np.sign(away)) if name in WHOLE else nextafter(end, away)
        for wrong in (value, away):
            fault = fault_of(changed(part, **{name: wrong}))
            assert fault.where == where(part, name)
    if name in NEVER_MISSING:
        assert fault_of(changed(part, **{name: nan})).where == where(part, name)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("name", ["arfcn", "bsic", "censored", "cell"])
def test_what_a_report_may_lack(name):
    check_epoch(changed("radio", **{name: None}))


@pytest.mark.usefixtures("quick")
def test_positions_and_places_of_satellites_that_are_well():
    for value in (nan, inf, -1e9):
        check_epoch(changed("gnss", east_m=value, north_m=value))
    for axis in range(3):
        for value in (-6e7, 6e7, nan):
            place = [0.0, 0.0, 0.0]
            place[axis] = value
            check_epoch(changed("pseudoranges", place_m=tuple(place)))
    check_epoch(replace(FULL, gnss=None))
    check_epoch(changed("radio", role="neighbour"))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("value", [nextafter(-6e7, -inf), nextafter(6e7, inf), inf])
def test_no_satellite_is_farther_away(axis, value):
    place = [0.0, 0.0, 0.0]
    place[axis] = value
    fault = fault_of(changed("pseudoranges", place_m=tuple(place)))
    assert fault.where == f"epoch, pseudoranges[0].place_m, {'xyz'[axis]}_m"


@pytest.mark.parametrize("time_s", [-1e11, 1e11])
def test_the_time_of_an_epoch(time_s):
    check_epoch(replace(FULL, time_s=time_s))
    for wrong in (nextafter(time_s, 2 * time_s), nan, "10", None):
        assert fault_of(replace(FULL, time_s=wrong)).where == "epoch, time_s"


@pytest.mark.parametrize(
    ("part", "name", "value", "expected"),
    [
        ("radio", "role", "server", "serving or neighbour"),
        ("radio", "role", None, "serving or neighbour"),
        ("radio", "cell", 7, "a cell id"),
        ("pseudoranges", "satellite", None, "a name such as G07 or E19"),
        ("tdoa", "cell", None, "a cell id"),
        ("tdoa", "reference", 7, "a cell id"),
        ("radio", "arfcn", "60", "a carrier number"),
        ("radio", "level_dbm", None, "dBm in -200..0"),
        ("radio", "timing_advance", None, "steps in 0..3846"),
        ("gnss", "east_m", None, "metres east"),
        ("motion", "rows", None, "a number of measured steps, 1 or more"),
        ("motion", "spread_m", -0.5, "metres >= 0"),
    ],
)
def test_what_was_expected_is_said(part, name, value, expected):
    fault = fault_of(changed(part, **{name: value}))
    assert (fault.where, fault.expected) == (where(part, name), expected)


def test_hints_are_of_the_value():
    """None stands for what is missing in texts and whole numbers, NaN in others."""
    for part, name, value, hint in (
        ("radio", "level_dbm", None, "give NaN where it was not measured"),
        ("motion", "sampling_sd_m", None, ""),
        ("radio", "cell", 7, "None where it is not known"),
        ("motion", "step_m", "1.4", "a text given for a number"),
        ("motion", "step_m", b"1.4", "a text given for a number"),
    ):
        assert fault_of(changed(part, **{name: value})).hint == hint


def test_every_fault_is_said_with_the_number_of_its_row():
    rows = (STEP, replace(STEP, step_m=2e6), replace(STEP, heading_rad=7.0))
    report = (*FULL.radio, replace(FULL.radio[0], bsic=-1))
    with pytest.raises(InputError) as caught:
        check_epoch(replace(FULL, time_s=nan, motion=rows, radio=report, tdoa=(STEP,)))
    assert [fault.where for fault in caught.value.faults] == [
        "epoch, time_s", "epoch, motion[1].step_m", "epoch, motion[2].heading_rad",
        "epoch, radio[1].bsic", "epoch, tdoa[0]",
    ]  # fmt: skip


STEP = FULL.motion[0]


@pytest.mark.parametrize("given", [None, (10.0,), "epoch"])
def test_an_epoch_is_one(given):
    fault = fault_of(given)
    assert (fault.where, fault.expected) == ("epoch", "an Epoch")


@pytest.mark.parametrize("place", [None, (1.0, 2.0), (1.0, 2.0, 3.0, 4.0), "xyz", np.zeros((1, 3))])
def test_a_place_is_three_numbers(place):
    fault = fault_of(changed("pseudoranges", place_m=place))
    assert fault.where.startswith("epoch, pseudoranges[0].place_m")


ARRAY = np.array([2.0])


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ("motion", "step_m", ARRAY),
        ("gnss", "east_m", ARRAY),
        ("tdoa", "difference_m", ARRAY),
        ("radio", "timing_advance", ARRAY),
        ("radio", "arfcn", ARRAY),
        ("pseudoranges", "place_m", (0.0, ARRAY, 0.0)),
    ],
)
def test_an_array_of_one_number_is_no_number(part, name, value):
    """It compares as one does."""
    assert fault_of(changed(part, **{name: value})).where.startswith(where(part, name))


@pytest.mark.parametrize("name", ["east_m", "north_m"])
@pytest.mark.parametrize("value", [ARRAY, [5.0], {}, object(), 1j])
def test_a_position_of_no_number_is_refused(name, value):
    """Any number may be one, infinity, too."""
    fault = fault_of(changed("gnss", **{name: value}))
    assert fault.where == f"epoch, gnss.{name}"
    assert fault.expected == f"metres {name.removesuffix('_m')}"


@pytest.mark.parametrize("given", ["step", b"step", iter([STEP]), {STEP.step_m}, None, 3])
@pytest.mark.parametrize(
    ("name", "kind"),
    [("motion", "MotionStep"), ("radio", "ReportRow"), ("tdoa", "Difference")],
)
def test_rows_are_a_sequence(name, kind, given):
    fault = fault_of(replace(FULL, **{name: given}))
    assert (fault.where, fault.expected) == (f"epoch, {name}", f"a tuple of {kind}")
