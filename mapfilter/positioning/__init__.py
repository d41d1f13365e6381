"""Filters over an area: models of motion and measurement, from a log to a located track."""

_KALMAN = "mapfilter.positioning.kalman.filter:KalmanFilter"

BUILT_IN = {
    "bayes": "mapfilter.positioning.bayes.options:BayesFilter",
    "grid": "mapfilter.positioning.bayes.options:GridFilter",
    "candidate": "mapfilter.positioning.candidate:CandidateFilter",
    "ekf": _KALMAN,
    "iekf": _KALMAN,
    "rbukf": _KALMAN,
    "ukf": _KALMAN,
    "ckf": _KALMAN,
}
"""The filters by name, each with the class of its options; one class may have several methods."""

DEFAULT = "bayes"
