"""Satellites over the benchmark's walks: a few of those seen past the buildings, and a spoofer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pandas as pd

from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.journeys import Walk
from mapfilter.gnss.orbits import gps_time, joined, nominal_galileo, nominal_gps
from mapfilter.gnss.sky import Skyline
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.satellites import ReceptionModel, Spoofer, receive
from mapfilter.tracks.log import TrackLog, make_log

START_UTC_S = 1_700_000_000.0
DAY_S = 86_400.0
SPOOFED_M, SPOOFED_S = 500.0, 60.0
WINDOW_S = 120.0
"""Errors about a spoofer are looked at from its beginning on, for so long."""

HEIGHT_M = 100.0
TOWN_HEIGHT: Mapping[str, float] = MappingProxyType({"height_m": HEIGHT_M, "height_sd_m": 20.0})
"""What a map states of the town's height over the ellipsoid, as options of the filter."""


def spoofer_of(walked: Walk, seed: int, number: int) -> Spoofer:
    """Return who puts a walk elsewhere: at a random time after 40 % of it, to a random side."""
    rng = named_rng(seed, "spoofer", str(number))
    time_s = walked.truth["time_s"].to_numpy()
    first_s, last_s = 0.4 * time_s[-1], max(time_s[-1] - WINDOW_S, 0.4 * time_s[-1])
    angle = rng.uniform(0.0, 2 * np.pi)
    return Spoofer(
        float(rng.uniform(first_s, last_s)),
        SPOOFED_S,
        SPOOFED_M * float(np.cos(angle)),
        SPOOFED_M * float(np.sin(angle)),
        float(rng.normal(0.0, 100.0)),
    )


def with_satellites(
    case: Case,
    log: TrackLog,
    walked: Walk,
    skyline: Skyline | None,
    seed: int,
    number: int,
    model: ReceptionModel | None = None,
) -> TrackLog:
    """Return a walk's log with what its receiver hears of satellites.

    All cases of a walk see the same sky, clock and noise; those of more satellites hear others
    beside the same ones.

    Parameters
    ----------
    case : Case
        Its number of satellites replaces the model's.
    log : TrackLog
    walked : Walk
    skyline : Skyline or None
    seed, number : int
        Of the benchmark, of the route.
    model : ReceptionModel, optional
        By default one without reflections; the height is always the benchmark's.
    """
    if case.satellites is None:
        return log
    rng = named_rng(seed, "satellites", str(number))
    start_utc_s = START_UTC_S + float(rng.uniform(0.0, DAY_S))
    week, _ = gps_time(start_utc_s)
    received_as = replace(model or ReceptionModel(), most=case.satellites, height_m=HEIGHT_M)
    ranges: pd.DataFrame = receive(
        walked.truth,
        log.crs,
        skyline,
        joined(nominal_gps(week), nominal_galileo(week)),
        start_utc_s,
        received_as,
        rng,
        spoofer_of(walked, seed, number) if case.spoofed else None,
    )
    told = make_log(log.crs, pseudoranges=ranges, start_utc_s=start_utc_s)
    return replace(log, pseudoranges=told.pseudoranges, start_utc_s=start_utc_s)
