"""The section ``[prediction.survey]``: how measurements become rasters."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from mapfilter.workflows.fields import FilePath, Positive, Section


def _listed(value: Any) -> Any:
    """Let one file stand for a list of one."""
    return [value] if isinstance(value, str) else value


Files = Annotated[tuple[FilePath, ...], BeforeValidator(_listed), Field(strict=False)]
Number = Annotated[int, Field(ge=1, le=1_000_000)]


class SurveyColumns(Section):
    """``[prediction.survey.columns]``: names of the columns of a CSV file of another kind."""

    cell: str | None = None
    mcc: str | None = None
    mnc: str | None = None
    lac: str | None = None
    ci: str | None = None
    lat: str | None = None
    lon: str | None = None
    level_dbm: str | None = None
    time: str | None = None
    accuracy_m: str | None = None
    session: str | None = None


class SurveySection(Section):
    """``[prediction.survey]``: measurements, and how they become rasters.

    ``files`` are files or folders. ``calibrate`` names predicted rasters whose offset, slope and
    residuals are then fitted in place of a path loss; ``fill`` keeps the trend where nobody
    measured.
    """

    files: Files = ()
    format: Literal["auto", "csv", "opencellid", "towercollector", "antennas"] = "auto"
    session_gap_s: Positive = 1800.0
    max_accuracy_m: Positive = 50.0
    method: Literal["gp", "knn", "trend"] = "gp"
    trend: Literal["path_loss", "mean"] = "path_loss"
    calibrate: FilePath | None = None
    fill: bool = False
    reach_m: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 100.0
    min_points: Number = 3
    min_points_to_locate: Annotated[int, Field(ge=3, le=1_000_000)] = 15
    neighbours: Number = 8
    square_m: Annotated[float, Field(ge=0.1, allow_inf_nan=False)] = 10.0
    cross_validate: bool = True
    columns: SurveyColumns = SurveyColumns()
