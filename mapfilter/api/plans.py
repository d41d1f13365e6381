"""Read a cell plan, with messages in the words of Python."""

from __future__ import annotations

from mapfilter.api.python_words import python_plan
from mapfilter.radio import plan_files

read_cell_plan = python_plan(plan_files.read_cell_plan)
