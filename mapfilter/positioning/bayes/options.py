"""Everything that can be set of the Bayes map filter."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import radians

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.street_motion import MapWeights, MotionErrors
from mapfilter.positioning.bayes.alternative import AlternativeRules
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.model import BayesModel
from mapfilter.positioning.bayes.radio import EvidenceOptions
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions

_NARROW_BIAS_RAD, _NARROW_SCALE = radians(1.5), 0.015
_MOST_TIMES = 5.0


@dataclass(frozen=True, slots=True)
class BayesOptions:
    """Options of the Bayes map filter.

    Parameters
    ----------
    motion : MotionErrors
        How wrong dead reckoning is.
    map : MapWeights
        How much the streets count.
    evidence : EvidenceOptions
        How much serving cells and levels count.
    particles : ParticleOptions
        Numbers of particles, and the switch rule. The numbers are those for a compass and a step
        length that are nearly right; wide errors get up to five times as many.
    challenge : AlternativeRules
        When a belief in doubt is challenged, and when it is replaced.
    satellites : GnssOptions
        How far pseudoranges and fixes are trusted.
    timing : TimingOptions
        How far timing advances and time differences are trusted.
    smooth : bool
        Whether positions are those in hindsight, by the whole log.
    grid : bool
        The exact filter on the lattice in place of particles: slow, and without the step scale.
    """

    motion: MotionErrors = field(default_factory=MotionErrors)
    map: MapWeights = field(default_factory=MapWeights)
    evidence: EvidenceOptions = field(default_factory=EvidenceOptions)
    particles: ParticleOptions = field(default_factory=ParticleOptions)
    challenge: AlternativeRules = field(default_factory=AlternativeRules)
    satellites: GnssOptions = field(default_factory=GnssOptions)
    timing: TimingOptions = field(default_factory=TimingOptions)
    smooth: bool = False
    grid: bool = False

    def over(self, area: AreaMap) -> BayesPositioner:
        """Return the filter over an area."""
        model = BayesModel(area, self.motion, self.map, self.evidence)
        return BayesPositioner(
            model, self._particles, self.challenge, self.grid, self.satellites, self.timing
        )

    @property
    def _particles(self) -> ParticleOptions:
        """Numbers that cover the lasting errors of heading and scale, too."""
        motion, given = self.motion, self.particles
        width = (motion.bias_sd_rad / _NARROW_BIAS_RAD) * (motion.scale_sd / _NARROW_SCALE)
        times = min(max(width**0.5, 1.0), _MOST_TIMES)
        return replace(given, most=int(times * given.most), searching=int(times * given.searching))


def open_area(database: RadioRouteDatabase) -> AreaMap:
    """Read a whole database into the map that the filter looks up."""
    return AreaMap.of_field(database.field(), database.plan, database.floor_dbm)
