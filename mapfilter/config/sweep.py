"""The section ``[sweep]``: axes of the grid, and the filters that are compared."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field

from mapfilter.config.fields import Count, Files, FilterName, Section, with_options
from mapfilter.options import Below1, Degrees, NotNegative, Positive, Seed
from mapfilter.positioning.candidate import CandidateFilter


def _axis_values(value: Any) -> Any:
    """Take one number for a list of one."""
    return [value] if isinstance(value, int | float) else value


def _each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(values)) < len(values):
        raise ValueError("every value once")
    return values


_T = TypeVar("_T")
Axis = Annotated[
    tuple[_T, ...],
    BeforeValidator(_axis_values),
    Field(strict=False, min_length=1),
    AfterValidator(_each_once),
]


@with_options(CandidateFilter, optional=True)
class ReadingSection(Section):
    """``[[sweep.readings]]``: a named filter, with the keys of the candidate filter that differ."""

    name: Annotated[str, Field(min_length=1)]
    filter: FilterName | None = None
    update_length_m: NotNegative | None = None


def _names_once(readings: tuple[ReadingSection, ...]) -> tuple[ReadingSection, ...]:
    if len({(reading.name, reading.update_length_m) for reading in readings}) < len(readings):
        raise ValueError("readings of different names")
    return readings


class SweepSection(Section):
    """``[sweep]``: axes of the grid, how many runs, and the filters that are compared.

    An axis without values takes the value of its section.

    Parameters
    ----------
    sigma_trans_m, sigma_orient_deg, bias_sd_deg, drift_deg_per_sqrt_s, scale : list of float
        Values of the key of ``[imu]`` with this name.
    prediction_error_db : list of float, optional
        Standard deviations of the ground truth from the prediction, in place of
        ``journeys.radio``.
    report_period_s : list of float, optional
        Values of ``journeys.report_period_s``.
    imu_period_s : list of float, optional
        Values of ``imu.period_s``.
    update_length_m : list of float, optional
        Values of ``filter.update_length_m``.
    databases : list of Path
        Databases that are compared; by default that of ``[database]``.
    readings : list of section
        Filters that are compared, each as ``[[sweep.readings]]`` with a ``name`` and the keys of
        ``[filter]`` that differ (the filter's name is called ``filter`` there). Options in sections
        of their own, such as ``[filter.bayes]``, are the same for all.
    routes : int
        Routes that each point of the grid is run on.
    draws : int
        Runs on each route, which differ in noise.
    seed : int
        Seed of routes and noise.
    """

    sigma_trans_m: Axis[NotNegative] | None = None
    sigma_orient_deg: Axis[Degrees] | None = None
    bias_sd_deg: Axis[Degrees] | None = None
    drift_deg_per_sqrt_s: Axis[NotNegative] | None = None
    scale: Axis[Below1] | None = None
    prediction_error_db: Axis[NotNegative] | None = None
    report_period_s: Axis[Positive] | None = None
    imu_period_s: Axis[Positive] | None = None
    update_length_m: Axis[NotNegative] | None = None
    databases: Files = ()
    readings: Annotated[
        tuple[ReadingSection, ...], Field(strict=False), AfterValidator(_names_once)
    ] = ()
    routes: Count = 40
    draws: Count = 10
    seed: Seed = 0
