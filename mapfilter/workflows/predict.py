"""``mapfilter predict``: RxLev rasters of a cell plan, and a simulated ground truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._io import ensure_writable_folder, program_version, sha256_file
from mapfilter._parallel import Progress, part_of
from mapfilter._partial import nothing_left
from mapfilter.config.sections import Config
from mapfilter.errors import Faults, InputError, OutputError, fail
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict, simulate_ground_truth
from mapfilter.propagation.remarks import (
    high_antennas,
    off_frequency,
    outside_validity,
    upward_tilts,
)
from mapfilter.radio.far_cells import check_cells_near
from mapfilter.radio.plan_files import write_cell_plan
from mapfilter.radio.plan_notes import carrier_notes
from mapfilter.rasters.geotiff_writer import is_as_written, write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.workflows.inputs.apart import check_no_input_replaced
from mapfilter.workflows.inputs.world import World, map_cover

if TYPE_CHECKING:
    from mapfilter.workflows.survey import SurveyResult

_PREDICTION_TAG = "PREDICTION_SHA256"


def ground_truth_tags(prediction: Path) -> dict[str, str]:
    """Return the tags of ground truth rasters: they name the prediction that they belong to."""
    return {"ROLE": "ground truth", _PREDICTION_TAG: sha256_file(prediction)}


def open_ground_truth(config: Config) -> RxLevRasters:
    """Open the simulated ground truth that belongs to the prediction in the output folder.

    Rasters that are named in ``rasters.ground_truth``, or that carry no tag of a prediction, are
    taken as they are.

    Raises
    ------
    InputError
        There are none, or they belong to another prediction, such as one with another plan.
    """
    prediction, path = config.rasters_path, config.ground_truth_path
    named = config.rasters.ground_truth is not None
    if not named and not path.exists():
        hint = (
            "not predicted yet; predict with prediction.ground_truth.write = true, "
            'or set journeys.radio = "as_predicted"'
        )
        raise fail(InputError, str(path), "rasters of the ground truth", "no such file", hint)
    rasters = open_rasters(path)
    if named or not prediction.is_file():
        return rasters
    with open_raster(path) as source:
        belongs_to = source.tags().get(_PREDICTION_TAG)
    if belongs_to not in (None, sha256_file(prediction)):
        raise fail(
            InputError,
            str(path),
            f"ground truth of {prediction.name}, the prediction beside it",
            "that of another prediction",
            "predicted again without it; predict with prediction.ground_truth.write = true, "
            "or name the file in rasters.ground_truth",
        )
    return rasters


def check_only_own_replaced(*paths: Path) -> None:
    """Check that no rasters are replaced that another program made, or changed.

    Raises
    ------
    OutputError
        With every path at which there is something else than rasters as mapfilter predicted them.
    """
    faults = Faults()
    for path in paths:
        if not path.exists():
            continue
        try:
            with open_raster(path) as source:
                software = str(source.tags().get("SOFTWARE", ""))
        except (RasterioError, InputError):
            software = ""
        if not (software.startswith("mapfilter") and is_as_written(path)):
            expected = "nothing yet, or rasters that mapfilter predicted"
            got = "a folder" if path.is_dir() else f"a file of {software or 'another program'}"
            got += ", changed since" if software.startswith("mapfilter") else ""
            hint = "[rasters] names your own export; give the prediction another path, or none"
            faults.add(str(path), expected, got, hint)
    faults.raise_if_any(OutputError)


@dataclass(frozen=True)
class PredictResult:
    """Size and files of a prediction."""

    cells: int
    rows: int
    cols: int
    rasters: Path
    """The predicted levels."""
    ground_truth: Path | None
    """The levels of the simulated ground truth, where asked for."""
    plan: Path
    """The cell plan used, as CSV."""
    notes: tuple[str, ...]
    """How much of the area the map covers if not nearly all, where building heights come from,
    what lies outside the model's published range, and which antennas were measured at another
    frequency."""


def run_predict(config: Config, progress: Progress | None = None) -> PredictResult | SurveyResult:
    """Predict every cell of the plan over the area, or make the map of a survey's measurements."""
    target, ground_truth = config.rasters_path, config.ground_truth_path
    surveyed, both = config.prediction.model == "survey", config.prediction.ground_truth.write
    check_only_own_replaced(
        target, *([config.deviation_path] if surveyed else [ground_truth] if both else [])
    )
    outputs = target, ground_truth, config.deviation_path, config.output.dir / "cells.csv"
    check_no_input_replaced(config, *outputs)
    with nothing_left(target.parent, ground_truth.parent, config.output.dir):
        if surveyed:
            from mapfilter.workflows.survey import run_survey

            return run_survey(config, progress)
        return _predict_network(config, progress)


def _predict_network(config: Config, progress: Progress | None) -> PredictResult:
    """Predict every cell of the plan over the area, and on request the ground truth."""
    target, ground_truth = config.rasters_path, config.ground_truth_path
    both, world = config.prediction.ground_truth.write, World.of(config)
    for folder in (target.parent, ground_truth.parent, config.output.dir):
        ensure_writable_folder(folder)
    plan, lattice, model = world.plan, world.lattice, config.prediction.of(PredictionModel)
    check_cells_near(plan, lattice, str(config.cells.plan or "cells"))
    antennas = world.antennas
    notes = (
        *map_cover(world),
        world.buildings.height_sources,
        *plan.notes,
        *carrier_notes(plan),
        *(note for antenna in antennas.values() for note in antenna.notes),
        *outside_validity(plan, lattice, model),
        *off_frequency(plan, antennas),
        *upward_tilts(plan),
        *high_antennas(plan),
    )
    parts = 2 if both else 1
    tags = {
        "SOFTWARE": f"mapfilter {program_version()}",
        "MODEL": model.model,
        "MAP": world.map_name,
    }
    given = plan, lattice, world.heights_m, model
    levels = predict(*given, part_of(progress, 0, parts), antennas=antennas)
    write_rasters(target, lattice, levels, plan.ids, tags)
    if both:
        errors = config.prediction.ground_truth.of(GroundTruthErrors)
        part = part_of(progress, 1, parts)
        real = simulate_ground_truth(*given, errors, part, antennas=antennas)
        write_rasters(ground_truth, lattice, real, plan.ids, {**tags, **ground_truth_tags(target)})
    plan_path = config.output.dir / "cells.csv"
    write_cell_plan(plan, plan_path)
    size = len(plan), lattice.rows, lattice.cols
    return PredictResult(*size, target, ground_truth if both else None, plan_path, notes)
