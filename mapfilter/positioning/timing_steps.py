"""Timing advances of several technologies in one log: a filter reads steps of one length."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pandas as pd

from mapfilter.positioning.log_options import has_default
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.tracks.log import TrackLog


def with_plan_technologies(log: TrackLog, plan: CellPlan) -> TrackLog:
    """Return a log whose timing advances have the technologies of their cells, where it has none.

    Parameters
    ----------
    log : TrackLog
        Its cells have the ids of the plan.
    plan : CellPlan
        Of its cells those with a technology count.

    Returns
    -------
    TrackLog
        The same object where nothing changes.

    Examples
    --------
    >>> from mapfilter.radio.cells import Cell
    >>> from mapfilter.tracks.log import make_log
    >>> cell = Cell("A", "A", 0.0, 0.0, 30.0, None, 30.0, 1800.0, "omni", technology="LTE")
    >>> radio = pd.DataFrame({"time_s": [0.0], "role": "serving", "cell": "A"})
    >>> log = make_log("EPSG:32635", radio=radio.assign(timing_advance=7))
    >>> with_plan_technologies(log, CellPlan(log.crs, (cell,))).radio["technology"].tolist()
    ['LTE']
    """
    rows = log.radio
    known = {cell.id: cell.technology for cell in plan.cells if cell.technology is not None}
    lacks = rows["timing_advance"].notna() & rows["cell"].isin(known)
    if "technology" in rows:
        lacks &= rows["technology"].isna()
    if not lacks.any():
        return log
    given = rows.get("technology", pd.Series(None, index=rows.index, dtype=object))
    named = given.astype(object).mask(lacks, rows["cell"].map(known))
    return replace(log, radio=rows.assign(technology=named))


def with_one_step(log: TrackLog, options: Any) -> TrackLog:
    """Return a log without timing advances in other steps than most, and a note on these.

    Those of GSM or LTE stay, whichever are more; those of NR, whose steps depend on the numerology,
    and those without a technology beside others go. All stay where the log states no technology, or
    options set the length of a step. It is 553.5 m in GSM and 78.1 m in LTE
    (:data:`mapfilter.radio.identities.TIMING_STEP_M`).

    Parameters
    ----------
    log : TrackLog
        Its ``radio`` has ``timing_advance``, in steps of the ``technology`` of each row.
    options
        Of a filter; those without ``timing_step_m`` read no steps.

    Returns
    -------
    TrackLog
        The log itself where all stay.

    Examples
    --------
    >>> from mapfilter.positioning.bayes.options import BayesFilter
    >>> from mapfilter.tracks.log import make_log
    >>> rows = {"time_s": [0.0, 1.0, 2.0], "role": "serving", "timing_advance": [7, 9, 1]}
    >>> radio = pd.DataFrame(rows).assign(technology=["LTE", "LTE", "GSM"])
    >>> log = with_one_step(make_log("EPSG:32635", radio=radio), BayesFilter())
    >>> log.radio["timing_advance"].tolist(), log.notes
    ([7, 9, <NA>], ('timing advance: 1 of GSM left out, beside those of LTE',))
    """
    if "technology" not in log.radio or not has_default(options, "timing_step_m"):
        return log
    rows = log.radio
    stated = rows["technology"].where(rows["timing_advance"].notna())
    counts = stated.dropna().value_counts()
    if counts.empty:
        return log
    read = max(TIMING_STEP_M, key=lambda name: int(counts.get(name, 0)))
    other = (rows["timing_advance"].notna() & (stated != read)).to_numpy()
    if not other.any():
        return log
    names = rows["technology"][other].fillna("no stated technology").value_counts(sort=False)
    left_out = ", ".join(f"{count} of {name}" for name, count in sorted(names.items()))
    beside = f", beside those of {read}" if read in counts else ": their steps are not known"
    advances = rows["timing_advance"].mask(pd.Series(other, index=rows.index))
    note = f"timing advance: {left_out} left out{beside}"
    return replace(log, radio=rows.assign(timing_advance=advances), notes=(*log.notes, note))
