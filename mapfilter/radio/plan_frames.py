"""Cell plans as tables of pandas, and tables of pandas as those of files."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import unproject
from mapfilter.radio.cell_layouts import COLUMNS, SELDOM
from mapfilter.radio.tables import MOST_COLUMNS, MOST_FIELDS, Table

if TYPE_CHECKING:
    import pandas as pd

    from mapfilter.radio.cells import CellPlan

_WHOLE = ("mcc", "mnc", "lac", "ci", "arfcn", "bsic")


def plan_frame(plan: CellPlan) -> pd.DataFrame:
    """Return a row for each cell, with the columns of the files of plans.

    Identities, carriers and codes are nullable integers; other unknown values are missing.
    """
    import pandas as pd

    cells = plan.cells
    names = [one.name for one in fields(cells[0])] if cells else []
    given: dict[str, Any] = {name: [getattr(cell, name) for cell in cells] for name in names}
    lon_deg, lat_deg = unproject(
        plan.crs, [cell.east_m for cell in cells], [cell.north_m for cell in cells]
    )
    given |= {"cell": list(plan.ids), "lat": lat_deg, "lon": lon_deg}
    columns = [name for name in COLUMNS if name not in SELDOM or any(given.get(name, ()))]
    table = pd.DataFrame({name: given.get(name, []) for name in columns})
    numbers = {"azimuth_deg": "float64", "vertical_beamwidth_deg": "float64"}
    return table.astype(dict.fromkeys(_WHOLE, "Int64") | numbers)


def is_frame(given: object) -> bool:
    """Return whether something is a table of pandas, which need not be imported for it."""
    return hasattr(given, "columns") and hasattr(given, "itertuples")


def table_of_frame(frame: pd.DataFrame) -> Table:
    """Return a table of pandas as that of a file; rows are counted from 1.

    Raises
    ------
    InputError
        It is empty, or too large.
    """
    header = tuple(str(name).strip() for name in frame.columns)
    if not (len(frame) and header):
        raise fail(InputError, "cell plan", "a table with rows", "an empty one")
    if len(header) > MOST_COLUMNS or frame.size > MOST_FIELDS:
        got = f"{number_of(len(header), 'column')}, {number_of(len(frame), 'row')}"
        raise fail(InputError, "cell plan", "a table of at most 5e6 fields", got)
    rows = (
        (row, [_text(value) for value in values])
        for row, values in enumerate(frame.itertuples(index=False, name=None), start=1)
    )
    kept = tuple((row, texts) for row, texts in rows if any(texts))
    return Table(Path("table"), "", header, kept)


def _text(value: Any) -> str:
    """Return a value as a file has it: an empty text where it is missing."""
    # pandas' mark of missing values has no truth value.
    if value is None or str(value) in ("nan", "<NA>", "NaT"):
        return ""
    # Numbers of NumPy are Python's by their methods.
    number = value.item() if hasattr(value, "item") else value
    if isinstance(number, bool):
        return str(int(number))
    if isinstance(number, float) and math.isfinite(number) and number == int(number):
        return str(int(number))
    return str(number).strip()
