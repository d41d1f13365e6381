"""``[sweep]``: the grid of a sweep. An axis that is left out takes the one value of its section."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from mapfilter.workflows.fields import FilterName, NotNegative, Positive, Section, Seed
from mapfilter.workflows.survey_section import Files


def _listed(value: Any) -> Any:
    """Take one number for a list of one."""
    return [value] if isinstance(value, int | float) else value


def _each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(values)) < len(values):
        raise ValueError("every value once")
    return values


_AXIS = (BeforeValidator(_listed), Field(strict=False, min_length=1), AfterValidator(_each_once))
_Below1 = Annotated[float, Field(ge=0, lt=1)]
_Degrees = Annotated[float, Field(ge=0, le=360)]

NotNegatives = Annotated[tuple[NotNegative, ...], *_AXIS]
Positives = Annotated[tuple[Positive, ...], *_AXIS]
Degrees = Annotated[tuple[_Degrees, ...], *_AXIS]
Shares = Annotated[tuple[_Below1, ...], *_AXIS]


class ReadingSection(Section):
    """``[[sweep.readings]]``: a filter by a name, and what it has otherwise than ``[filter]``."""

    name: Annotated[str, Field(min_length=1)]
    filter: FilterName | None = None
    margin_db: NotNegative | None = None
    update_length_m: NotNegative | None = None
    tracking_length_m: NotNegative | None = None
    prediction: Literal["last_heading", "displacement"] | None = None
    duplicates: Literal["set", "list"] | None = None
    threshold: Annotated[int, Field(ge=1)] | None = None
    at_threshold: Literal["switch", "stall"] | None = None
    switch_check: Literal["next_call", "same_call"] | None = None
    when_empty: Literal["fail", "reinitialise"] | None = None


def _names_once(readings: tuple[ReadingSection, ...]) -> tuple[ReadingSection, ...]:
    if len({(reading.name, reading.update_length_m) for reading in readings}) < len(readings):
        raise ValueError("readings of different names")
    return readings


class SweepSection(Section):
    """``[sweep]``: axes of the grid, how many runs, and the filters that are compared."""

    sigma_trans_m: NotNegatives | None = None
    sigma_orient_deg: Degrees | None = None
    bias_deg: Degrees | None = None
    drift_deg_per_sqrt_s: Degrees | None = None
    scale: Shares | None = None
    prediction_error_db: NotNegatives | None = None
    report_period_s: Positives | None = None
    imu_period_s: Positives | None = None
    update_length_m: NotNegatives | None = None
    databases: Files = ()
    readings: Annotated[
        tuple[ReadingSection, ...], Field(strict=False), AfterValidator(_names_once)
    ] = ()
    routes: Annotated[int, Field(ge=1, le=1_000_000)] = 40
    draws: Annotated[int, Field(ge=1, le=1_000_000)] = 10
    seed: Seed = 0
