"""Commands from inputs to a radio-route database, and what can be done with one."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    WRONG,
    ClusterOption,
    ConfigOption,
    JsonOption,
    OutOption,
    PathArgument,
    ResumeOption,
    SeedOption,
    SetOption,
    WorkersOption,
    given_path,
    seeded,
)
from mapfilter.workflows.terminal import print_result, progress_bar


def check(
    config: ConfigOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Look at all inputs together before anything runs; exit code 2 if something is wrong."""
    from mapfilter.check.findings import paragraphs
    from mapfilter.config.load import load_config
    from mapfilter.workflows.check import run_check

    with progress_bar("check") as progress:
        result = run_check(load_config(config, settings or ()), progress)
    if as_json:
        print_result(result, as_json)
    else:
        sys.stdout.write("\n\n".join(paragraphs(result)) + "\n")
    if not result.ok:
        raise typer.Exit(WRONG)


def predict(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict RxLev rasters from cell plan and buildings, and a perturbed set: the ground truth."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.predict import run_predict

    settings = seeded(settings, seed, "prediction.seed", "prediction.ground_truth.seed")
    with progress_bar("predict") as progress:
        result = run_predict(load_config(config, settings, out=out), progress)
    print_result(result, as_json)


def build(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only tell size, memory and time.")
    ] = False,
    workers: WorkersOption = 1,
    cluster: ClusterOption = None,
    resume: ResumeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Build a radio-route database from RxLev rasters and roads."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.build import run_build, run_dry_build

    loaded = load_config(config, settings or (), out=out)
    if dry_run:
        print_result(run_dry_build(loaded), as_json)
        return
    with progress_bar("build") as progress:
        result = run_build(
            loaded, workers=workers, cluster=cluster, resume=resume, progress=progress
        )
    print_result(result, as_json)


def merge(
    databases: Annotated[list[Path], typer.Argument(metavar="DB...", help="One or more.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="DB", help="The new one.", callback=given_path)
    ],
    without: Annotated[
        list[str] | None, typer.Option("--without-cell", metavar="CELL", help="Repeatable.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Merge databases of other areas or cells; a later one replaces what it covers."""
    from mapfilter.workflows.databases import run_merge

    given = [given_path(path) or path for path in databases]
    with progress_bar("merge") as progress:
        result = run_merge(given, out.absolute(), without=without or (), progress=progress)
    print_result(result, as_json)


def export(
    database: Annotated[Path, typer.Argument(metavar="DB", callback=given_path)],
    to: Annotated[
        Path,
        typer.Option("--to", metavar="FILE", help="A .gpkg or .tif file.", callback=given_path),
    ],
    as_json: JsonOption = False,
) -> None:
    """Write a radio-route database as GeoPackage, or best server and margin as GeoTIFF."""
    from mapfilter.workflows.databases import run_export

    print_result(run_export(database, to), as_json)


def info(path: PathArgument, as_json: JsonOption = False) -> None:
    """Tell what a database, raster set or log holds."""
    from mapfilter.workflows.info import run_info

    print_result(run_info(path), as_json)


def bound(
    database: Annotated[Path, typer.Argument(metavar="DB", callback=given_path)],
    out: OutOption = None,
    spacing_m: Annotated[
        float, typer.Option("--spacing", metavar="M", help="Metres between starts.")
    ] = 50.0,
    journeys: Annotated[int, typer.Option("--journeys", help="From each start.")] = 2,
    level_error_db: Annotated[
        float, typer.Option("--level-error", metavar="DB", help="Of predicted levels.")
    ] = 7.0,
    correlation_m: Annotated[
        float, typer.Option("--correlation", metavar="M", help="How far these errors last.")
    ] = 50.0,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Tell where a database will work: accuracy, metres to convergence, places that look alike."""
    from mapfilter.evaluation.first_fix import FirstFixOptions
    from mapfilter.evaluation.radio_map import ErrorModel
    from mapfilter.workflows.bound import run_bound

    errors = ErrorModel(level_error_db, correlation_m)
    options = FirstFixOptions(spacing_m=spacing_m, journeys=journeys)
    folder = (out or Path("bound")).absolute()
    with progress_bar("bound") as progress:
        result = run_bound(
            database, folder, errors=errors, options=options, seed=seed or 0, progress=progress
        )
    print_result(result, as_json)
