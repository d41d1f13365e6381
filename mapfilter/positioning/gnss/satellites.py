"""Satellites in the map filter: what an epoch's pseudoranges and fixes do to a track."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.positioning.bayes.alternative import AlternativeHypothesis, MapBelief
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.state import BayesTrack
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.positioning.gnss.gate import GnssGate, Listened
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.readings import range_sigma_m, sky_over
from mapfilter.positioning.gnss.receiver import LINEAR, Sky, begun, near_clock, weighed
from mapfilter.positioning.gnss.state import NO_GNSS_STATE, GnssState

_FIRST_GRAIN_M = 10.0
_BLIND_START = 0.1
"""Share of a first belief that does not believe satellites."""


@dataclass(frozen=True, eq=False)
class FirstRanges:
    """What the first pseudoranges say of places, whatever the clock.

    Parameters
    ----------
    sky : Sky
    sigma_m : (m,) array
    options : GnssOptions
    """

    sky: Sky
    sigma_m: Floats
    options: GnssOptions

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return it for each place, their mean being 1."""
        count = state.shape[1]
        receiver = near_clock(self.sky, begun(self.options, 0.0, 0.0))
        found = weighed(
            self.sky, self.sigma_m, receiver, state[:2], np.zeros(count), np.zeros((LINEAR, count))
        )
        blind = np.log(_BLIND_START)
        return np.asarray(np.logaddexp(np.log1p(-_BLIND_START) + found.gain, blind))


@dataclass(frozen=True, eq=False)
class GnssUpdate:
    """What satellites and fixes of an epoch are to a track's beliefs.

    Parameters
    ----------
    main, other : Listened or None
        To the belief and to its challenger.
    disputed : bool
        Whether they have gone against the belief for long.
    unused : tuple of UnusedReading
    """

    main: Listened | None = None
    other: Listened | None = None
    disputed: bool = False
    unused: tuple[UnusedReading, ...] = ()

    @property
    def says(self) -> bool:
        """Whether there is anything to weigh the belief by."""
        return self.main is not None and bool(self.main.also)

    def for_main(self, reading: RadioReading) -> RadioReading:
        """Return what the belief is weighed by."""
        return _with(reading, self.main)

    def for_other(self, reading: RadioReading) -> RadioReading:
        """Return what the challenger is weighed by."""
        return _with(reading, self.other)


NO_NEWS = GnssUpdate()


@dataclass(frozen=True)
class Satellites:
    """Satellites for a map filter.

    Parameters
    ----------
    listener : GnssGate
    middle_m : (float, float)
        Of the area, in the frame of the hypotheses.
    ranges : bool
        Whether the filter's hypotheses can carry a clock.
    """

    listener: GnssGate
    middle_m: tuple[float, float]
    ranges: bool = True

    def hear(
        self, track: BayesTrack, epoch: Epoch, particle_spacing_m: float, spacing_m: float
    ) -> tuple[BayesTrack, GnssUpdate]:
        """Compare an epoch's satellites with a track's beliefs, which then carry their clocks.

        They are listened to when a report counts, ``spacing_m`` after the last one, or by
        themselves where no report comes.
        """
        if track.belief is None or (epoch.fix is None and not epoch.ranges):
            return track, NO_NEWS
        travelled_m, memory = track.memory.travelled_m, track.memory
        reported = bool(epoch.heard) and travelled_m - memory.used_at_m >= spacing_m
        if not reported and not track.sky.due(self.options, epoch.time_s, travelled_m):
            return track, NO_NEWS
        listen = self.listener.listen
        main = listen(track.belief, track.sky, epoch, travelled_m, particle_spacing_m)
        track = replace(track, belief=main.belief, sky=main.memory)
        other, challenger = None, track.challenger
        if challenger is not None:
            other = listen(
                challenger.belief, challenger.sky, epoch, travelled_m, particle_spacing_m
            )
            challenger = replace(challenger, belief=other.belief, sky=other.memory)
            if main.heard or other.heard:
                challenger = self._sided(challenger, main.memory, epoch.time_s)
            track = replace(track, challenger=challenger)
        since_s = main.memory.since_s
        disputed = main.memory.rejects and epoch.time_s - since_s >= self.options.dispute_s
        unused = tuple(UnusedReading(epoch.time_s, *told) for told in main.told)
        return track, GnssUpdate(main, other, disputed, unused)

    @property
    def options(self) -> GnssOptions:
        """How far satellites are trusted."""
        return self.listener.options

    def _sided(
        self, challenger: AlternativeHypothesis, main: GnssState, time_s: float
    ) -> AlternativeHypothesis:
        """Count for whom satellites speak; but no further than they may be faulty as a whole."""
        most = self.options.trust
        most += max(time_s - challenger.began_s, 0.0) / self.options.trust_grows_s
        step = float(main.rejects) - float(challenger.sky.rejects)
        by = min(max(challenger.by_satellites + step, -most), most)
        return replace(challenger, by_satellites=by)

    def first(self, reading: RadioReading | None, epoch: Epoch) -> RadioReading | None:
        """Return what a first belief is made of: a report, and what satellites say of places."""
        if not epoch.ranges or not self.ranges:
            return reading
        listener = self.listener
        sky, _ = sky_over(listener.options, listener.crs, listener.origin_m, epoch, self.middle_m)
        if sky is None:
            return reading
        sigma_m = range_sigma_m(listener.options, sky, np.inf, _FIRST_GRAIN_M)
        given = reading or RadioReading()
        return replace(given, also=(*given.also, FirstRanges(sky, sigma_m, listener.options)))

    def begin(
        self, belief: MapBelief, epoch: Epoch, travelled_m: float
    ) -> tuple[MapBelief, GnssState]:
        """Return a first belief whose hypotheses carry the clock that they must have."""
        if not epoch.ranges and epoch.fix is None:
            return belief, NO_GNSS_STATE
        found = self.listener.listen(belief, NO_GNSS_STATE, epoch, travelled_m, _FIRST_GRAIN_M)
        return found.belief, found.memory


def _with(reading: RadioReading, heard: Listened | None) -> RadioReading:
    if heard is None or not heard.also:
        return reading
    return replace(reading, also=(*reading.also, *heard.also))
