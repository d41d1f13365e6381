"""Global positioning by the Bayes map filter: one epoch after another, live or in replay.

:meth:`BayesPositioner.advance` takes what is known after one epoch and the next epoch, and returns
what is known then and the news. A replay calls it for every epoch of a log, a live application for
every one that comes in: equal epochs give equal bytes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from math import isfinite, nan

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.hypotheses import Summary, nothing
from mapfilter.filters.particle import ParticleBelief, ParticleFilter
from mapfilter.filters.particle_options import ParticleOptions
from mapfilter.geodesy import same_crs
from mapfilter.models.fingerprint import BoundReading, LevelReading
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.area_map import AreaMap
from mapfilter.positioning.bayes_model import BayesModel, Start
from mapfilter.positioning.epochs import Epoch, epochs, headed
from mapfilter.positioning.estimate import Fix, TrackEstimate, TrackEvidence, UnusedReading
from mapfilter.positioning.evidence import Memory, RadioReading, reading_of
from mapfilter.positioning.matched_way import matched_way
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.positioning.track import PositionedTrack
from mapfilter.tracks.log import TrackLog

_SNAPSHOT_EVERY_M = 20.0


@dataclass(frozen=True, eq=False)
class BayesTrack:
    """What is known after an epoch.

    Parameters
    ----------
    memory : Memory
        Of dead reckoning and levels.
    belief : ParticleBelief or None
        None before the first report that can be placed.
    heading_rad : float
        Of the last step; without a compass counted from the first one.
    compass : bool
        Whether headings are a compass's.
    status : Status
    """

    memory: Memory
    belief: ParticleBelief | None = None
    heading_rad: float = nan
    compass: bool = True
    status: Status = Status.SEARCHING


@dataclass(frozen=True, slots=True)
class News:
    """What one epoch brought.

    Parameters
    ----------
    fix : Fix
    evidence : tuple of float
        Runner-up's east, north and mass, entropy in bits, log evidence.
    unused : tuple of UnusedReading
    """

    fix: Fix
    evidence: tuple[float, float, float, float, float]
    unused: tuple[UnusedReading, ...]


@dataclass(frozen=True)
class BayesPositioner:
    """The map filter over an area.

    Parameters
    ----------
    model : BayesModel
    options : ParticleOptions
    """

    model: BayesModel
    options: ParticleOptions = field(default_factory=ParticleOptions)

    @property
    def area(self) -> AreaMap:
        """The area's map."""
        return self.model.area

    @property
    def filter(self) -> ParticleFilter[Start, RadioReading]:
        """The filter by itself."""
        return ParticleFilter(self.model, self.options)

    def begin(self) -> BayesTrack:
        """Return what is known before the first epoch: nothing."""
        return BayesTrack(Memory.empty(len(self.area.cell_ids)))

    def begin_at(
        self, east_m: float, north_m: float, sd_m: float, rng: np.random.Generator
    ) -> BayesTrack:
        """Return what is known at a known start, in the CRS of the database."""
        belief = self.filter.init(Start(None, True, east_m, north_m, sd_m), rng)
        belief = replace(belief, status=Status.TRACKING)
        return replace(self.begin(), belief=belief, status=Status.TRACKING)

    def advance(
        self, track: BayesTrack, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesTrack, News]:
        """Take one epoch in."""
        track, unused = self._move(track, epoch, rng)
        memory, reading, reason, unplaced = reading_of(
            self.area, self.model.evidence, track.memory, epoch
        )
        unused += [
            UnusedReading(epoch.time_s, row.role, _name(row.cell, row.arfcn, row.bsic), why)
            for row, why in unplaced
        ]
        belief = track.belief
        if belief is None:
            if reading is not None:
                belief = self.filter.init(Start(reading, track.compass), rng)
        elif reading is not None:
            belief, info = self.filter.update(belief, reading, rng)
            if info.reason is not Reason.USED:
                reason = info.reason
        if reason not in (Reason.USED, Reason.NOT_MOVED_ENOUGH, Reason.NO_READING):
            cell = next((str(row.cell) for row in epoch.heard if row.cell is not None), "")
            unused.append(UnusedReading(epoch.time_s, "serving", cell, reason))
        status = track.status if belief is None else belief.status
        if reading is None and status is Status.CONVERGED:
            # CONVERGED is one epoch, also where nothing is heard in the next.
            belief = replace(belief, status=Status.TRACKING) if belief is not None else None
            status = Status.TRACKING
        after = replace(track, memory=memory, belief=belief, status=status)
        return after, self._news(after, epoch.time_s, reason, tuple(unused))

    def _move(
        self, track: BayesTrack, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesTrack, list[UnusedReading]]:
        unused: list[UnusedReading] = []
        belief, memory, heading_rad = track.belief, track.memory, track.heading_rad
        compass = track.compass
        for raw in epoch.motion:
            step, heading_rad = headed(raw, heading_rad)
            if belief is None:
                unused.append(UnusedReading(epoch.time_s, "motion", "", Reason.NOT_STARTED))
                compass = isfinite(raw.heading_rad)
                continue
            if compass and not isfinite(raw.heading_rad) and memory.travelled_m == 0:
                # Nothing has moved yet: headings can still become those of no compass.
                compass = False
                belief = self._without_compass(belief, rng)
            belief, why = self.filter.predict(belief, step, rng)
            memory = memory.moved(step)
            if why is not Reason.USED:
                unused.append(UnusedReading(epoch.time_s, "motion", "", why))
        moved = replace(
            track, belief=belief, memory=memory, heading_rad=heading_rad, compass=compass
        )
        return moved, unused

    def _without_compass(self, belief: ParticleBelief, rng: np.random.Generator) -> ParticleBelief:
        return replace(belief, state=self.model.any_heading(belief.state, rng))

    def _news(
        self, track: BayesTrack, time_s: float, reason: Reason, unused: tuple[UnusedReading, ...]
    ) -> News:
        belief, (west, south) = track.belief, self.area.origin_m
        if belief is None:
            said, count, way = nothing(STATES), 0, (0, nan)
        else:
            said, count = belief.summary, belief.log_weight.size
            way = matched_way(self.area, belief.state[0], belief.state[1], belief.weight)
        fix = Fix(
            time_s,
            float(said.mean[0]) + west,
            float(said.mean[1]) + south,
            said.covariance_m2,
            said.radii_m,
            track.status,
            count,
            said.mass_50m if count else nan,
            *way,
            reason,
        )
        evidence = _evidence(said, west, south, belief.log_evidence if belief else nan)
        return News(fix, evidence, unused)


def _evidence(
    said: Summary, west: float, south: float, log_evidence: float
) -> tuple[float, float, float, float, float]:
    east_m = north_m = nan
    mass = 0.0 if isfinite(said.entropy_bits) else nan
    if len(said.runners_up):
        east_m, north_m, mass = said.runners_up[0].tolist()
    return east_m + west, north_m + south, mass, said.entropy_bits, log_evidence


def _name(cell: str | None, arfcn: int | None, bsic: int | None) -> str:
    if cell is not None:
        return cell
    return "" if arfcn is None else f"ARFCN {arfcn}, BSIC {'unknown' if bsic is None else bsic}"


def position_by_bayes(
    positioner: BayesPositioner, log: TrackLog, rng: np.random.Generator, *, pictures: bool = False
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
    track, told = positioner.begin(), list[News]()
    snapshots: list[Snapshot] = []
    for epoch in merged:
        track, news = positioner.advance(track, epoch, rng)
        told.append(news)
        if pictures and _worth_a_picture(track, snapshots):
            snapshots.append(_snapshot(track, news, positioner.area))
    filter_s = time.process_time() - began_s
    return PositionedTrack(
        estimate_of(crs, "bayes", told, log.start_utc_s),
        tuple(snapshots),
        filter_s,
    )


def estimate_of(
    crs: str, filter_name: str, told: list[News], start_utc_s: float = nan
) -> TrackEstimate:
    """Put the news of a track's epochs together."""
    unused = [reading for news in told for reading in news.unused]
    east_m, north_m, mass, entropy, log_evidence = (
        np.array([news.evidence for news in told], dtype=np.float64).reshape(-1, 5).T
    )
    return TrackEstimate.of_fixes(
        crs,
        filter_name,
        [news.fix for news in told],
        start_utc_s=start_utc_s,
        unused=unused,
        evidence=TrackEvidence(
            east_m, north_m, mass, entropy, log_evidence, np.zeros(len(told), dtype=np.bool_)
        ),
    )


def _worth_a_picture(track: BayesTrack, snapshots: list[Snapshot]) -> bool:
    """Tell whether a belief on its way to converging has changed since the last picture."""
    if track.belief is None or track.status is Status.TRACKING:
        return False
    if not snapshots or track.status is not snapshots[-1].status:
        return True
    return track.memory.travelled_m - snapshots[-1].travelled_m >= _SNAPSHOT_EVERY_M


def _snapshot(track: BayesTrack, news: News, area: AreaMap) -> Snapshot:
    belief, (west, south), fix = track.belief, area.origin_m, news.fix
    if belief is None:
        raise AssertionError("only beliefs are drawn")
    return Snapshot(
        fix.time_s,
        track.memory.travelled_m,
        belief.state[0].astype(np.float64) + west,
        belief.state[1].astype(np.float64) + south,
        belief.weight.astype(np.float64),
        fix.east_m,
        fix.north_m,
        track.status,
    )


def _warm_up(positioner: BayesPositioner) -> None:
    """Load what is compiled, and prepare the area, before the clock starts."""
    model, rng = positioner.model, np.random.default_rng(0)
    west, south = model.area.origin_m
    small = replace(positioner, options=replace(positioner.options, most=64, least=32))
    track = small.begin_at(west, south, 1.0, rng)
    epoch = Epoch(0.0, (MotionStep(1.0, 0.0),))
    track, _ = small.advance(track, epoch, rng)
    if track.belief is not None and model.area.cell_ids:
        small.filter.update(track.belief, _every_kind(), rng)


def _every_kind() -> RadioReading:
    one, none = np.ones(1, dtype=np.float32), np.zeros(1, dtype=np.int32)
    levels = LevelReading(none, one, one, one, 0.3, 1.0, 3.0, 0.0, 0.0)
    return RadioReading(0, 1.0, levels, (BoundReading(none, -60.0, 1, 8.0, 1.0),))
