"""The documentation's Python on a database and a log, as they stand there."""

import re
from pathlib import Path

import pytest

from mapfilter.filters.contract import Status

DOCS = Path(__file__).resolve().parents[2] / "docs"
BLOCK = re.compile(r"code-block:: python\n\n((?:   .*\n|\n)+)")


def blocks(page):
    found = BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))
    return [re.sub(r"^   ", "", text, flags=re.MULTILINE) for text in found]


@pytest.fixture(autouse=True)
def _in_the_folder_that_the_pages_are_written_for(world, monkeypatch):
    monkeypatch.chdir(world.folder)


def test_opening_a_database_and_a_log():
    names: dict[str, object] = {}
    exec(blocks("api.rst")[0], names)
    assert len(names["log"].motion)
    assert names["database"].cell_ids == ("A", "B", "C")


def test_locating_a_log():
    names: dict[str, object] = {}
    (code,) = blocks("explanation/candidate-filter.rst")
    exec(code, names)
    estimate = names["track"].estimate
    assert (
        estimate.converged_at is None or estimate.status[estimate.converged_at] is Status.CONVERGED
    )
    assert len(estimate) >= len(names["log"].motion)
