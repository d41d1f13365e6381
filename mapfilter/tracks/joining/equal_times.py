"""Rows of equal times: joined where each holds another value, else kept in their order."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd


def in_order(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return rows of several tables in the order of ``time_s``, those of one time as given.

    Examples
    --------
    >>> early, late = (pd.DataFrame({"time_s": [t, t], "n": [t, t + 1]}) for t in (1, 5))
    >>> in_order([late, early])["n"].tolist()
    [1, 2, 5, 6]
    """
    return pd.concat(parts, ignore_index=True).sort_values("time_s", kind="stable")


def joined_times(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row of each time, with the first value of each column that is not missing.

    A bus, or a phone, may write each value in a row of its own.

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
