"""Levels of survey maps at the places of reports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions

_SQUARE_M = 5.0
_MOST_POINTS = 400
_LEAST_POINTS = 3


def as_measurements(reports: Reports) -> Measurements:
    """Return the readings of reports as measurements for a survey; missing levels are left out."""
    known = np.isfinite(reports.level_dbm)
    report = reports.report[known]
    blocks, session = np.unique(reports.block[report], return_inverse=True)
    return Measurements(
        reports.crs,
        reports.cell_ids,
        {},
        tuple(f"block {block}" for block in blocks),
        reports.cell[known],
        session.astype(np.int32),
        reports.time_s[report],
        reports.east_m[report],
        reports.north_m[report],
        reports.level_dbm[known],
        np.full(len(report), np.nan),
    )


def surveyed_levels(reports: Reports) -> Reports:
    """Return reports whose levels are those of a survey's maps, with their deviations.

    Each transmitter's levels are a mean and a Gaussian process about it
    (:mod:`mapfilter.survey.measured_map`). Transmitters received in too few squares, and readings
    without a level, stay as they are.
    """
    options = SurveyOptions(
        trend="mean", square_m=_SQUARE_M, most_points=_MOST_POINTS, min_points=_LEAST_POINTS
    )
    try:
        survey = fit_survey(as_measurements(reports), options)
    except InputError:
        return reports
    level_dbm, sd_db = reports.level_dbm.copy(), reports.sd_db.copy()
    report = reports.report
    order = np.argsort(reports.cell, kind="stable")
    edges = np.searchsorted(reports.cell[order], np.arange(len(reports.cell_ids) + 1))
    for index, cell_id in enumerate(reports.cell_ids):
        if cell_id not in survey.cells:
            continue
        own = order[edges[index] : edges[index + 1]]
        own = own[np.isfinite(level_dbm[own])]
        at = report[own]
        mean_dbm, deviation_db = survey.cells[cell_id].predict(
            reports.east_m[at], reports.north_m[at]
        )
        level_dbm[own], sd_db[own] = mean_dbm, deviation_db
    return replace(reports, level_dbm=level_dbm, sd_db=sd_db)
