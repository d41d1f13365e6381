"""Logs without some of their readings, to see what a filter makes of the rest."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Literal

import pandas as pd

from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import NEIGHBOUR

Kind = Literal["gnss", "fixes", "pseudoranges", "ta", "tdoa", "neighbours", "radio"]


def leave_out(log: TrackLog, kinds: Collection[Kind]) -> TrackLog:
    """Return a log without some kinds of readings; its notes tell how many went.

    Parameters
    ----------
    log : TrackLog
    kinds : collection of str
        ``gnss`` (``fixes`` and ``pseudoranges``), ``ta`` (timing advances; their reports stay),
        ``tdoa``, ``neighbours`` (all cells but the serving one) and ``radio`` (all reports).

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
    radio, gnss, ranges, tdoa = log.radio, log.gnss, log.pseudoranges, log.tdoa
    left: dict[str, int] = {}
    if "gnss" in kinds or "fixes" in kinds:
        left["gnss" if "gnss" in kinds else "fixes"] = len(gnss)
        gnss = gnss.iloc[:0]
    if "pseudoranges" in kinds or ("gnss" in kinds and len(ranges)):
        left["pseudoranges"] = len(ranges)
        ranges = ranges.iloc[:0]
    if "ta" in kinds:
        left["ta"] = int(radio["timing_advance"].notna().sum())
        radio = radio.assign(timing_advance=pd.array([pd.NA] * len(radio), dtype="Int64"))
    if "tdoa" in kinds:
        left["tdoa"] = len(tdoa)
        tdoa = tdoa.iloc[:0]
    if "radio" in kinds:
        left["radio"] = len(radio)
        radio = radio.iloc[:0]
    elif "neighbours" in kinds:
        neighbour = radio["role"] == NEIGHBOUR
        left["neighbours"] = int(neighbour.sum())
        radio = radio[~neighbour].reset_index(drop=True)
    notes = (*log.notes, *(f"{kind}: {count} left out" for kind, count in left.items()))
    return replace(log, radio=radio, gnss=gnss, pseudoranges=ranges, tdoa=tdoa, notes=notes)
