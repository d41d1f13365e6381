"""Titles of the pictures of a sweep."""

import pandas as pd
import pytest

from mapfilter.evaluation.success import COORDINATES
from mapfilter.workflows.sweep import groups_of


@pytest.mark.parametrize(
    ("reading", "title"),
    [("candidate", "candidate filter"), ("list", "candidate filter: list")],
)
def test_a_filter_is_named_once(reading, title):
    run = dict.fromkeys(COORDINATES, 1.0) | {"filter": "candidate", "reading": reading}
    assert [told for told, _ in groups_of(pd.DataFrame([run]))] == [title]
