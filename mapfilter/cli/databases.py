"""Commands from inputs to a radio-route database, and what it tells before anybody walks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    NO_CONFIG,
    WRONG,
    ClusterOption,
    ConfigOption,
    DatabaseArgument,
    DryRunOption,
    JsonOption,
    OutOption,
    PathArgument,
    ResumeOption,
    SeedOption,
    SetOption,
    WorkersOption,
    given_path,
    named_defaults,
    named_options,
    refuse,
    seeded,
    toml,
)
from mapfilter.workflows.outputs.progress_bars import progress_bar
from mapfilter.workflows.outputs.terminal import print_message, print_result, print_text

_OF_BOUND = {
    "FirstFixOptions, spacing_m": "--spacing",
    "FirstFixOptions, journeys": "--journeys",
    "ErrorModel, deviation_db": "--level-error",
    "ErrorModel, correlation_m": "--correlation",
}
"""Options of ``bound`` by the places that faults name."""


def check(
    config: ConfigOption = None,
    settings: SetOption = None,
    logs: Annotated[
        Path | None,
        typer.Option(
            "--logs", metavar="LOGS", help="Journeys: names suspects of the database by them."
        ),
    ] = None,
    database: Annotated[
        Path | None,
        typer.Option("--db", metavar="DB", help="With --logs: the database; then only it."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check all inputs together before anything runs; exit code 2 if something is wrong."""
    from mapfilter.check.findings import CheckResult, paragraphs
    from mapfilter.config.load import load_config
    from mapfilter.workflows.check import run_check

    if logs is None:
        refuse({"--db": database}, "check without --logs")
    given = list(settings or ())
    for key, value in (("database.path", database), ("track.path", logs)):
        if value is not None:
            given.append(f"{key}={toml(str(value))}")
    loaded = load_config(config, given)
    with progress_bar("check") as progress:
        result = CheckResult(True, ()) if database is not None else run_check(loaded, progress)
        if logs is not None:
            # Here, as it imports all that learns from journeys.
            from mapfilter.workflows.checks.suspects import checked_together, run_check_suspects

            result = checked_together(result, run_check_suspects(loaded, progress))
    if as_json:
        print_result(result, as_json)
    else:
        print_text("\n\n".join(paragraphs(result)))
    if not result.ok:
        if config is None and not given:
            print_message(f"command line: expected {NO_CONFIG}, found none; defaults were checked")
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

    given = seeded(settings, seed, "prediction.seed", "prediction.ground_truth.seed")
    with named_defaults(config, settings), progress_bar("predict") as progress:
        result = run_predict(load_config(config, given, out=out), progress)
    print_result(result, as_json)


def build(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    roads_only: Annotated[
        bool,
        typer.Option("--roads-only", help="A database without cells: no rasters, no cell plan."),
    ] = False,
    dry_run: DryRunOption = False,
    workers: WorkersOption = 1,
    cluster: ClusterOption = None,
    resume: ResumeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Build a radio-route database from RxLev rasters and roads."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.build import run_build, run_dry_build

    given = [*(settings or ()), *(["database.cells=false"] if roads_only else [])]
    loaded = load_config(config, given, out=out)
    if not (loaded.database.cells or dry_run):
        parallel = {"--workers": workers if workers > 1 else None, "--cluster": cluster}
        refuse(parallel | {"--resume": resume or None}, "a build of roads alone")
    if dry_run:
        with named_defaults(config, given):
            estimate = run_dry_build(loaded)
        print_result(estimate, as_json)
        return
    with named_defaults(config, given), progress_bar("build") as progress:
        result = run_build(
            loaded, workers=workers, cluster=cluster, resume=resume, progress=progress
        )
    print_result(result, as_json)


def merge(
    databases: Annotated[
        list[Path], typer.Argument(metavar="DB...", help="Databases, one or more.")
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DB",
            help="The merged database: a folder of its own.",
            callback=given_path,
        ),
    ],
    without: Annotated[
        list[str] | None,
        typer.Option("--without-cell", metavar="CELL", help="A cell to leave out; repeatable."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Merge databases of several areas or cells; later databases override earlier ones."""
    from mapfilter.workflows.databases import run_merge

    given = [given_path(path) or path for path in databases]
    with named_options({"without": "--without-cell"}), progress_bar("merge") as progress:
        result = run_merge(given, out.absolute(), without=without or (), progress=progress)
    print_result(result, as_json)


def export(
    database: DatabaseArgument,
    to: Annotated[
        Path,
        typer.Option("--to", metavar="FILE", help="A .gpkg or .tif file.", callback=given_path),
    ],
    as_json: JsonOption = False,
) -> None:
    """Write a radio-route database as GeoPackage, or best server and margin as GeoTIFF."""
    from mapfilter.workflows.databases import run_export

    print_result(run_export(database, to.absolute()), as_json)


def info(path: PathArgument, as_json: JsonOption = False) -> None:
    """Describe a database, raster, log, recording, map or table."""
    from mapfilter.workflows.info import run_info

    print_result(run_info(path), as_json)


def bound(
    database: DatabaseArgument,
    out: OutOption = None,
    spacing_m: Annotated[
        float, typer.Option("--spacing", metavar="M", help="Metres between the starts of journeys.")
    ] = 50.0,
    journeys: Annotated[int, typer.Option("--journeys", help="Journeys from each start.")] = 2,
    level_error_db: Annotated[
        float,
        typer.Option(
            "--level-error", metavar="DB", help="Standard deviation of errors of predicted levels."
        ),
    ] = 7.0,
    correlation_m: Annotated[
        float,
        typer.Option("--correlation", metavar="M", help="Correlation length of these errors."),
    ] = 50.0,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict where a database will work: accuracy, metres to a first fix, ambiguous places."""
    from mapfilter.evaluation.first_fix import FirstFixOptions
    from mapfilter.evaluation.radio_map import ErrorModel
    from mapfilter.workflows.bound import run_bound

    with named_options(_OF_BOUND):
        errors = ErrorModel(level_error_db, correlation_m)
        options = FirstFixOptions(spacing_m=spacing_m, journeys=journeys)
    folder = (out or Path("bound")).absolute()
    with progress_bar("bound") as progress:
        result = run_bound(
            database, folder, errors=errors, options=options, seed=seed or 0, progress=progress
        )
    print_result(result, as_json)
