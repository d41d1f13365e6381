"""Replaying a log through the Bayes map filter."""

from __future__ import annotations

import time
from dataclasses import replace
from math import nan

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.geodesy import same_crs
from mapfilter.models.fingerprint import BoundReading, LevelReading
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.smoothing import History, settled, smoothed
from mapfilter.positioning.bayes.state import BayesState, StepOutput
from mapfilter.positioning.epochs import Epoch, epochs
from mapfilter.positioning.estimate import PositionedTrack, Snapshot, TrackEstimate, TrackEvidence
from mapfilter.tracks.log import TrackLog

_SNAPSHOT_EVERY_M = 20.0


def position_by_bayes(
    positioner: BayesPositioner,
    log: TrackLog,
    rng: np.random.Generator,
    *,
    smooth: bool = False,
    pictures: bool = False,
) -> PositionedTrack:
    """Locate a log with the Bayes map filter, from an unknown start.

    Nothing aborts a track: what cannot be used is labelled and passed over.

    Parameters
    ----------
    positioner : BayesPositioner
        Shared by many logs.
    log : TrackLog
        In the database's CRS.
    rng : numpy.random.Generator
    smooth : bool
        Whether positions are those in hindsight, by the whole log.
    pictures : bool
        Whether to keep the belief's hypotheses until it has converged, for figures.

    Raises
    ------
    InputError
        The log is in another CRS than the database.
    """
    crs = positioner.area.lattice.crs
    if not same_crs(log.crs, crs):
        raise fail(InputError, "log, crs", crs, log.crs, "log of another area or zone")
    merged = epochs(log)
    _warm_up(positioner)
    began_s = time.process_time()
    track, told = positioner.begin(), list[StepOutput]()
    snapshots: list[Snapshot] = []
    history = History()
    for epoch in merged:
        before = track
        track, news = positioner.step(before, epoch, rng)
        told.append(news)
        if smooth:
            history.add(before, track)
        if pictures and _worth_a_picture(track, snapshots):
            snapshots.append(_snapshot(track, news, positioner.area))
    estimate = estimate_of(crs, positioner.name, told, log.start_utc_s)
    if smooth:
        history.close(track)
        model = positioner.model
        estimate = smoothed(estimate, history, positioner.area, model.motion, rng)
    filter_s = time.process_time() - began_s
    return PositionedTrack(estimate, tuple(snapshots), filter_s)


def estimate_of(
    crs: str, filter_name: str, told: list[StepOutput], start_utc_s: float = nan
) -> TrackEstimate:
    """Put the news of a track's epochs together."""
    unused = [reading for news in told for reading in news.unused]
    east_m, north_m, mass, entropy, log_evidence = (
        np.array([news.evidence for news in told], dtype=np.float64).reshape(-1, 5).T
    )
    none = np.zeros(len(told), dtype=np.bool_)
    estimate = TrackEstimate.of_fixes(
        crs,
        filter_name,
        [news.fix for news in told],
        start_utc_s=start_utc_s,
        unused=unused,
        evidence=TrackEvidence(east_m, north_m, mass, entropy, log_evidence, none),
    )
    evidence = TrackEvidence(east_m, north_m, mass, entropy, log_evidence, settled(estimate))
    return replace(estimate, evidence=evidence)


def _worth_a_picture(track: BayesState, snapshots: list[Snapshot]) -> bool:
    """Tell whether a belief on its way to converging has changed since the last picture."""
    if track.belief is None or track.status is Status.TRACKING:
        return False
    if not snapshots or track.status is not snapshots[-1].status:
        return True
    return track.reckoning.travelled_m - snapshots[-1].travelled_m >= _SNAPSHOT_EVERY_M


def _snapshot(track: BayesState, news: StepOutput, area: AreaMap) -> Snapshot:
    belief, (west, south), fix = track.leading, area.origin_m, news.fix
    if belief is None:
        raise AssertionError("only beliefs are drawn")
    return Snapshot(
        fix.time_s,
        track.reckoning.travelled_m,
        belief.state[0].astype(np.float64) + west,
        belief.state[1].astype(np.float64) + south,
        belief.weight.astype(np.float64),
        fix.east_m,
        fix.north_m,
        track.status,
    )


def _warm_up(positioner: BayesPositioner) -> None:
    """Load what is compiled, and prepare the area, before the clock starts."""
    if positioner.grid:
        return
    model, rng = positioner.model, np.random.default_rng(0)
    west, south = model.area.origin_m
    small = replace(positioner, options=replace(positioner.options, most=64, least=32))
    track = small.begin_at(west, south, 1.0, rng)
    epoch = Epoch(0.0, (MotionStep(1.0, 0.0),))
    track, _ = small.step(track, epoch, rng)
    if track.belief is not None and model.area.cell_ids:
        small.filter_for(True).update(track.belief, _every_kind(), rng)


def _every_kind() -> RadioReading:
    one, none = np.ones(1, dtype=np.float32), np.zeros(1, dtype=np.int32)
    levels = LevelReading(none, one, one, one, 0.3, 1.0, 3.0, 0.0, 0.0)
    return RadioReading(0, 1.0, levels, (BoundReading(none, -60.0, 1, 8.0, 1.0),))
