"""Neighbours without levels are of little use; a column of levels was likely not read."""

from __future__ import annotations

import pandas as pd

from mapfilter._words import number_of
from mapfilter.tracks.schema import NEIGHBOUR

_FEW_ROWS = 10
WITHOUT_LEVELS = "no row has a level (level_dbm)"
"""Words by which the note is known."""


def levels_note(radio: pd.DataFrame, where: str) -> tuple[str, ...]:
    """Return a note on neighbours in a table without any level; none of a few rows.

    Who lists serving cells alone may have no levels; neighbours are listed for their levels.

    Parameters
    ----------
    radio : pandas.DataFrame
        The table of reports.
    where : str
        Its name.

    Examples
    --------
    >>> heard = pd.DataFrame({"role": ["neighbour"] * 12, "level_dbm": float("nan")})
    >>> levels_note(heard, "radio")[0][:55]
    'radio: no row has a level (level_dbm); 12 neighbours ar'
    >>> levels_note(heard.assign(role="serving"), "radio")
    ()
    """
    count = int((radio["role"] == NEIGHBOUR).sum())
    if count < _FEW_ROWS or radio["level_dbm"].notna().any():
        return ()
    some = number_of(count, "neighbour is", "neighbours are")
    use = f"{some} of little use without (likely: a column that was not read)"
    return (f"{where}: {WITHOUT_LEVELS}; {use}",)
