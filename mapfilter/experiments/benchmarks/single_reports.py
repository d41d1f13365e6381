"""Single reports of published data: Wi-Fi fingerprints, and a phone's serving cells in Ottawa.

Methods and radii are chosen and calibrated within the training reports alone. In Ottawa each
session is located by the other sessions of its part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import mean_of
from mapfilter.evaluation.intervals import share_interval
from mapfilter.experiments.accuracy_row import median_of, quantile_of
from mapfilter.experiments.benchmarks.ottawa import GOOD_M, MAP_M
from mapfilter.experiments.benchmarks.ottawa_sessions import Session
from mapfilter.positioning.fingerprints.joining import joined_reports
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.locating import fit_locator, locate_by
from mapfilter.positioning.fingerprints.options import (
    AUTO,
    Centroid,
    Method,
    Neighbours,
    Probabilistic,
    SurveyMaps,
    method_name,
)
from mapfilter.positioning.fingerprints.report_checks import NOT_RECEIVED_DBM
from mapfilter.positioning.fingerprints.reports import Reports, make_reports

WIFI = ("UJI1", "TUT1", "TUT3", "LIB1")
WIFI_FOLDER = "fingerprint-wifi"
BASELINE = "3-nn"
"""k-NN with k = 3, equal weights and Euclidean distances, as in the literature."""

METHODS: Mapping[str, Method | str] = {
    AUTO: AUTO,
    "knn": Neighbours(),
    "probabilistic": Probabilistic(),
    "gp": SurveyMaps(),
    "centroid": Centroid(),
    BASELINE: Neighbours(k=3, metric="euclidean", representation="positive", weight_power=0.0),
}
"""What is compared, by the names of the table."""

_FRAME = "EPSG:32635"
"""Local metres of the Wi-Fi sets need some projected CRS."""
_SPLIT = (("trainingMacs", "trainingLabels"), ("testMacs", "testLabels"))


@dataclass(frozen=True)
class SingleReportsRow:
    """Errors of one method on one data set.

    Parameters
    ----------
    chosen : str
        What "auto" chose; for several databases what it chose most often.
    reports, located : int
        Reports, and those of which a transmitter is in the database.
    within_50, within_67, within_95 : float
        Shares of the located reports within the radii.
    within_95_low, within_95_high : float
        Ends of the 95 % interval of the last share over sessions
        (:func:`mapfilter.evaluation.intervals.share_interval`); NaN for a single database.
    cross_validated_95 : float
        The last of these in cross-validation within the training reports; NaN for several
        databases.
    """

    data: str
    method: str
    chosen: str
    reports: int
    located: int
    mean_m: float
    median_m: float
    error_95_m: float
    within_50: float
    within_67: float
    within_95: float
    within_95_low: float
    within_95_high: float
    cross_validated_95: float


def read_wifi(folder: Path, name: str) -> tuple[Reports, Reports]:
    """Read the training and test reports of a Wi-Fi set.

    Raises
    ------
    InputError
        The file is missing, damaged or of another kind.
    """
    path = folder / f"{name}.mat"
    try:
        data: Any = loadmat(path, squeeze_me=True, struct_as_record=False)["database"]
        parts = [
            (np.asarray(getattr(data, levels), float), np.asarray(getattr(data, places), float))
            for levels, places in _SPLIT
        ]
    except (OSError, KeyError, AttributeError, ValueError, TypeError, MatReadError) as error:
        expected = "a MATLAB file with a struct database of fingerprints"
        raise fail(InputError, str(path), expected, error, "not there, or cut off") from error
    training, test = (_wifi_reports(*part) for part in parts)
    return training, test


def _wifi_reports(levels: Floats, places: Floats) -> Reports:
    report, cell = np.nonzero(np.isfinite(levels) & (levels < NOT_RECEIVED_DBM))
    names = np.array([f"ap-{i:04d}" for i in range(levels.shape[1])], dtype=str)
    return make_reports(
        _FRAME,
        report,
        names[cell],
        levels[report, cell],
        count=len(levels),
        places=places[:, :2],
    )


def session_reports(session: Session, crs: str, accuracy_m: float) -> Reports:
    """Return the reports of a session whose position is at least so accurate, as one block."""
    good = session.accuracy_m <= accuracy_m
    cell = np.array(session.cell, dtype=str)[good]
    count = int(good.sum())
    return make_reports(
        crs,
        np.arange(count),
        cell,
        session.level_dbm[good],
        count=count,
        places=session.places(crs)[good],
        time_s=session.time_s[good],
        block=np.zeros(count),
        serving=cell,
        timing_advance=session.timing_advance[good],
    )


def locate_wifi(training: Reports, test: Reports, method: str) -> tuple[LocatedReports, ...]:
    """Locate the test reports of a Wi-Fi set."""
    return (locate_by(fit_locator(training, METHODS[method]), test),)


def locate_sessions(sessions: Sequence[Session], crs: str, method: str) -> Iterator[LocatedReports]:
    """Locate each session by the others."""
    for session in sessions:
        others = [session_reports(other, crs, MAP_M) for other in sessions if other is not session]
        fitted = fit_locator(joined_reports(others), METHODS[method])
        yield locate_by(fitted, session_reports(session, crs, GOOD_M))


def row_of(data: str, method: str, parts: Sequence[LocatedReports]) -> SingleReportsRow:
    """Summarise what one method found on one data set."""
    error_m = np.concatenate([part.error_m for part in parts])
    radii_m = np.concatenate([part.radii_m for part in parts])
    known = np.isfinite(error_m)
    known_m = error_m[known]
    within = [mean_of(known_m <= radius_m) for radius_m in radii_m[known].T]
    held = [int(np.sum(part.error_m <= part.radii_m[:, 2])) for part in parts]
    low, high = share_interval(held, [int(np.isfinite(part.error_m).sum()) for part in parts])
    chosen = [method_name(part.method) for part in parts]
    validated = parts[0].validations[0].within_95 if len(parts) == 1 else float("nan")
    return SingleReportsRow(
        data,
        method,
        max(chosen, key=chosen.count) if method == AUTO else "",
        len(error_m),
        int(known.sum()),
        mean_of(known_m),
        median_of(known_m),
        quantile_of(known_m, 0.95),
        within[0],
        within[1],
        within[2],
        low,
        high,
        validated,
    )
