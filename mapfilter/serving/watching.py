"""What the live page shows of a session beside its fixes; made only while somebody watches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.step_output import StepOutput
from mapfilter.radio.cells import CellPlan
from mapfilter.serving.events import json_bytes
from mapfilter.viewing.arrays import packed
from mapfilter.viewing.explain import Contribution
from mapfilter.viewing.readings import LevelAt, level_on, report_rows, unused_of
from mapfilter.viewing.trace import density, explanation_of, moment_of


@dataclass(frozen=True, eq=False)
class Watcher:
    """Describes steps of the filter for a page.

    Parameters
    ----------
    positioner : BayesPositioner
        The filter.
    plan : CellPlan
        Cells of the database, in the order in which the page numbers them.
    index : mapping of str to int
        Their numbers.
    level_at : callable
        Predicted levels.
    """

    positioner: BayesPositioner
    plan: CellPlan
    index: Mapping[str, int]
    level_at: LevelAt

    @classmethod
    def over(cls, positioner: BayesPositioner, plan: CellPlan) -> Watcher:
        """Return the watcher of a filter."""
        index = {cell: number for number, cell in enumerate(plan.ids)}
        return cls(positioner, plan, index, level_on(positioner.area))

    def detail(
        self,
        before: BayesState,
        epoch: Epoch,
        rng: np.random.Generator | None,
        after: BayesState,
        output: StepOutput,
    ) -> dict[str, Any]:
        """Return readings, doubt, alternative and contributions of one step.

        Parameters
        ----------
        rng : numpy.random.Generator or None
            As it was before the step; None leaves contributions out.
        """
        fix, moment = output.fix, moment_of(self.positioner, np.nan, after)
        rows = report_rows(epoch, fix.reason, unused_of(output.unused), self.plan, self.index)
        east_m, north_m = (np.full(len(rows), at_m) for at_m in (fix.east_m, fix.north_m))
        levels = self.level_at(east_m, north_m, [one.known for one in rows]).tolist()
        found: dict[str, Any] = {
            "doubt": _known(moment.doubt),
            "alternative": None,
            "readings": [
                {
                    "cell": row.cell,
                    "name": row.name,
                    "role": row.role,
                    "level_dbm": _known(row.level_dbm),
                    "predicted_dbm": _known(level_dbm),
                    "use": row.use.value,
                    "censored": row.censored,
                }
                for row, level_dbm in zip(rows, levels, strict=True)
            ],
            "explained": None,
        }
        if isfinite(moment.east_m):
            found["alternative"] = {
                "east_m": moment.east_m,
                "north_m": moment.north_m,
                "lead": _known(moment.lead),
                "mass_50m": _known(moment.mass),
            }
        measured = bool(epoch.radio) or epoch.gnss is not None or bool(epoch.pseudoranges)
        if rng is not None and measured:
            why = explanation_of(self.positioner, before, epoch, rng, output)
            if why is not None:
                rows_of = [self._contribution(one) for one in why.rows]
                found["explained"] = {"prior": _known(why.prior), "rows": rows_of}
        return found

    def belief(self, state: BayesState, number: int) -> bytes:
        """Return the belief of a state as JSON; nothing where there is none.

        Parameters
        ----------
        number : int
            Of the last epoch.
        """
        found = self.positioner.hypotheses(state)
        if found is None or not found.weight.size:
            return b""
        frame = density(number, found)
        return json_bytes(
            {
                "number": number,
                "step_m": frame.step_m,
                "peak": frame.peak,
                "col": packed(frame.col, "i4"),
                "row": packed(frame.row, "i4"),
                "mass": packed(frame.shade, "u1"),
            }
        )

    def _contribution(self, one: Contribution) -> dict[str, Any]:
        ids = self.positioner.area.cell_ids
        numbers = {
            "measured_dbm": one.measured_dbm,
            "lead_dbm": one.lead_dbm,
            "runner_dbm": one.runner_dbm,
            "lead": one.lead,
            "runner": one.runner,
            "alternative": one.alternative,
        }
        cell = self.index.get(ids[one.cell], -1) if one.cell >= 0 else -1
        known = {name: _known(value) for name, value in numbers.items()}
        return {"term": one.what, "cell": cell, **known}


def _known(value: float) -> float | None:
    return float(value) if isfinite(value) else None
