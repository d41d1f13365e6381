"""The note on a database whose pixels are too coarse, where a log was lost."""

from types import SimpleNamespace

import pytest

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.log_lacks import coarse_pixels_note

LOST, OUTSIDE = Status.LOST, Status.OUTSIDE
SEARCHING, TRACKING = Status.SEARCHING, Status.TRACKING


def notes(pixel_m, *statuses, options=None):
    database = SimpleNamespace(lattice=SimpleNamespace(resolution_m=pixel_m))
    return coarse_pixels_note(options or BayesFilter(), SimpleNamespace(status=statuses), database)


@pytest.mark.parametrize("last", [LOST, OUTSIDE])
def test_names_the_pixels_and_finer_ones(last):
    (note,) = notes(50.0, SEARCHING, TRACKING, TRACKING, last)
    assert "LOST or OUTSIDE in 25% of the epochs (likely: pixels of 50 m" in note
    assert "pixels of 10 m or less, with rasters.resolution_m" in note


def test_also_where_it_searches_again_at_the_end():
    (note,) = notes(15.0, OUTSIDE, LOST, OUTSIDE, SEARCHING)
    assert "in 75% of the epochs" in note


@pytest.mark.parametrize(
    ("pixel_m", "statuses"),
    [
        (10.0, (SEARCHING, OUTSIDE)),
        (50.0, (SEARCHING, TRACKING)),
        (50.0, (LOST, TRACKING)),
        (50.0, ()),
    ],
)
def test_fine_pixels_and_located_logs_have_none(pixel_m, statuses):
    assert notes(pixel_m, *statuses) == ()


def test_other_filters_and_no_database_have_none():
    assert notes(50.0, OUTSIDE, options=CandidateFilter()) == ()
    assert coarse_pixels_note(BayesFilter(), SimpleNamespace(status=(OUTSIDE,)), None) == ()
