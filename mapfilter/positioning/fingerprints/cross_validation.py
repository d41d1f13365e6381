"""Errors of single reports where a part of the database is left out in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.censoring import OPEN, Bounds, bounded
from mapfilter.positioning.fingerprints.located import Validation
from mapfilter.positioning.fingerprints.matches import Position, Received, locator
from mapfilter.positioning.fingerprints.options import Method, method_name
from mapfilter.positioning.fingerprints.regions import Errors, coverage
from mapfilter.positioning.fingerprints.reports import Reports

MOST_FOLDS = 10
MOST_VALIDATED = 2000
"""Reports that are left out in cross-validation, evenly taken."""

_SPACINGS = 2.0
_LEAST_SQUARE_M = 1.0
_FORMER, _LATTER = 73_856_093, 19_349_663


def cross_validate(
    database: Reports,
    method: Method,
    fold: Ints,
    progress: Progress | None = None,
    most: int = MOST_VALIDATED,
    bounds: Bounds = OPEN,
) -> Errors:
    """Return the errors of a method where each fold is located by the database of the others.

    At most ``most`` reports are located, evenly taken; those of which no transmitter was received
    in the other folds have no error. Their levels end where ``bounds`` does.
    """
    count = min(len(database), most)
    tried = np.linspace(0, len(database) - 1, count).astype(np.int64)
    parts = []
    for left in left_out(database, method, fold, tried, progress, bounds):
        block = np.full(len(left.positions), left.fold)
        spread_m, mismatch = left.positions[:, 2], left.positions[:, 3]
        parts.append(Errors(np.hypot(*left.off_m.T), spread_m, mismatch, block))
    columns = ("error_m", "spread_m", "mismatch", "block")
    empty = Errors(np.empty(0), np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))
    every = [empty, *parts]
    return Errors(*(np.concatenate([getattr(part, name) for part in every]) for name in columns))


class LeftOut(NamedTuple):
    """Reports of a fold that were located by the others; L of them have a position.

    Parameters
    ----------
    fold : int
    reports : Reports
        Those L of them.
    positions : (L, 4) array
        East, north, spread and mismatch, see :class:`~.matches.Position`.
    """

    fold: int
    reports: Reports
    positions: Floats

    @property
    def off_m(self) -> Floats:
        """Errors east and north, shape (L, 2)."""
        return self.positions[:, :2] - self.reports.places


def left_out(
    database: Reports,
    method: Method,
    fold: Ints,
    tried: Ints,
    progress: Progress | None = None,
    bounds: Bounds = OPEN,
) -> Iterator[LeftOut]:
    """Yield some reports of each fold, located by the database of the other folds.

    Parameters
    ----------
    fold : (R,) array
        Of each report.
    tried : (T,) array
        Which reports are located.
    bounds : Bounds
        Where their levels end.
    """
    names = np.unique(fold)
    for done, one in enumerate(names.tolist()):
        others = fold != one
        own = tried[fold[tried] == one]
        if others.any() and len(own):
            rest, query = database.some(others).compact(), bounded(database.some(own), bounds)
            known, _ = query.named_as(rest.cell_ids)
            try:
                by = locator(method, rest)
            except InputError:
                continue
            positions, located = positions_of(by, known, np.arange(len(query)))
            yield LeftOut(one, query.some(located), positions)
        if progress is not None:
            progress(done + 1, len(names))


def drawn_errors(database: Reports, method: Method, drawn: Reports) -> Errors:
    """Return the errors of a method at drawn reports; every tenth is of one block."""
    known, _ = drawn.named_as(database.cell_ids)
    positions, located = positions_of(locator(method, database), known, np.arange(len(drawn)))
    off_m = positions[:, :2] - drawn.places[located]
    block = np.arange(len(positions)) % MOST_FOLDS
    return Errors(np.hypot(*off_m.T), positions[:, 2], positions[:, 3], block)


def folds_of(database: Reports) -> tuple[Ints, str]:
    """Return the fold of each report, and by what: by logs, or by squares where there is one log.

    Squares are twice as wide as the usual distance between neighbouring places.
    """
    from scipy.spatial import cKDTree

    blocks, which = np.unique(database.block, return_inverse=True)
    if len(blocks) > 1 and blocks[0] >= 0:
        return which % MOST_FOLDS, "logs"
    places = database.places
    known = np.unique(places, axis=0)
    side_m = _LEAST_SQUARE_M
    if len(known) > 1:
        apart_m = cKDTree(known).query(known, k=2)[0][:, 1]
        side_m = max(side_m, _SPACINGS * float(np.median(apart_m)))
    row, col = np.floor(places.T / side_m).astype(np.int64)
    # Neighbouring squares in different folds, without a pattern.
    scattered = ((row * _FORMER) ^ (col * _LATTER)) % (2**31 - 1) % MOST_FOLDS
    return scattered, f"squares of {side_m:.3g} m"


def positions_of(
    by: Callable[[Received], Position], reports: Reports, index: Sequence[int] | Ints
) -> tuple[Floats, Bools]:
    """Return the positions of some reports, shape (L, 4), and which of them have one."""
    found: list[Position] = []
    located = np.zeros(len(index), dtype=np.bool_)
    for at, one in enumerate(index):
        cell, level_dbm = reports.readings(int(one))
        if len(cell):
            serving, advance = int(reports.serving[one]), float(reports.timing_advance[one])
            censored = reports.censored[reports.first[one] : reports.first[one + 1]]
            ends = censored if censored.any() else None
            found.append(by(Received(cell, level_dbm, serving, advance, ends)))
            located[at] = True
    return np.array(found, dtype=np.float64).reshape(-1, 4), located


def validation_of(method: Method, errors: Errors, blocks: str) -> Validation:
    """Return the figures of errors, and what was left out."""
    return Validation(
        method_name(method),
        blocks,
        len(np.unique(errors.block)),
        len(errors),
        float(errors.error_m.mean()),
        float(np.median(errors.error_m)),
        float(np.quantile(errors.error_m, 0.95)),
        *coverage(errors),
    )
