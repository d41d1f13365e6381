"""Global positioning by the Bayes map filter: one epoch after another, live or in replay.

:meth:`BayesPositioner.advance` takes what is known after one epoch and the next epoch, and returns
what is known then and the news. A replay calls it for every epoch of a log, a live application for
every one that comes in: equal epochs give equal bytes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np

from mapfilter.filters.contract import BeliefFilter, MotionStep, Reason, Status
from mapfilter.filters.grid import GridBelief, GridFilter
from mapfilter.filters.particle import ParticleFilter, ParticleOptions
from mapfilter.models.fingerprint import BoundReading, LevelReading
from mapfilter.positioning.bayes.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    MapBelief,
    resolve_alternative,
)
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import RadioHistory, RadioReading, reading_of
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.model import BayesModel, Start
from mapfilter.positioning.bayes.smoothing import BayesSmoother
from mapfilter.positioning.bayes.state import BayesTrack as BayesTrack
from mapfilter.positioning.bayes.state import name_of, news_of, particle_spacing_of
from mapfilter.positioning.bayes.timing import NEVER, is_timed, with_timing
from mapfilter.positioning.epochs import Epoch, headed
from mapfilter.positioning.estimate import StepOutput, UnusedReading
from mapfilter.positioning.filter import ALL_KINDS, Filter, Hypotheses, Kind
from mapfilter.positioning.gnss.gate import GnssGate
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.satellites import GnssUpdate, Satellites
from mapfilter.positioning.gnss.state import GnssState

_MOST_TIMES, _SEARCHING_TIMES = 12, 8


@dataclass(frozen=True)
class BayesPositioner(Filter[BayesTrack]):
    """The map filter over an area.

    Parameters
    ----------
    model : BayesModel
    options : ParticleOptions
    rules : AlternativeRules
    grid : bool
        The exact filter on a grid in place of particles.
    satellites : GnssOptions
    timing : TimingOptions
    smooth : bool
        Whether positions are smoothed by the whole log.
    """

    model: BayesModel
    options: ParticleOptions = field(default_factory=ParticleOptions)
    rules: AlternativeRules = field(default_factory=AlternativeRules)
    grid: bool = False
    satellites: GnssOptions = field(default_factory=GnssOptions)
    timing: TimingOptions = field(default_factory=TimingOptions)
    smooth: bool = False

    @property
    def crs(self) -> str:
        """CRS of the area."""
        return self.area.lattice.crs

    @property
    def area(self) -> AreaMap:
        """The area's map."""
        return self.model.area

    @property
    def name(self) -> str:
        """The filter's name."""
        return "grid" if self.grid else "bayes"

    def filter_for(self, compass: bool) -> BeliefFilter[Start, MapBelief, RadioReading]:
        """Return the filter by itself, for headings with or without a compass."""
        return self._filters[compass]

    @cached_property
    def _filters(self) -> dict[bool, BeliefFilter[Start, Any, RadioReading]]:
        if not self.grid:
            known = self.options
            # Every place times every heading: most of them are gone after a few steps.
            unknown = replace(
                known,
                max_particles=_MOST_TIMES * known.max_particles,
                min_search_particles=_SEARCHING_TIMES * known.min_search_particles,
            )
            return {
                True: ParticleFilter(self.model, known),
                False: ParticleFilter(self.model, unknown),
            }
        grids = {compass: StreetGrid(self.model, compass) for compass in (True, False)}
        return {compass: GridFilter(grid, self.options) for compass, grid in grids.items()}

    @cached_property
    def _sky(self) -> Satellites:
        area, (width_m, height_m) = self.area, self.area.size_m
        listener = GnssGate(self.satellites, area.lattice.crs, area.origin_m)
        return Satellites(listener, (width_m / 2, height_m / 2), not self.grid)

    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> BayesTrack:  # noqa: ARG002
        """Return the state before the first epoch."""
        return BayesTrack(RadioHistory.empty(len(self.area.cell_ids)))

    def begin_at(
        self, east_m: float, north_m: float, sd_m: float, rng: np.random.Generator
    ) -> BayesTrack:
        """Return what is known at a known start, in the CRS of the database."""
        belief = self.filter_for(True).init(Start(None, True, east_m, north_m, sd_m), rng)
        belief = replace(belief, status=Status.TRACKING)
        return replace(self.begin(), belief=belief, status=Status.TRACKING)

    def step(
        self, track: BayesTrack, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesTrack, StepOutput]:
        """Take one epoch in."""
        fix = epoch.fix
        if fix is not None and not (isfinite(fix.east_m) and isfinite(fix.north_m)):
            epoch = replace(epoch, fix=None)
        particle_spacing_m, converged = particle_spacing_of(track), track.status is Status.CONVERGED
        track, unused = self._move(track, epoch, rng)
        track, sky = self._sky.hear(track, epoch, particle_spacing_m, self.model.evidence.spacing_m)
        known = track.belief is not None and epoch.fix is not None
        report = replace(epoch, fix=None) if known else epoch
        memory, reading, reason, unplaced = reading_of(
            self.area, self.model.evidence, track.memory, report, particle_spacing_m
        )
        track, reading, untimed = self._timed(track, epoch, reading)
        unused += [*sky.unused, *untimed]
        unused += [
            UnusedReading(epoch.time_s, row.role, name_of(row), why) for row, why in unplaced
        ]
        belief = track.belief
        if belief is None:
            reading = self._sky.first(reading, epoch)
            if reading is not None:
                belief, heard = self._start(track, reading, epoch, rng)
                track = replace(track, belief=belief, sky=heard)
        elif reading is not None or sky.says:
            track, why = self._weigh(track, belief, reading or RadioReading(), sky, epoch, rng)
            reason = reason if why is Reason.USED else why
        if converged and track.status is Status.CONVERGED and track.belief is not None:
            # CONVERGED is one epoch, also where nothing that counts is heard in the next.
            following = replace(track.belief, status=Status.TRACKING)
            track = replace(track, belief=following, status=Status.TRACKING)
        if reason not in (Reason.USED, Reason.NOT_MOVED_ENOUGH, Reason.NO_READING):
            cell = next((str(row.cell) for row in epoch.heard if row.cell is not None), "")
            unused.append(UnusedReading(epoch.time_s, "serving", cell, reason))
        after = track if memory is track.memory else replace(track, memory=memory)
        return after, news_of(self.area, after, epoch.time_s, reason, tuple(unused))

    def warm_up(self, merged: Sequence[Epoch]) -> None:  # noqa: ARG002
        """Load the compiled kernels, and prepare the area."""
        if self.grid:
            return
        model, rng = self.model, np.random.default_rng(0)
        west, south = model.area.origin_m
        small = replace(self, options=replace(self.options, max_particles=64, min_particles=32))
        track = small.begin_at(west, south, 1.0, rng)
        track, _ = small.step(track, Epoch(0.0, (MotionStep(1.0, 0.0),)), rng)
        if track.belief is not None and model.area.cell_ids:
            small.filter_for(True).update(track.belief, _every_kind(), rng)

    def smoother(self) -> BayesSmoother | None:
        """Return a new smoother where positions shall be smoothed."""
        return BayesSmoother(self.area, self.model.motion) if self.smooth else None

    def hypotheses(self, state: BayesTrack) -> Hypotheses | None:
        """Return the hypotheses of the belief that leads."""
        belief, (west, south) = state.leading, self.area.origin_m
        if belief is None:
            return None
        return Hypotheses(
            belief.state[0].astype(np.float64) + west,
            belief.state[1].astype(np.float64) + south,
            belief.weight.astype(np.float64),
        )

    def _weigh(
        self,
        track: BayesTrack,
        before: MapBelief,
        reading: RadioReading,
        sky: GnssUpdate,
        epoch: Epoch,
        rng: np.random.Generator,
    ) -> tuple[BayesTrack, Reason]:
        """Weigh the belief, and its challenger, which may start, win or give up."""
        told = sky.for_main(reading)
        belief, info = self.filter_for(track.compass).update(before, told, rng)
        if info.reason is not Reason.USED:
            return replace(track, belief=belief), info.reason
        gained = belief.log_evidence - before.log_evidence
        doubt = track.doubt.after(reading.expected, gained, reading.length_m)
        cells_only = reading.levels is None and not reading.bounds
        if reading.serving < 0 and np.isfinite(track.memory.heard_at_m).any():
            # Satellites or times of arrival between two reports: levels are told all the same.
            cells_only = False
        challenger, wins, heard = track.challenger, track.wins, track.sky
        if challenger is not None:
            told = sky.for_other(reading)
            other, _ = self.filter_for(track.compass).update(challenger.belief, told, rng)
            gained = other.log_evidence - challenger.belief.log_evidence
            own = challenger.doubt.after(reading.expected, gained, reading.length_m)
            challenger = replace(challenger, belief=other, doubt=own)
        now = resolve_alternative(
            self.rules, track.status, belief, doubt, challenger, track.memory.travelled_m,
            cells_only=cells_only,
        )  # fmt: skip
        if now.taken_over and challenger is not None:
            wins, heard = wins + 1, challenger.sky
        most = self.rules.doubt_of_cells if cells_only else self.rules.doubt
        challenger = now.challenger
        if (
            track.challenger is None
            and now.status is not Status.CONVERGED
            and (now.doubt.sum >= most or sky.disputed)
        ):
            challenger = self._challenger(track, now.belief, epoch, rng)
        after = BayesTrack(
            track.memory, now.belief, track.heading_rad, track.compass, now.status, now.doubt,
            challenger, wins, heard, track.timed_at_m,
        )  # fmt: skip
        return after, Reason.USED

    def _challenger(
        self, track: BayesTrack, main: MapBelief, epoch: Epoch, rng: np.random.Generator
    ) -> AlternativeHypothesis | None:
        """Start from scratch: from the report alone, as if it were the first."""
        empty = RadioHistory.empty(len(self.area.cell_ids))
        _, reading, _, _ = reading_of(self.area, self.model.evidence, empty, epoch)
        _, reading, _ = self._timed(replace(track, timed_at_m=NEVER), epoch, reading)
        reading = self._sky.first(reading, epoch)
        if reading is None:
            return None
        belief, heard = self._start(track, reading, epoch, rng)
        travelled_m = track.memory.travelled_m
        return AlternativeHypothesis(
            belief, travelled_m, main.log_evidence, epoch.time_s, heard, doubt=track.doubt.none()
        )

    def _start(
        self, track: BayesTrack, reading: RadioReading, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[MapBelief, GnssState]:
        belief = self.filter_for(track.compass).init(Start(reading, track.compass), rng)
        return self._sky.begin(belief, epoch, track.memory.travelled_m)

    def _timed(
        self, track: BayesTrack, epoch: Epoch, reading: RadioReading | None
    ) -> tuple[BayesTrack, RadioReading | None, list[UnusedReading]]:
        """Add what times of arrival tell to a report."""
        if not is_timed(epoch):
            return track, reading, []
        reading, timed_at_m, unused = with_timing(
            self.area, self.timing, epoch, reading, track.timed_at_m, track.memory.travelled_m,
            advances=self.model.timed_by_sites,
        )  # fmt: skip
        return replace(track, timed_at_m=timed_at_m), reading, unused

    def _move(
        self, track: BayesTrack, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesTrack, list[UnusedReading]]:
        unused: list[UnusedReading] = []
        belief, memory, heading_rad = track.belief, track.memory, track.heading_rad
        compass, challenger = track.compass, track.challenger
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
            belief, why = self.filter_for(track.compass).predict(belief, step, rng)
            memory = memory.moved(step)
            if challenger is not None:
                other, _ = self.filter_for(track.compass).predict(challenger.belief, step, rng)
                challenger = replace(challenger, belief=other)
            if why is not Reason.USED:
                unused.append(UnusedReading(epoch.time_s, "motion", "", why))
        moved = BayesTrack(
            memory,
            belief,
            heading_rad,
            compass,
            track.status,
            track.doubt,
            challenger,
            track.wins,
            track.sky,
            track.timed_at_m,
        )
        return moved, unused

    def _without_compass(self, belief: MapBelief, rng: np.random.Generator) -> MapBelief:
        if isinstance(belief, GridBelief):
            grid = StreetGrid(self.model, compass=False)
            count = grid.bias_rad.size
            on, off = (
                np.repeat(mass.sum(axis=0, keepdims=True) / count, count, axis=0)
                for mass in (belief.on, belief.off)
            )
            return replace(belief, on=on, off=off, model=grid)
        state = self.model.any_heading(belief.state, _MOST_TIMES, rng)
        log_weight = np.tile(belief.log_weight, _MOST_TIMES) - np.log(_MOST_TIMES)
        return replace(belief, state=state, log_weight=log_weight)


def _every_kind() -> RadioReading:
    one, none = np.ones(1, dtype=np.float32), np.zeros(1, dtype=np.int32)
    levels = LevelReading(none, one, one, one, 0.3, 1.0, 3.0, 0.0, 0.0)
    return RadioReading(0, 1.0, levels, (BoundReading(none, -60.0, 1, 8.0, 1.0),))
