"""Papers whose experiments can be repeated, one folder or module each.

A paper's scene, filters, experiment, tables and pictures meet in its :class:`.paper.Paper`, named
``PAPER``. To add one, write its module and name it here.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mapfilter.errors import ConfigError, fail

if TYPE_CHECKING:
    from mapfilter.experiments.papers.paper import Paper

PAPERS = {
    "khalaf-allah-2007": "khalaf_allah_2007",
    "fritsche-klein-2009": "fritsche_klein_2009.paper",
    "zhang-2006": "zhang_2006.paper",
    "tesa": "tesa.paper",
    "dlr": "dlr.paper",
}
"""Modules of the papers, by their names on the command line."""


def find_paper(name: str) -> Paper[Any]:
    """Return a paper by its name; ConfigError where there is none."""
    if name not in PAPERS:
        raise fail(ConfigError, "reproduce", f"one of {', '.join(PAPERS)}", repr(name))
    paper: Paper[Any] = import_module(f"{__name__}.{PAPERS[name]}").PAPER
    return paper
