"""Locate a log: what notebooks call first."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from html import escape
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from mapfilter._arguments import Entries, Setting, check_arguments, generator
from mapfilter._words import number_of
from mapfilter.api.given import log_argument, opened, optional_database
from mapfilter.api.mapless import over_sites, own_sites, without_sites
from mapfilter.api.motion import with_right_motion
from mapfilter.api.python_words import in_python, python_words
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults, InputError
from mapfilter.evaluation.truth import Truth
from mapfilter.options import Probability
from mapfilter.positioning import loop
from mapfilter.positioning.assumed_errors import assumed_note, undirected_notes
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.filter import Filter
from mapfilter.positioning.integrity import DEFAULT_RISK
from mapfilter.positioning.locators import DEFAULT, as_filter, given_options
from mapfilter.positioning.log_lacks import (
    NO_MOTION,
    POSITIONS_ALONE,
    REPORTS_ALONE,
    advice_of,
    check_places,
    coarse_pixels_note,
    follows_positions,
    has_reports_alone,
    is_of_reports_alone,
    lack_of_log,
)
from mapfilter.positioning.log_options import STREETS_ALONE, by_streets_alone, fitted_to_log
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.positioning.timing_steps import with_one_step, with_plan_technologies
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.checks.range_units import with_range_notes
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import Without
from mapfilter.viewing.notebook import View
from mapfilter.viewing.runs import ViewedRun
from mapfilter.viewing.trace import TraceRecorder

if TYPE_CHECKING:
    import geopandas as gpd
    from matplotlib.axes import Axes

_COURSE_MOTION = "mf.read_log makes it of a recording's positions with course_motion=True"


@dataclass(frozen=True, repr=False, eq=False)
class Track:
    """A located log: positions with their uncertainty, as tables and pictures.

    Parameters
    ----------
    positioned : PositionedTrack
        The filter's result: an estimate, snapshots of its hypotheses, and the processor time of
        this process in seconds, without reading the database. In a fresh installation the first
        track of a filter includes the compilation of kernels, up to 20 s.
    database : RadioRouteDatabase or None
        None where the filter needed no map.
    trace : TraceRecorder or None
        The beliefs and explanations that :meth:`view` shows, where ``record`` asked for them.
    """

    positioned: PositionedTrack
    log: TrackLog
    database: RadioRouteDatabase | None
    trace: TraceRecorder | None = None

    @property
    def estimate(self) -> TrackEstimate:
        """All arrays of the estimate, and the reason for each measurement not used."""
        return self.positioned.estimate

    def __len__(self) -> int:
        return len(self.estimate)

    def __repr__(self) -> str:
        notes = number_of(len(self.log.notes), "note") + " in log.notes"
        return (
            f"Track by {self.estimate.filter}: {self.estimate.summary}, "
            f"{self.positioned.filter_s:.2f} s of processor time"
            f"{f'; {notes}' if self.log.notes else ''}"
        )

    def _repr_html_(self) -> str:
        """Return the summary and the last epochs, as notebooks show them."""
        return f"<p>{escape(repr(self))}</p>{self.to_dataframe().tail().to_html()}"

    def view(self, *, height_px: int = 720) -> View:
        """Return the replay as an interactive page, which notebooks show in place.

        Without ``record=True`` in :func:`locate` the page has no belief and explains nothing.

        Parameters
        ----------
        height_px : int
            Height of the frame in a notebook.
        """
        from mapfilter.viewing.bundle import replay_bundle

        estimate = self.estimate
        run = ViewedRun(estimate.filter, estimate, self.log, trace=self.trace)
        return View(replay_bundle(f"Replay by {estimate.filter}", [run], self.database), height_px)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each epoch: position (m), radii (m), status, reason and so on."""
        return self.estimate.to_dataframe()

    def to_geodataframe(self) -> gpd.GeoDataFrame:
        """Return the same with points in the CRS of the log, without unlocated epochs."""
        return self.estimate.to_geodataframe()

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the track and the ground truth over the streets of the database, if there is one.

        Where there is none, the ground is plain.
        A script saves the picture with ``mf.save_picture(axes, "track.png")``.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; a new figure when left out.

        Raises
        ------
        ConfigError
            What is given are no axes, such as a figure.
        """
        from mapfilter.report.track import plot_track
        from mapfilter.workflows.outputs.served import served_points, street_map

        base = None
        if self.database is not None:
            base = street_map(self.database, served_points(self.database))
        truth, fixes_m = Truth.of_table(self.log.truth), self.log.fixes_m
        return plot_track(self.estimate, truth, base, ax=ax, fixes_m=fixes_m)


@python_words()
def locate(
    log: TrackLog | Path | str,
    database: RadioRouteDatabase | Path | str | None = None,
    filter: Any = DEFAULT,  # noqa: A002
    *,
    seed: int | np.random.Generator = 0,
    ways: bool = True,
    snapshots: bool = False,
    risk: float = DEFAULT_RISK,
    record: bool = False,
    factors: Mapping[str, float] | None = None,
    without: Collection[Without] = (),
) -> Track:
    """Locate a log from an unknown start.

    Parameters
    ----------
    log : TrackLog or path
        A log of another CRS than the database is projected, with a note; a path is read as by
        :func:`mapfilter.read_log` in that CRS. Cells that it names by identity (mcc, mnc, lac, ci)
        get the ids of the database.
    database : RadioRouteDatabase, path or None
        A path is opened by each call; open it once for many logs. Kalman-type filters need none:
        ``locate(log, filter="ekf")`` is by GNSS fixes and dead reckoning. For levels and timing
        advances they need sites: ``KalmanFilter().over_sites(plan)``; else these are left out, with
        a note. Nor does a :class:`mapfilter.Filter` of yours that is over no database. Without one
        a path is read in the UTM zone of its positions, or the CRS of the sites or the filter.
    filter : options, str, Filter or class
        Options such as ``BayesFilter(level_error_db=8.0)``, the name of a filter, or a custom
        filter (see the page "Extending"). The Bayes map filter when left out. What the log states
        takes the place of defaults, also of those of a filter that options made (``over``,
        ``over_sites``): the step of timing advance by technology, and of levels; turns
        without headings, at a vehicle's speed, are a vehicle's. A log of motion alone is located by
        the streets alone. The notes of the track's ``log`` say so, and what is lacking where
        nothing was located.
    seed : int or numpy.random.Generator
        Equal logs, databases, options and seeds give equal bytes.
    ways : bool
        Whether positions of the candidate filter and of custom filters are matched to ways. The
        Bayes and the grid filter always match them, Kalman-type filters never.
    snapshots : bool
        Whether to keep the filter's hypotheses at some epochs, for pictures.
    risk : float
        Probability, at each epoch, that the error exceeds the protection level (``protection_m``).
    record : bool
        Whether to record what :meth:`Track.view` explains; takes a few times as long.
    factors : mapping of str to float, optional
        By which columns of motion are multiplied, as of :func:`mapfilter.read_log`. One of 1 takes
        a column as it is, although the log's fixes contradict it.
    without : collection of str
        Measurements that are left out, such as ``["gnss", "ta"]``: see
        :func:`mapfilter.tracks.kinds.leave_out`.

    Raises
    ------
    InputError
        The log is in a local frame, unlike the database; all of its fixes, or of its ground truth,
        lie more than 5 km outside of the database; or its fixes prove that a column of its motion
        is of another unit or sense, for which there is no factor.
    StoreError
        A path holds no database, or one that is damaged.
    ConfigError
        Log or database is neither, the filter needs a database and there is none, or sites for the
        radio of a log without positions, the seed is none, the filter is none, a custom filter
        fails, the risk does not lie between 0 and 1, or another argument is of another type.
    """
    check_arguments(
        "locate",
        log_argument(log),
        optional_database(database),
        keywords=[
            Setting("ways", ways, bool),
            Setting("snapshots", snapshots, bool),
            Setting("risk", risk, Probability),
            Setting("record", record, bool),
            Entries("factors", factors, Real, "a number", "the factor of each column of motion"),
        ],
    )
    rng = generator("locate", seed)
    given_filter = given_options(filter)
    database = None if database is None else opened(database)
    plan = own_sites(given_filter) if database is None else database.plan
    about_deg = None if plan is None else plan.middle_deg
    about_deg = about_deg if database is None else database.lattice.middle_deg
    log = with_right_motion(log, "" if plan is None else plan.crs, about_deg, factors or {})
    log = leave_out(log, without)
    if plan is None:
        log, plan = without_sites(log), CellPlan(log.crs, ())
    else:
        log = in_frame(log, plan.crs, about_deg)
    if database is not None:
        faults = Faults()
        check_places("log", log, database.lattice, faults)
        faults.raise_if_any(InputError)
    log = with_plan_technologies(with_range_notes(name_by_plan(log, plan), plan), plan)
    made = given_filter if isinstance(given_filter, Filter) else None
    chosen = given_filter if made is None or made.made_of is None else made.made_of
    log = with_one_step(log, chosen)
    options, notes = fitted_to_log(chosen, log)
    alone = made is None and database is not None and by_streets_alone(options, log, database)
    notes = (*notes, STREETS_ALONE) if alone else notes
    notes = (*notes, *undirected_notes(log, options))
    if made is not None:
        bound = made if options is chosen else made.with_options(options)
    elif database is None:
        bound = over_sites(options, plan)
    else:
        bound = as_filter(options, database.without_cells() if alone else database, ways=ways)
    notes = (*notes, *assumed_note(log, options, bound.uses))
    log = replace(log, notes=(*log.notes, *notes)) if notes else log
    trace = TraceRecorder(bound) if record else None
    found = loop.locate(log, bound, rng, snapshots=snapshots, risk=risk, recorder=trace)
    notes = _not_located(log, options, found.estimate, database)
    if database is not None and (alone or not database.cell_ids):
        notes += advice_of(log, options, found.estimate)
    notes += coarse_pixels_note(options, found.estimate, database)
    told = tuple(map(in_python, (*log.notes, *notes)))
    log = log if told == log.notes else replace(log, notes=told)
    return Track(found, log, database, trace)


def _not_located(
    log: TrackLog, options: Any, estimate: TrackEstimate, database: RadioRouteDatabase | None
) -> tuple[str, ...]:
    """Return a note on what a log lacks that was not located, or not by motion; with a remedy."""
    if is_of_reports_alone(log, options, estimate):
        return (f"{REPORTS_ALONE} (mf.locate_reports locates each report by itself)",)
    if follows_positions(log, options, estimate):
        return (f"{POSITIONS_ALONE} ({_COURSE_MOTION})",)
    lack = lack_of_log(log, options, estimate, database)
    remedies = []
    if NO_MOTION in lack and max(len(log.gnss), len(log.truth)) > 1:
        remedies.append(_COURSE_MOTION)
    if NO_MOTION in lack and len(log.radio):
        remedies.append("mf.locate_reports needs none")
    if NO_MOTION in lack and len(log.gnss):
        remedies.append('filter="ekf" needs none beside positions')
    if NO_MOTION not in lack and database is not None and has_reports_alone(log):
        remedies.append("mf.locate_reports locates each report by itself")
    remedy = f" ({'; '.join(remedies)})" if remedies else ""
    return (f"nothing is located: {lack}{remedy}",) if lack else ()
