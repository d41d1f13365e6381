"""Timing advances and time differences of arrival as evidence.

Their errors last for some distance: readings in a row count as one over the distance at which the
errors become independent. Those of time differences may be other than stated
(:mod:`mapfilter.positioning.bayes.sources.timing_errors`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot, inf, isfinite, nan
from typing import ClassVar, NamedTuple

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import Reason
from mapfilter.models.gaussian import GaussianTerms
from mapfilter.models.ranging import range_differences, timing_advances
from mapfilter.models.state import StateLayout
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.sources.evidence import Context, EvidenceSource, EvidenceUpdate
from mapfilter.positioning.bayes.sources.timing_errors import (
    NULL_FACTOR,
    DifferenceErrors,
    DifferenceTerm,
)
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Difference, Epoch
from mapfilter.positioning.gnss.options import TimingOptions
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.schema import Kind


class TimingState(NamedTuple):
    """Distances travelled when timing advances and differences were last used.

    ``errors`` is what is known of those of differences.
    """

    advance_m: float = -inf
    difference_m: float = -inf
    errors: DifferenceErrors = DifferenceErrors()


@dataclass(frozen=True, eq=False)
class TimingTerm:
    """Log-likelihood of distances.

    Parameters
    ----------
    model : GaussianTerms
        Of east and north in the frame of the hypotheses.
    reading_m : (m,) array
        Measured distances.
    weight : float
        Share of the reading that is new, 0 to 1.
    clip_sd : float
        Largest innovation in standard deviations; outliers count as this.
    """

    model: GaussianTerms
    reading_m: Floats
    weight: float
    clip_sd: float

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return the log-likelihood of each hypothesis."""
        off = self.reading_m - self.model.mean(state[:2].T.astype(np.float64))
        white = np.linalg.solve(np.linalg.cholesky(self.model.noise), off.T)
        square = np.minimum(np.sum(white**2, axis=0), self.clip_sd**2 * self.reading_m.size)
        return np.asarray(-0.5 * self.weight * square)

    @property
    def under_null(self) -> float:
        """Log-likelihood under the null hypothesis, from what is expected at the true position."""
        return -0.5 * NULL_FACTOR * self.weight * self.reading_m.size


@dataclass(frozen=True)
class TimingSource(EvidenceSource):
    """Timing advances and time differences, by the distances of sites.

    ``advances`` is False where a measured map of timing advances is used instead.
    """

    area: AreaFrame
    options: TimingOptions
    advances: bool = True
    name: ClassVar[str] = "timing"
    kinds: ClassVar[frozenset[Kind]] = frozenset({"serving", "neighbour", "tdoa"})

    def begin(self) -> TimingState:
        """Return the state before the first reading."""
        return TimingState()

    def first(self, epoch: Epoch) -> EvidenceUpdate:
        """Read an epoch as if it were the first."""
        return self.read(TimingState(), epoch, 0.0)

    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:  # noqa: ARG002
        """Read the epoch's timing advances and differences."""
        before, belief = state.sources[self.name], state.belief
        return self.read(before, epoch, state.reckoning.travelled_m, belief)

    def read(
        self,
        state: TimingState,
        epoch: Epoch,
        travelled_m: float,
        belief: MapBelief | None = None,
    ) -> EvidenceUpdate:
        """Return the terms of an epoch, each weighted by the share of its error that is new."""
        unused: list[UnusedReading] = []
        terms: list[TimingTerm | DifferenceTerm] = []
        if not epoch.tdoa and not any(isfinite(row.timing_advance) for row in epoch.radio):
            return EvidenceUpdate(state, unused=unused)
        share = _new_share(travelled_m - state.advance_m, self.options.advance_memory_m)
        if self.advances and share > 0 and self._add_advances(epoch, share, terms, unused):
            state = state._replace(advance_m=travelled_m)
        share = _new_share(travelled_m - state.difference_m, self.options.difference_memory_m)
        if share > 0:
            differences = self._differences(epoch, share, state.errors, unused)
            if differences:
                state = state._replace(difference_m=travelled_m)
                if belief is not None:
                    state = state._replace(errors=state.errors.after(differences, belief))
            terms += differences
        under_null = sum(one.under_null for one in terms)
        return EvidenceUpdate(state, tuple(terms), under_null=under_null, unused=unused)

    @property
    def _layout(self) -> StateLayout:
        return StateLayout(2, 0, 1, height_m=self.options.height_m)

    def _site(self, cell: str) -> list[float]:
        (east, north, up), (west, south) = self.area.sites[cell], self.area.origin_m
        return [east - west, north - south, up]

    def _add_advances(
        self,
        epoch: Epoch,
        share: float,
        terms: list[TimingTerm | DifferenceTerm],
        unused: list[UnusedReading],
    ) -> bool:
        options, known = self.options, []
        for row in epoch.radio:
            if row.cell is None or not isfinite(row.timing_advance):
                continue
            if row.cell in self.area.sites:
                known.append((row.cell, row.timing_advance))
            else:
                unused.append(UnusedReading(epoch.time_s, "ta", row.cell, Reason.UNKNOWN_CELL))
        if not known:
            return False
        sigma_m = hypot(options.advance_sd_m, options.step_m / 12**0.5)
        model = timing_advances(self._layout, [self._site(cell) for cell, _ in known], sigma_m)
        reading_m = np.array([(steps + 0.5) * options.step_m for _, steps in known])
        terms.append(TimingTerm(model, reading_m, share, options.clip_sd))
        return True

    def _differences(
        self, epoch: Epoch, share: float, errors: DifferenceErrors, unused: list[UnusedReading]
    ) -> list[DifferenceTerm]:
        """Return one term for each reference, as its differences share the reference's error."""
        by_reference: dict[str, dict[str, Difference]] = {}
        for row in epoch.tdoa:
            if not isfinite(row.difference_m):
                continue
            of = by_reference.setdefault(row.reference, {})
            unknown = [cell for cell in (row.cell, row.reference) if cell not in self.area.sites]
            if unknown:
                unused.append(UnusedReading(epoch.time_s, "tdoa", unknown[0], Reason.UNKNOWN_CELL))
            elif row.cell in of:
                unused.append(UnusedReading(epoch.time_s, "tdoa", row.cell, Reason.SECOND_READING))
            elif self._site(row.cell) != self._site(row.reference):
                of[row.cell] = row
        terms: list[DifferenceTerm] = []
        for reference, rows in by_reference.items():
            if not rows:
                continue
            stations = (reference, *rows)
            reference_m = next((one.reference_sigma_m for one in rows.values()), nan)
            stated_m = np.array([reference_m, *(one.sigma_m for one in rows.values())])
            sigma_m = np.where(np.isfinite(stated_m), stated_m, self.options.difference_sd_m)
            sites = [self._site(cell) for cell in stations]
            model = range_differences(self._layout, sites, sigma_m)
            reading_m = np.array([one.difference_m for one in rows.values()])
            clip_sd = self.options.clip_sd
            term = DifferenceTerm(model, reading_m, stations, sigma_m, share, clip_sd, errors)
            terms.append(term)
        return terms


def _new_share(gone_m: float, memory_m: float) -> float:
    return 1.0 - exp(-2.0 * gone_m / memory_m) if isfinite(gone_m) else 1.0
