"""Measured levels with positions: drive tests and walks of any logging program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mapfilter._types import Bools, Floats, Ints32
from mapfilter._words import number_of
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import SERVING
from mapfilter.radio.plan_names import PlanNames, ReportedCell
from mapfilter.survey.measurement_rows import Code, Identity


@dataclass(frozen=True, eq=False)
class Measurements:
    """Levels received at places, with the session that each belongs to.

    A session is one drive or walk: what is left out together when a map is validated.

    Parameters
    ----------
    crs : str
        Projected CRS of the positions.
    cell_ids : tuple of str
        Cells received, sorted.
    identities : mapping of str to (mcc, mnc, lac, ci)
        Of the cells whose identity is in the files; lac is the tac in LTE.
    cell, session : numpy.ndarray of int32, shape (N,)
        Indices into ``cell_ids`` and ``sessions``.
    time_s : numpy.ndarray, shape (N,)
        Unix seconds, UTC; NaN where unknown.
    accuracy_m : numpy.ndarray, shape (N,)
        Of the position, as the receiver reported it; NaN where unknown.
    notes : tuple of str
        Which rows were left out, and why.
    serving : numpy.ndarray of bool, shape (N,)
        Whether the cell was the serving one. Where a file does not tell, the only cell of its time
        was. None where this is not known of any row.
    timing_advance : numpy.ndarray, shape (N,)
        Steps, NaN where it was not reported; None as for ``serving``.
    technologies : mapping of str to str
        GSM, UMTS, LTE or NR of the cells of which it is known. Their levels are other quantities.
    codes : mapping of str to (arfcn, bsic)
        Carrier and code of the cells of which both are in the files.
    """

    crs: str
    cell_ids: tuple[str, ...]
    identities: Mapping[str, Identity]
    sessions: tuple[str, ...]
    cell: Ints32
    session: Ints32
    time_s: Floats
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    accuracy_m: Floats
    notes: tuple[str, ...] = ()
    serving: Bools | None = None
    timing_advance: Floats | None = None
    technologies: Mapping[str, str] = field(default_factory=dict)
    codes: Mapping[str, Code] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.level_dbm)

    @property
    def report(self) -> Ints32:
        """Number of the report of each row, shape (N,): rows of one session and time are one."""
        # A row without a time is a report of its own.
        number = np.where(np.isfinite(self.time_s), -1, np.arange(len(self)))
        keys = np.column_stack([self.session, np.nan_to_num(self.time_s), number])
        return np.unique(keys, axis=0, return_inverse=True)[1].astype(np.int32)

    def where(self, kept: Bools, *notes: str) -> Measurements:
        """Return some of the rows; cells and sessions keep their places."""
        columns = ("cell", "session", "time_s", "east_m", "north_m", "level_dbm", "accuracy_m")
        more = ("serving", "timing_advance") if self.serving is not None else ()
        some = {name: getattr(self, name)[kept] for name in (*columns, *more)}
        return replace(self, **some, notes=(*self.notes, *notes))

    def accurate(self, accuracy_m: float) -> Measurements:
        """Return the rows whose position is at least so accurate, or of unknown accuracy."""
        kept = ~(self.accuracy_m > accuracy_m)
        if kept.all():
            return self
        count = int((~kept).sum())
        return self.where(
            kept,
            f"{number_of(count, 'row')} left out: positions less accurate than {accuracy_m:g} m",
        )


def named_after(measurements: Measurements, plan: CellPlan) -> Measurements:
    """Return the measurements with the plan's ids for the cells whose identity the plan has.

    Identities are compared as those of logs are (:class:`mapfilter.radio.plan_names.PlanNames`).
    """
    table = PlanNames(plan)

    def named(cell_id: str) -> str:
        if cell_id not in measurements.identities:
            return cell_id
        kind, identity = measurements.technologies.get(cell_id), measurements.identities[cell_id]
        return table.name(ReportedCell(SERVING, cell_id, kind, *identity, None, None)) or cell_id

    new = [named(cell_id) for cell_id in measurements.cell_ids]
    names, places = np.unique(np.array(new), return_inverse=True)
    known = list(zip(measurements.cell_ids, new, strict=True))
    identities = {
        name: measurements.identities[old] for old, name in known if old in measurements.identities
    }
    kinds, codes = measurements.technologies, measurements.codes
    return replace(
        measurements,
        cell_ids=tuple(names.tolist()),
        identities=identities,
        technologies={name: kinds[old] for old, name in known if old in kinds},
        codes={name: codes[old] for old, name in known if old in codes},
        cell=places[measurements.cell].astype(np.int32),
    )
