"""What the Bayes map filter knows after an epoch, and what is new."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, isfinite, nan, sqrt

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.hypotheses import BeliefSummary, empty_summary
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.alternative import AlternativeHypothesis, EvidenceCusum, MapBelief
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import RadioHistory
from mapfilter.positioning.epochs import ReportRow
from mapfilter.positioning.estimate import Fix, StepOutput, UnusedReading
from mapfilter.positioning.gnss.state import NO_GNSS_STATE, GnssState
from mapfilter.positioning.matched_way import matched_way


@dataclass(frozen=True, eq=False)
class BayesTrack:
    """What is known after an epoch.

    Parameters
    ----------
    memory : RadioHistory
        Of dead reckoning and levels.
    belief : MapBelief or None
        None before the first report that can be placed.
    heading_rad : float
        Of the last step; without a compass counted from the first one.
    compass : bool
        Whether headings are a compass's.
    status : Status
    doubt : EvidenceCusum
    challenger : AlternativeHypothesis or None
        Beside a belief in doubt.
    wins : int
        How many challengers have taken over.
    sky : GnssState
        Of the belief.
    timed_at_m : (float, float)
        Distance travelled when timing advances and time differences were last used.
    """

    memory: RadioHistory
    belief: MapBelief | None = None
    heading_rad: float = nan
    compass: bool = True
    status: Status = Status.SEARCHING
    doubt: EvidenceCusum = field(default_factory=EvidenceCusum)
    challenger: AlternativeHypothesis | None = None
    wins: int = 0
    sky: GnssState = NO_GNSS_STATE
    timed_at_m: tuple[float, float] = (-inf, -inf)

    @property
    def leading(self) -> MapBelief | None:
        """The belief to go by: the challenger's where the first one is lost."""
        lost = self.status is Status.LOST and self.challenger is not None
        return self.challenger.belief if lost and self.challenger else self.belief


_STREET_SHARE = 0.3
_FIRST_GRAIN_M, _LEAST_GRAIN_M = 5.0, 1.5


def news_of(
    area: AreaMap,
    track: BayesTrack,
    time_s: float,
    reason: Reason,
    unused: tuple[UnusedReading, ...],
) -> StepOutput:
    """Return what a track says after an epoch.

    Parameters
    ----------
    area : AreaMap
    track : BayesTrack
        After the epoch.
    time_s : float
    reason : Reason
        Whether the epoch's report was used.
    unused : tuple of UnusedReading
    """
    belief, (west, south) = track.leading, area.origin_m
    if belief is None:
        said, count, way = empty_summary(STATES), 0, (0, nan)
    else:
        said, count = belief.summary, belief.log_weight.size
        way = matched_way(area, belief.state[0], belief.state[1], belief.weight)
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
    return StepOutput(fix, evidence, unused)


def particle_spacing_of(track: BayesTrack) -> float:
    """Return how far hypotheses lie apart where the belief is, and no less than they are good."""
    belief = track.belief
    if belief is None or not belief.log_weight.size:
        return _FIRST_GRAIN_M
    area_m2 = _STREET_SHARE * belief.bins.size_m**2 * belief.summary.effective_bins
    return max(sqrt(area_m2 / belief.log_weight.size), _LEAST_GRAIN_M)


def name_of(row: ReportRow) -> str:
    """Return what messages call the cell of a report's row."""
    if row.cell is not None:
        return row.cell
    bsic = "unknown" if row.bsic is None else row.bsic
    return "" if row.arfcn is None else f"ARFCN {row.arfcn}, BSIC {bsic}"


def _evidence(
    said: BeliefSummary, west: float, south: float, log_evidence: float
) -> tuple[float, float, float, float, float]:
    east_m = north_m = nan
    mass = 0.0 if isfinite(said.entropy_bits) else nan
    if len(said.runners_up):
        east_m, north_m, mass = said.runners_up[0].tolist()
    return east_m + west, north_m + south, mass, said.entropy_bits, log_evidence
