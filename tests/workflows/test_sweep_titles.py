"""Titles of the pictures of a sweep."""

import pandas as pd
import pytest

from mapfilter.evaluation.success_cells import COORDINATES
from mapfilter.workflows.sweep import groups_of


@pytest.mark.parametrize(
    ("reading", "title"),
    [("candidate", "candidate filter"), ("list", "candidate filter: list")],
)
def test_a_filter_is_named_once(reading, title):
    run = dict.fromkeys(COORDINATES, 1.0) | {"filter": "candidate", "reading": reading}
    assert [told for told, _ in groups_of(pd.DataFrame([run]))] == [title]


def test_a_filter_without_update_length_has_none_in_its_title():
    filters = {"bayes": float("nan"), "candidate": 5.0}
    runs = [
        dict.fromkeys(COORDINATES, 1.0) | {"filter": name, "reading": name, "update_length_m": own}
        for name, own in filters.items()
    ]
    titles = [title for title, _ in groups_of(pd.DataFrame(runs))]
    assert titles == ["bayes filter", "candidate filter, updates of 5 m"]
