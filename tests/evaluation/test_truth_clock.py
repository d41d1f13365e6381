"""A ground truth whose clock is another one is noted; plain errors of a filter are no clock."""

from math import nan

import numpy as np
import pytest

from mapfilter.evaluation.truth import Truth
from mapfilter.evaluation.truth_notes import truth_notes
from mapfilter.filters.contract import Reason
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix, Status

TIME_S = np.arange(900.0)
FROM, TO = 150, 750


def driven(rng, speed_mps=10.0, turns=True):
    """Return a way with a right-angle turn every 100 to 300 m, and headings along it."""
    legs = rng.integers(int(100 / speed_mps), int(300 / speed_mps), 200)
    quarters = np.repeat(np.cumsum(rng.integers(-1, 2, 200)) if turns else np.zeros(200), legs)
    heading = quarters[: len(TIME_S)] * np.pi / 2
    return np.cumsum(speed_mps * np.array([np.cos(heading), np.sin(heading)]), axis=1), heading


def errors(rng, sd_m, lasting_s):
    """Return errors by axis that are correlated over some seconds."""
    keep = np.exp(-1 / lasting_s)
    found = rng.normal(0, sd_m, (2, len(TIME_S)))
    for n in range(1, len(TIME_S)):
        found[:, n] = keep * found[:, n - 1] + np.sqrt(1 - keep**2) * found[:, n]
    return found


def noted(way, error_m, late_s, least=FROM):
    unknown = np.full((2, 2), nan), np.full(3, nan)
    fixes = [
        Fix(time, *place, *unknown, status, 1, nan, 0, nan, Reason.USED)
        for time, place, status in zip(
            TIME_S[least:TO],
            (way + error_m)[:, least:TO].T,
            [Status.CONVERGED] + [Status.TRACKING] * (TO - least),
            strict=False,
        )
    ]
    estimate = TrackEstimate.of_fixes("EPSG:32629", "bayes", fixes)
    notes = truth_notes(estimate, Truth(TIME_S + late_s, *way))
    return [note for note in notes if note.startswith("with the times of the ground truth")]


@pytest.mark.parametrize(
    ("late_s", "moved", "likely"),
    [
        (30, "30 s earlier", "another clock"),
        (-30, "30 s later", "another clock"),
        (18, "18 s earlier", "GPS time beside UTC, or another clock"),
        (7200, "2 h earlier", "another time zone"),
        (-19800, "5.5 h later", "another time zone"),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_times_of_another_clock_are_noted(late_s, moved, likely, seed):
    rng = np.random.default_rng(seed)
    (note,) = noted(driven(rng)[0], errors(rng, 5, 20), late_s)
    assert note.startswith(f"with the times of the ground truth {moved}, the median error is ")
    assert note.endswith(f"(likely: {likely}); scored as they are")


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("sd_m", [3, 60])
def test_plain_errors_are_no_clock(sd_m, seed):
    rng = np.random.default_rng(seed)
    way, heading = driven(rng)
    assert not noted(way, errors(rng, sd_m, 60), 0)
    along = errors(rng, sd_m, 20)[0]
    assert not noted(way, along * np.array([np.cos(heading), np.sin(heading)]), 0)


@pytest.mark.parametrize("turns", [True, False])
def test_a_displaced_map_is_no_clock(turns):
    rng = np.random.default_rng(1)
    assert not noted(driven(rng, turns=turns)[0], np.array([[200.0], [0.0]]), 0)


def test_little_is_known_of_few_epochs_and_small_shifts():
    rng = np.random.default_rng(1)
    way, none = driven(rng)[0], np.zeros((2, 1))
    assert not noted(way, none, 30, least=TO - 20)
    assert not noted(way, none, 2)
    assert noted(way, none, 3)


def test_of_another_journey_no_hour_fits():
    rng = np.random.default_rng(1)
    way = driven(rng)[0]
    assert not noted(way, driven(rng)[0] - way, 7200)
