"""Options of the methods that find a position from a single report.

The defaults were chosen by cross-validation within the training sets of four Wi-Fi benchmarks and
on one part of the Ottawa recordings; see the page "Accuracy of single reports".
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated

from annotated_types import Ge, Gt, Le

from mapfilter.errors import ConfigError, fail
from mapfilter.options import NotNegative, Options, Positive, Share
from mapfilter.positioning.fingerprints.matching import Metric, Representation


@dataclass(frozen=True, slots=True)
class Centroid(Options):
    """The mean place of the serving cell, or of the cell with the highest level."""


@dataclass(frozen=True, slots=True)
class Neighbours(Options):
    """The weighted mean place of the reports that are most alike (k-NN).

    Parameters
    ----------
    k : int
        Number of reports.
    metric : {"sorensen", "euclidean", "manhattan"}
        Distance between two reports.
    representation : {"positive", "exponential", "powed"}
        Of levels; a transmitter that was not received is 0 (positive, powed).
    exponent : float
        Of the powed representation; e in the literature.
    weight_power : float
        Weights fall with this power of the distance; 0 for equal weights.
    """

    k: Annotated[int, Ge(1), Le(10_000)] = 15
    metric: Metric = "sorensen"
    representation: Representation = "powed"
    exponent: Annotated[float, Gt(0), Le(10)] = 1.5
    weight_power: Annotated[float, Ge(0), Le(50)] = 4.0


@dataclass(frozen=True, slots=True)
class Probabilistic(Options):
    """The posterior over the places of the database, each as probable as it has reports.

    Parameters
    ----------
    level_db : float
        Deviation of a level between two reports of one place.
    shared_db : float
        Deviation of the error that all levels of a report share.
    absence_per_db : float
        Loss of log-likelihood for each dB above the weakest level of a transmitter that only one of
        two reports has.
    effective_readings : float
        Errors of levels at one place are correlated: a report with more readings counts as if it
        had so many.
    timing_sd_steps : float
        Deviation of a timing advance between two reports of one place and serving cell.
    outliers : float
        Probability that levels and timing advance of a report are none of these.
    """

    level_db: Positive = 5.0
    shared_db: NotNegative = 3.0
    absence_per_db: Positive = 0.2
    effective_readings: Positive = 8.0
    timing_sd_steps: Positive = 0.5
    outliers: Share = 0.001


@dataclass(frozen=True, slots=True)
class SurveyMaps(Options):
    """The posterior with levels of survey maps: one Gaussian process for each transmitter.

    Parameters
    ----------
    level_db : float
        Deviation of a level besides that of the map.
    shared_db, absence_per_db, effective_readings, timing_sd_steps, outliers
        As for "probabilistic".
    """

    level_db: Positive = 4.0
    shared_db: NotNegative = 3.0
    absence_per_db: Positive = 0.2
    effective_readings: Positive = 8.0
    timing_sd_steps: Positive = 0.5
    outliers: Share = 0.001


Method = Centroid | Neighbours | Probabilistic | SurveyMaps
METHODS: dict[str, type[Method]] = {
    "centroid": Centroid,
    "knn": Neighbours,
    "probabilistic": Probabilistic,
    "gp": SurveyMaps,
}
"""Methods by name."""
LEVEL_ERROR_DB = 6.0
"""Standard deviation of predicted levels for single reports, where none is given."""
AUTO = "auto"
"""The name that stands for the best of :data:`CANDIDATES` in cross-validation."""
CANDIDATES: tuple[Method, ...] = (
    Neighbours(),
    Neighbours(representation="positive"),
    Probabilistic(),
)
"""What "auto" tries."""


def method_options(name: str) -> Method:
    """Return the default options of a method; ConfigError if there is none of the name."""
    if name not in METHODS:
        raise fail(ConfigError, "method", ", ".join((AUTO, *METHODS)), repr(name))
    return METHODS[name]()


def method_name(method: Method) -> str:
    """Return the name of a method with the options that are not its defaults.

    Examples
    --------
    >>> method_name(Neighbours()), method_name(Neighbours(k=3, metric="euclidean"))
    ('knn', 'knn (k 3, metric euclidean)')
    """
    name = next(name for name, kind in METHODS.items() if type(method) is kind)
    usual, given = asdict(METHODS[name]()), asdict(method)
    other = [f"{key} {value}" for key, value in given.items() if value != usual[key]]
    return f"{name} ({', '.join(other)})" if other else name
