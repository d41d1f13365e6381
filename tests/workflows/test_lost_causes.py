"""The note on a log that was lost names causes that its own readings can have, and no others."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.filters.contract import Status
from mapfilter.tracks.log import make_log
from mapfilter.workflows.replays.lacks import early_end_note

TIME_S = np.arange(20.0)
MOTION = pd.DataFrame({"time_s": TIME_S, "step_m": 1.4, "heading_rad": 0.0})
EXACT = pd.DataFrame({"time_s": TIME_S, "lat_deg": 50.08, "lon_deg": 14.42 + 2e-5 * TIME_S})
ROUNDED = EXACT.assign(lon_deg=(14.42 + 2e-3 * TIME_S).round(3))
TDOA = pd.DataFrame({"time_s": TIME_S, "cell": "A", "reference": "B", "difference_m": 100.0})
USES = ("motion", "gnss", "tdoa")
OF_MOTION = "steps in another unit, turns the other way round"
OF_POSITIONS = "another journey, positions whose latitude and longitude are swapped"
OF_DIFFERENCES = "time differences of a site whose clock is off, or without line of sight"


def lost(uses=USES, over_map=True, **tables):
    status = [Status.TRACKING] * 5 + [Status.LOST] * 195
    estimate = SimpleNamespace(status=status, time_s=np.arange(200.0), unused=())
    log = make_log("EPSG:32633", **tables)
    opened = SimpleNamespace(sensors={}, log=log)
    (note,) = early_end_note(opened, log, estimate, uses, over_map=over_map)
    head, _, likely = note.partition(" (likely: ")
    assert head == (
        "located until 4 s, rows go on until 199 s: LOST from there on, as the readings "
        "contradict the position"
    )
    return likely.removesuffix(")")


@pytest.mark.parametrize(
    ("tables", "likely"),
    [
        ({"gnss": EXACT}, f"{OF_MOTION}, {OF_POSITIONS}, or ways that the map lacks"),
        ({"tdoa": TDOA}, f"{OF_MOTION}, {OF_DIFFERENCES}, or ways that the map lacks"),
        (
            {"gnss": EXACT, "tdoa": TDOA},
            f"{OF_MOTION}, {OF_POSITIONS}, {OF_DIFFERENCES}, or ways that the map lacks",
        ),
        ({}, ""),
    ],
    ids=["positions", "differences", "both", "neither"],
)
def test_causes_are_those_of_what_was_measured(tables, likely):
    assert lost(motion=MOTION, **tables) == likely


def test_positions_of_few_decimals_are_a_cause():
    found = lost(motion=MOTION, gnss=ROUNDED, over_map=False)
    assert found == f"{OF_MOTION}, {OF_POSITIONS}, or positions in degrees of few decimals"
    assert "decimals" not in lost(motion=MOTION, gnss=EXACT)


def test_what_the_filter_does_not_use_is_no_cause():
    tables = {"motion": MOTION, "gnss": ROUNDED, "tdoa": TDOA}
    assert lost(uses=("motion", "gnss"), over_map=False, **tables) == (
        f"{OF_MOTION}, {OF_POSITIONS}, or positions in degrees of few decimals"
    )
    assert lost(uses=("motion", "serving"), **tables) == ""


def test_without_motion_it_is_not_at_fault():
    assert lost(tdoa=TDOA, over_map=False) == OF_DIFFERENCES
