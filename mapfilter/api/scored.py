"""Score a located track against ground truth."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import pandas as pd

from mapfilter._arguments import Argument, check_arguments
from mapfilter._same import EqualByContent
from mapfilter.api.located import Track
from mapfilter.errors import Faults, InputError, fail
from mapfilter.evaluation.accuracy import (
    Accuracy,
    accuracy,
    held_by_radius_95,
    mean_of,
    position_errors_m,
)
from mapfilter.evaluation.truth import Truth
from mapfilter.evaluation.truth_notes import truth_notes
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.tracks.checks.misplaced import check_near
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.projected import truth_in
from mapfilter.tracks.stated_crs import crs_stated
from mapfilter.tracks.tables import tidy_table

_NO_TRUTH = (
    "the log has no ground truth; mf.read_log(..., truth=FILE) takes that of another recording"
)


_NO_FIGURES = ("error_m", "notes")


@dataclass(frozen=True, repr=False, eq=False)
class Score(EqualByContent, Accuracy):
    """Accuracy of one track against ground truth.

    Besides the figures of :class:`mapfilter.evaluation.accuracy.Accuracy`, how often the radius
    holds the true position, and the error of each epoch.

    Parameters
    ----------
    within_95 : float
        Share of the scored epochs with a radius whose 95 % radius holds the true position; NaN
        without any.
    error_m : (N,) array
        NaN where the track has no position, or the ground truth none.
    notes : tuple of str
        Epochs that the ground truth does not cover, and times of it that fit far better when they
        are moved, as those of another clock or time zone.
    """

    within_95: float = nan
    error_m: Any = None
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return "\n  ".join((self._summary, *self.notes))

    @property
    def _summary(self) -> str:
        if not self.switched:
            return "Score: the filter never converged"
        then = "no error is known"
        if self.scored_epochs:
            then = f"then {self.error_mean_m:.1f} m on average, {self.error_95_m:.1f} m at 95 %"
            if isfinite(self.within_95):
                then += f"; the 95 % radius holds {self.within_95:.2f}"
        if self.success is None:
            return f"Score: converged where there is no ground truth; {then}"
        outcome = "right" if self.success else "wrong"
        return (
            f"Score: converged after {self.switch_distance_m:.0f} m, "
            f"{self.error_at_switch_m:.1f} m off ({outcome}); {then}"
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Return the figures as a table of one row."""
        return pd.DataFrame([{k: v for k, v in asdict(self).items() if k not in _NO_FIGURES}])


def score(track: Track | TrackEstimate, truth: TrackLog | pd.DataFrame | Truth) -> Score:
    """Compare a track with ground truth.

    Parameters
    ----------
    truth : TrackLog, DataFrame or Truth
        A log with ground truth; or its table ``truth``, or another one with the columns ``time_s``,
        ``east_m`` and ``north_m``. Where the log is in another CRS than the track, its truth is
        projected; other tables are in the CRS of the track. As in :func:`mapfilter.make_log`,
        ``time_s`` may be the index, rows are sorted by time, and exact duplicates dropped.

    Raises
    ------
    InputError
        The ground truth has fewer than two positions, lacks a column, has values that no log may
        have, such as NaN, or lies more than 5 km outside of the track's database.
    ConfigError
        There is no track, or no ground truth.
    """
    check_arguments(
        "score",
        Argument("track", track, Track | TrackEstimate, "a track of locate"),
        Argument("truth", truth, TrackLog | pd.DataFrame | Truth, "a log, or its table truth"),
    )
    estimate = track.estimate if isinstance(track, Track) else track
    truth = truth.truth if isinstance(truth, TrackLog) else truth
    if not isinstance(truth, Truth):
        if truth.index.name == "time_s" and "time_s" not in truth:
            truth = truth.reset_index()
        lacking = {"time_s", "east_m", "north_m"} - set(truth.columns)
        if lacking:
            expected = "columns time_s, east_m and north_m"
            raise fail(InputError, "truth", expected, ", ".join(map(str, truth.columns)))
        faults = Faults()
        tidy, _ = tidy_table("truth", truth, "truth", faults)
        faults.raise_if_any(InputError)
        known = Truth.of_table(truth_in(estimate.crs, tidy, crs_stated(truth)))
        if known is None:
            got, hint = (len(truth), "") if len(truth) else ("none", _NO_TRUTH)
            raise fail(InputError, "truth", "two positions or more", got, hint)
        truth = known
    if isinstance(track, Track) and track.database is not None:
        faults, lattice = Faults(), track.database.lattice
        check_near("truth", truth.east_m, truth.north_m, lattice, faults, "of another journey")
        faults.raise_if_any(InputError)
    figures = asdict(accuracy(estimate, truth))
    within_95 = mean_of(held_by_radius_95(estimate, truth))
    error_m, notes = position_errors_m(estimate, truth), truth_notes(estimate, truth)
    return Score(**figures, within_95=within_95, error_m=error_m, notes=notes)
