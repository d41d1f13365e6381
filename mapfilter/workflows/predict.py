"""``mapfilter predict``: cell plan and buildings to RxLev rasters, and a set that plays reality."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mapfilter import __version__
from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress, part_of
from mapfilter.radio.cells import write_cell_plan
from mapfilter.radio.predict import (
    PredictionModel,
    RealityErrors,
    off_frequency,
    outside_validity,
    predict,
    realise,
)
from mapfilter.radio.rasters import write_rasters
from mapfilter.workflows.cover import check_cells_near, map_cover
from mapfilter.workflows.reality import reality_tags
from mapfilter.workflows.sections import Config, Prediction
from mapfilter.workflows.world import World

if TYPE_CHECKING:
    from mapfilter.workflows.survey import SurveyResult


@dataclass(frozen=True)
class PredictResult:
    """What was predicted.

    Parameters
    ----------
    cells, rows, cols : int
        Counts of cells and pixels.
    rasters : Path
        The predicted levels.
    reality : Path or None
        The levels that play reality, where asked for.
    plan : Path
        The cell plan used, as CSV.
    notes : tuple of str
        How much of the area the map covers if not nearly all, where building heights come from,
        what lies outside the model's published range, and which antennas were measured at another
        frequency.
    """

    cells: int
    rows: int
    cols: int
    rasters: Path
    reality: Path | None
    plan: Path
    notes: tuple[str, ...]


def run_predict(config: Config, progress: Progress | None = None) -> PredictResult | SurveyResult:
    """Predict every cell of the plan over the area, or make the map of a survey's measurements.

    Raises
    ------
    MapfilterError
        The area, map or plan is wrong, or the output cannot be written.
    """
    name = config.prediction.model
    if name == "survey":
        from mapfilter.workflows.survey import run_survey

        return run_survey(config, progress)
    world = World.of(config)
    target, reality = config.rasters_path, config.reality_path
    for folder in (target.parent, reality.parent, config.output.dir):
        ensure_writable_folder(folder)
    plan, lattice, model = world.plan, world.lattice, prediction_model(config.prediction)
    check_cells_near(plan, lattice, str(config.cells.plan or "cells"))
    antennas = world.antennas
    notes = (
        *map_cover(world),
        world.buildings.told,
        *plan.notes,
        *(note for antenna in antennas.values() for note in antenna.notes),
        *outside_validity(plan, lattice, model),
        *off_frequency(plan, antennas),
    )
    heights_m = world.heights_m
    wanted = 2 if config.prediction.reality.write else 1
    tags = {"SOFTWARE": f"mapfilter {__version__}", "MODEL": model.model, "MAP": world.map_name}
    levels = predict(
        plan, lattice, heights_m, model, part_of(progress, 0, wanted), antennas=antennas
    )
    write_rasters(target, lattice, levels, plan.ids, tags)
    if wanted == 2:
        errors = ground_truth_errors(config.prediction)
        real = realise(
            plan, lattice, heights_m, model, errors, part_of(progress, 1, wanted), antennas=antennas
        )
        write_rasters(reality, lattice, real, plan.ids, {**tags, **reality_tags(target)})
    plan_path = config.output.dir / "cells.csv"
    write_cell_plan(plan, plan_path)
    return PredictResult(
        len(plan),
        lattice.rows,
        lattice.cols,
        target,
        reality if wanted == 2 else None,
        plan_path,
        notes,
    )


def prediction_model(section: Prediction) -> PredictionModel:
    """Return the propagation model of a configuration that does not ask for a survey."""
    return PredictionModel(**section.model_dump(exclude={"reality", "survey"}))


def ground_truth_errors(section: Prediction) -> RealityErrors:
    """Return how a configuration's ground truth differs from its prediction."""
    return RealityErrors(**section.reality.model_dump(exclude={"write"}))
