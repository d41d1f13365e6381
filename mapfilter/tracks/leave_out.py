"""Logs without some of their readings, to see what a filter makes of the rest."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Literal

import pandas as pd

from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import NEIGHBOUR

Kind = Literal["gnss", "ta", "neighbours"]


def leave_out(log: TrackLog, kinds: Collection[Kind]) -> TrackLog:
    """Return a log without some kinds of readings; its notes tell how many went.

    Parameters
    ----------
    log : TrackLog
    kinds : collection of str
        ``gnss`` (all fixes), ``ta`` (timing advances; their reports stay) and ``neighbours`` (all
        cells but the serving one).

    Examples
    --------
    >>> from mapfilter.tracks.log import make_log
    >>> heard = pd.DataFrame({"time_s": [0.0, 0.0], "role": ["serving", "neighbour"]})
    >>> log = make_log("EPSG:32635", radio=heard.assign(timing_advance=[1, None]))
    >>> alone = leave_out(log, ["neighbours", "ta"])
    >>> alone.radio["role"].tolist(), alone.radio["timing_advance"].isna().all()
    (['serving'], np.True_)
    >>> print(*alone.notes, sep="; ")
    ta: 1 left out; neighbours: 1 left out
    """
    radio, gnss = log.radio, log.gnss
    left: dict[str, int] = {}
    if "gnss" in kinds:
        left["gnss"] = len(gnss)
        gnss = gnss.iloc[:0]
    if "ta" in kinds:
        left["ta"] = int(radio["timing_advance"].notna().sum())
        radio = radio.assign(timing_advance=pd.array([pd.NA] * len(radio), dtype="Int64"))
    if "neighbours" in kinds:
        neighbour = radio["role"] == NEIGHBOUR
        left["neighbours"] = int(neighbour.sum())
        radio = radio[~neighbour].reset_index(drop=True)
    notes = (*log.notes, *(f"{kind}: {count} left out" for kind, count in left.items()))
    return replace(log, radio=radio, gnss=gnss, notes=notes)
