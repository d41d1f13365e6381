"""The outputs of a filter's steps as columns, filled while a track is located."""

from __future__ import annotations

from array import array

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate, TrackEvidence
from mapfilter.positioning.step_output import StepOutput, UnusedReading

_NUMBERS = 14
"""Numbers of a fix in the order of :meth:`EstimateColumns.add`."""


class EstimateColumns:
    """Outputs of steps, one epoch after another.

    An output as an object is ten times as large as its numbers: a day of them is 100 MB.
    """

    def __init__(self) -> None:
        self._numbers, self._evidence, self._whole = array("d"), array("d"), array("q")
        self._status: list[Status] = []
        self._reason: list[Reason] = []
        self._unused: list[UnusedReading] = []

    def add(self, output: StepOutput) -> None:
        """Add the output of one epoch; tails are not kept.

        Raises
        ------
        InputError
            Covariance or radii have another shape.
        """
        fix = output.fix
        covariance_m2 = np.asarray(fix.covariance_m2, dtype=np.float64)
        radii_m = np.asarray(fix.radii_m, dtype=np.float64)
        if covariance_m2.shape != (2, 2) or radii_m.shape != (3,):
            expected = "covariance_m2 of shape (2, 2) and radii_m of shape (3,)"
            found = f"{covariance_m2.shape} and {radii_m.shape}"
            raise fail(InputError, "step, fix", expected, found)
        self._numbers.extend(
            (
                fix.time_s,
                fix.east_m,
                fix.north_m,
                fix.mass_50m,
                fix.way_probability,
                fix.radius_99_m,
                fix.protection_m,
            )
        )
        self._numbers.extend(covariance_m2.ravel().tolist())
        self._numbers.extend(radii_m.tolist())
        self._whole.extend((fix.hypotheses, fix.way_id))
        self._status.append(fix.status)
        self._reason.append(fix.reason)
        if output.evidence is not None:
            self._evidence.extend(output.evidence)
        if output.unused:
            self._unused.extend(output.unused)

    def estimate(
        self,
        crs: str,
        filter_name: str,
        start_utc_s: float = float("nan"),
        unused: tuple[UnusedReading, ...] = (),
    ) -> TrackEstimate:
        """Return the estimate of the epochs so far.

        Parameters
        ----------
        crs, filter_name : str
            Of the filter.
        start_utc_s : float
            UTC seconds of time 0; NaN when unknown.
        unused : tuple of UnusedReading
            Besides those of the outputs.
        """
        numbers = np.asarray(self._numbers, dtype=np.float64).reshape(-1, _NUMBERS)
        whole = np.asarray(self._whole, dtype=np.int64).reshape(-1, 2)
        time_s, east_m, north_m, mass, way_probability, wide_m, protection_m = _columns(
            numbers[:, :7]
        )
        evidence = None
        if self._evidence and len(self._evidence) == 5 * time_s.size:
            evidence = TrackEvidence(
                *_columns(np.asarray(self._evidence, dtype=np.float64).reshape(-1, 5))
            )
        labelled = sorted([*unused, *self._unused], key=lambda reading: reading.time_s)
        return TrackEstimate(
            crs,
            filter_name,
            start_utc_s,
            time_s,
            east_m,
            north_m,
            numbers[:, 7:11].copy().reshape(-1, 2, 2),
            numbers[:, 11:].copy(),
            tuple(self._status),
            whole[:, 0].copy(),
            mass,
            whole[:, 1].copy(),
            way_probability,
            tuple(self._reason),
            wide_m,
            protection_m,
            tuple(labelled),
            evidence,
        )


def _columns(table: Floats) -> list[Floats]:
    return [column.copy() for column in table.T]
