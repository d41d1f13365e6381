"""The sections of a configuration about predicted levels, and about surveys."""

from __future__ import annotations

from typing import Literal

from mapfilter.config.fields import (
    Columns,
    FilePath,
    Files,
    Section,
    with_columns,
    with_options,
)
from mapfilter.options import Positive
from mapfilter.propagation.models import GroundTruthErrors, ModelName, PredictionModel
from mapfilter.survey.measurement_rows import FIELDS as MEASUREMENT_COLUMNS
from mapfilter.survey.options import SESSION_GAP_S, SurveyOptions


@with_columns(*MEASUREMENT_COLUMNS)
class SurveyColumns(Columns):
    """``[prediction.survey.columns]``: names of the columns of a CSV file with others.

    Each key is a field of a measurement; its value is the name of its column. Cells are named by
    ``cell``, or by ``mcc``, ``mnc``, ``lac`` and ``ci``.
    """


@with_options(SurveyOptions, without=("most_points",))
class SurveySection(Section):
    """``[prediction.survey]``: measurements, and how they become rasters (model "survey").

    Parameters
    ----------
    files : list of Path
        Files of measurements, or folders of them.
    format : {"auto", "csv", "opencellid", "towercollector", "antennas"}
        Format of the files; "auto" detects it from each, and reads recordings of other programs
        with cells and positions, too.
    session_gap_s : float
        A longer silence begins a new session.
    max_accuracy_m : float
        Rows with less accurate positions are left out.
    calibrate : Path, optional
        Predicted rasters whose offset, slope and residuals are fitted in place of a path loss;
        ``[rasters]`` then gives what their files lack.
    fill : bool
        Keep the trend, or the prediction, where nothing was measured.
    cross_validate : bool
        Leave each session out in turn, and stretch the deviations to the errors found.
    """

    files: Files = ()
    format: Literal["auto", "csv", "opencellid", "towercollector", "antennas"] = "auto"
    session_gap_s: Positive = SESSION_GAP_S
    max_accuracy_m: Positive = 50.0
    calibrate: FilePath | None = None
    fill: bool = False
    cross_validate: bool = True
    columns: SurveyColumns = SurveyColumns()


@with_options(GroundTruthErrors)
class GroundTruthSection(Section):
    """``[prediction.ground_truth]``: how the simulated ground truth differs from the prediction.

    Parameters
    ----------
    write : bool
        Whether predict also writes rasters of the ground truth.
    """

    write: bool = True


@with_options(PredictionModel)
class Prediction(Section):
    """``[prediction]``: the propagation model, or a survey.

    Parameters
    ----------
    model : str
        Propagation model, or "survey" for rasters from measurements (``[prediction.survey]``).
    """

    model: ModelName | Literal["survey"] = "cost231_walfisch_ikegami"
    ground_truth: GroundTruthSection = GroundTruthSection()
    survey: SurveySection = SurveySection()
