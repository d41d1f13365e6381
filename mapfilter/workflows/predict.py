"""``mapfilter predict``: cell plan and buildings to RxLev rasters, and a set that plays reality."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mapfilter import __version__
from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.radio._models import ModelName
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
    plan, lattice, model = world.plan, world.lattice, _model(name, config.prediction)
    check_cells_near(plan, lattice, str(config.cells.plan or "cells"))
    antennas = world.antennas
    notes = (
        *map_cover(world),
        world.buildings.told,
        *plan.notes,
        *(note for antenna in antennas.values() for note in antenna.notes),
        *outside_validity(plan, lattice, model),
        *off_frequency(plan, antennas),
        *_made_shadowing(config),
    )
    heights_m = world.heights_m
    wanted = 2 if config.prediction.reality.write else 1
    tags = {"SOFTWARE": f"mapfilter {__version__}", "MODEL": model.model, "MAP": world.map_name}
    levels = predict(plan, lattice, heights_m, model, _part(progress, 0, wanted), antennas=antennas)
    write_rasters(target, lattice, levels, plan.ids, tags)
    if wanted == 2:
        errors = _errors(config.prediction)
        real = realise(
            plan, lattice, heights_m, model, errors, _part(progress, 1, wanted), antennas=antennas
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


def _made_shadowing(config: Config) -> tuple[str, ...]:
    """Return a note when levels of somebody's own cells get shadowing that nobody asked for."""
    section = config.prediction
    asked_for = "shadowing_db" in section.model_fields_set or section.shadowing_db == 0
    if config.cells.plan is None or asked_for:
        return ()
    return (
        f"{section.shadowing_db:g} dB of made shadowing are in the levels, as for a simulation; "
        "set prediction.shadowing_db = 0 for the model's own levels",
    )


def _model(name: ModelName, section: Prediction) -> PredictionModel:
    return PredictionModel(
        model=name,
        line_of_sight=section.line_of_sight,
        environment=section.environment,
        path_loss_exponent=section.path_loss_exponent,
        reference_distance_m=section.reference_distance_m,
        reference_loss_db=section.reference_loss_db,
        metropolitan=section.metropolitan,
        mobile_height_m=section.mobile_height_m,
        street_width_m=section.street_width_m,
        building_separation_m=section.building_separation_m,
        street_orientation_deg=section.street_orientation_deg,
        default_roof_height_m=section.default_roof_height_m,
        shadowing_db=section.shadowing_db,
        shadowing_correlation_m=section.shadowing_correlation_m,
        site_share=section.site_share,
        seed=section.seed,
    )


def _errors(section: Prediction) -> RealityErrors:
    reality = section.reality
    return RealityErrors(
        level_error_db=reality.level_error_db,
        correlation_m=reality.correlation_m,
        site_share=reality.site_share,
        eirp_error_db=reality.eirp_error_db,
        azimuth_error_deg=reality.azimuth_error_deg,
        slope_error=reality.slope_error,
        seed=reality.seed,
    )


def _part(progress: Progress | None, part: int, parts: int) -> Progress | None:
    """Return a progress that counts one of several equal parts of the work."""
    if progress is None:
        return None
    return lambda done, total: progress(part * total + done, parts * total)
