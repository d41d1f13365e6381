"""Pictures of a located log, drawn by another process where that saves time.

What draws takes a third of a second to import, and drawing longer than locating: a process beside
this one imports and draws meanwhile. Modules that draw are therefore imported in functions here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._parallel import begun
from mapfilter._types import Floats
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.report.ground import MAX_PANELS, BaseMap
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.outputs.drawer import DRAWING_LIBRARY, drawer_process
from mapfilter.workflows.outputs.results import PICTURES

if TYPE_CHECKING:
    from mapfilter.report.canvas import Drawn

_CANDIDATES, _BELIEF, _TRACK, _ERROR, _EVIDENCE = PICTURES
_SQUARE_M = 5.0
_DRAWING_LIBRARY = DRAWING_LIBRARY

Handed = dict[str, Callable[[], bytes]]
"""What waits for the PNG of each picture, by its name."""
_NONE: Mapping[str, Callable[[], bytes]] = MappingProxyType({})


@contextmanager
def drawn_beside() -> Iterator[Executor]:
    """Give what draws, as :func:`mapfilter.workflows.outputs.drawer.drawer_process` does."""
    with drawer_process(_DRAWING_LIBRARY) as drawers:
        yield drawers


def get_ready_to_draw() -> None:
    """Import what draws, and load the fonts, which is done once in each process."""
    from mapfilter.report import errors, evidence, snapshots, track  # noqa: F401
    from mapfilter.report.canvas import new_figure
    from mapfilter.report.saving import png_of

    png_of(new_figure(1.0, 1.0).subplots())


@dataclass(frozen=True, eq=False)
class TrackPictures:
    """What the pictures of one located log show.

    Parameters
    ----------
    estimate : TrackEstimate
        Of the log.
    truth : Truth or None
        Its true positions, where the log has them.
    base : BaseMap or None
        The map below; without any, the ground is plain, and evidence is not drawn.
    fixes_m : (k, 2) array or None
        East and north of the positions that the log itself holds, such as GNSS fixes.
    """

    estimate: TrackEstimate
    truth: Truth | None
    base: BaseMap | None
    fixes_m: Floats | None = None

    @classmethod
    def of_log(cls, estimate: TrackEstimate, log: TrackLog, base: BaseMap | None) -> TrackPictures:
        """Return what the pictures of a log show that was located as ``estimate``."""
        return cls(estimate, Truth.of_table(log.truth), base, log.fixes_m)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the pictures that there are, besides that of the belief."""
        error = (_ERROR,) if self.truth is not None else ()
        if self.base is None:
            return (_TRACK, *error) if self._is_anywhere else error
        has_evidence = self.estimate.evidence is not None and len(self.estimate) > 0
        return (_TRACK, *error, *((_EVIDENCE,) if has_evidence else ()))

    @property
    def _is_anywhere(self) -> bool:
        has_fixes = self.fixes_m is not None and len(self.fixes_m) > 0
        located = bool(np.isfinite(self.estimate.east_m).any())
        return located or has_fixes or self.truth is not None


def begin_belief(
    snapshots: Sequence[Snapshot],
    has_evidence: bool,
    truth: Truth | None,
    base: BaseMap,
    drawers: Executor,
) -> Handed:
    """Hand out the picture of the belief, which is known while a log is still being located.

    Of the candidate filter snapshots are of candidates thinning out (Fig. 1 of the paper).
    """
    if not snapshots:
        return {}
    name, spread = (_BELIEF, _places) if has_evidence else (_CANDIDATES, _candidates)
    chosen = choose_snapshots(snapshots, spread)
    return {name: begun(drawers, partial(draw_snapshots, name, chosen, truth, base))}


def begin_pictures(
    shown: TrackPictures, drawers: Executor, handed: Mapping[str, Callable[[], bytes]] = _NONE
) -> Handed:
    """Hand out the pictures of a located log that need no single reports.

    What is returned waits for the PNG of each, by its name, those that were ``handed`` out already
    among them.
    """
    new = [name for name in shown.names if name != _ERROR and name not in handed]
    mapless = replace(shown, base=None)
    drawn = {
        name: begun(drawers, partial(draw_picture, mapless if name == _EVIDENCE else shown, name))
        for name in new
    }
    return _in_order({**handed, **drawn})


def with_error_picture(
    handed: Handed, shown: TrackPictures, drawers: Executor, single_reports_m: Floats | None
) -> Handed:
    """Hand out the picture of the errors, too, where there is a truth.

    The median error of single reports is drawn beside, where it is given.
    """
    if _ERROR not in shown.names:
        return handed
    plain = replace(shown, base=None)
    errors = begun(drawers, partial(draw_picture, plain, _ERROR, single_reports_m))
    return _in_order({**handed, _ERROR: errors})


def _in_order(handed: Handed) -> Handed:
    return {name: handed[name] for name in PICTURES if name in handed}


def draw_picture(shown: TrackPictures, name: str, single_reports_m: Floats | None = None) -> bytes:
    """Return one picture of a located log as PNG."""
    from mapfilter.report.saving import png_of

    return png_of(_drawn(shown, name, single_reports_m))


def draw_snapshots(
    name: str, snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap
) -> bytes:
    """Return the picture of a belief as PNG."""
    from mapfilter.report.saving import png_of
    from mapfilter.report.snapshots import plot_belief, plot_candidates

    plot = plot_candidates if name == _CANDIDATES else plot_belief
    return png_of(plot(snapshots, truth, base))


def _drawn(shown: TrackPictures, name: str, single_reports_m: Floats | None) -> Drawn:
    from mapfilter.report.errors import plot_error_over_distance
    from mapfilter.report.evidence import plot_evidence
    from mapfilter.report.track import plot_track

    estimate, truth, base = shown.estimate, shown.truth, shown.base
    if name == _EVIDENCE:
        return plot_evidence(estimate, truth)
    if name == _ERROR:
        assert truth is not None
        return plot_error_over_distance(estimate, truth, single_reports_m=single_reports_m)
    return plot_track(estimate, truth, base, fixes_m=shown.fixes_m)


def _candidates(snapshot: Snapshot) -> float:
    return float(snapshot.weight.size)


def choose_snapshots(
    snapshots: Sequence[Snapshot], spread: Callable[[Snapshot], float]
) -> list[Snapshot]:
    """Choose at most six: the first, the last, and between them even steps of the thinning out.

    Steps are even in the logarithm of ``spread``, the number of places in a belief.
    """
    if len(snapshots) <= MAX_PANELS:
        return list(snapshots)
    counts = np.array([max(spread(s), 1.0) for s in snapshots])
    last = len(snapshots) - 1
    depth = np.log(counts[0] / counts) + 1e-9 * np.arange(len(snapshots))
    chosen = {0, last}
    for goal in np.linspace(0, depth[last], MAX_PANELS)[1:-1]:
        free = [i for i in range(1, last) if i not in chosen]
        chosen.add(free[int(np.argmin(np.abs(depth[free] - goal)))])
    return [snapshots[i] for i in sorted(chosen)]


def _places(snapshot: Snapshot) -> float:
    """Return the effective number of squares in a belief (the exponential of its entropy)."""
    if not snapshot.weight.size:
        return 0.0
    at_m = np.array([snapshot.hypothesis_east_m, snapshot.hypothesis_north_m])
    col, row = np.round(at_m / _SQUARE_M).astype(np.int64)
    # One number for each square: pairs take ten times as long to sort.
    _, square = np.unique(col * (np.ptp(row) + 1) + row, return_inverse=True)
    mass = np.bincount(square, snapshot.weight)
    mass = mass[mass > 0]
    return float(np.exp(-np.sum(mass * np.log(mass))))
