"""Rows of one time in one, as of a bus or a phone that writes each value in a row of its own."""

from __future__ import annotations

import pandas as pd


def joined_times(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row of each time, with the first value of each column that is not missing.

    Parameters
    ----------
    rows : pandas.DataFrame
        With ``time_s``.

    Returns
    -------
    pandas.DataFrame
        The same object where all times differ.

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": [0.0, 0.0, 1.0], "speed_mps": [None, 8.0, 9.0]})
    >>> joined_times(rows.assign(yaw_rate_radps=[0.1, None, None])).to_dict("list")
    {'time_s': [0.0, 1.0], 'speed_mps': [8.0, 9.0], 'yaw_rate_radps': [0.1, nan]}
    """
    if not rows["time_s"].duplicated().any():
        return rows
    return rows.groupby("time_s", sort=False, as_index=False).first()[list(rows.columns)]
