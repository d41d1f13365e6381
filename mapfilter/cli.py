"""The command line: parses, calls one workflow, prints. Logs and progress go to stderr."""

from __future__ import annotations

import errno
import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from mapfilter import __version__
from mapfilter.errors import ConfigError, MapfilterError, fail
from mapfilter.workflows.terminal import print_result, progress_bar, say

DONE, WRONG, PARTIAL = 0, 2, 3
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Find where a phone or a vehicle is without GNSS.",
)


def _given_path(path: Path | None) -> Path | None:
    """Refuse what cannot be a path, before anything is opened."""
    from mapfilter.workflows.paths import path_fault, shown

    if path is not None and (wrong := path_fault(path)):
        raise fail(ConfigError, "command line", wrong, shown(str(path)))
    return path


ConfigOption = Annotated[
    Path | None, typer.Option("-c", "--config", metavar="FILE", help="Configuration (TOML).")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.KEY=VALUE", help="Change one setting; repeatable."),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Output folder.", callback=_given_path),
]
SeedOption = Annotated[int | None, typer.Option("--seed", min=0, help="Seed of what is drawn.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on one line.")]
PathArgument = Annotated[Path, typer.Argument(metavar="PATH", callback=_given_path)]


@app.command()
def demo(
    out: OutOption = None,
    seed: SeedOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the whole chain on the embedded map of central Helsinki."""
    from mapfilter.workflows.demo import run_demo

    with progress_bar("demo") as progress:
        result = run_demo(
            (out or Path("mapfilter-demo")).absolute(), settings or (), seed=seed, progress=progress
        )
    print_result(result, as_json)


@app.command()
def check(
    config: ConfigOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Look at all inputs together before anything runs; exit code 2 if something is wrong."""
    from mapfilter.workflows.check import run_check
    from mapfilter.workflows.config import load_config
    from mapfilter.workflows.findings import paragraphs

    with progress_bar("check") as progress:
        result = run_check(load_config(config, settings or ()), progress)
    if as_json:
        print_result(result, as_json)
    else:
        sys.stdout.write("\n\n".join(paragraphs(result)) + "\n")
    if not result.ok:
        raise typer.Exit(WRONG)


@app.command()
def predict(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict RxLev rasters from cell plan and buildings, and a set that plays reality."""
    from mapfilter.workflows.config import load_config
    from mapfilter.workflows.predict import run_predict

    seeded = _seeded(settings, seed, "prediction.seed", "prediction.reality.seed")
    with progress_bar("predict") as progress:
        result = run_predict(load_config(config, seeded, out=out), progress)
    print_result(result, as_json)


@app.command()
def build(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only tell size, memory and time.")
    ] = False,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Local processes.")] = 1,
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="ADDRESS", help="A Dask scheduler, or local:N."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on where a build was cut short.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Build a radio-route database from RxLev rasters and roads."""
    from mapfilter.workflows.build import run_build, run_dry_build
    from mapfilter.workflows.config import load_config

    loaded = load_config(config, settings or (), out=out)
    if dry_run:
        print_result(run_dry_build(loaded), as_json)
        return
    with progress_bar("build") as progress:
        result = run_build(
            loaded, workers=workers, cluster=cluster, resume=resume, progress=progress
        )
    print_result(result, as_json)


@app.command()
def merge(
    databases: Annotated[list[Path], typer.Argument(metavar="DB...", help="One or more.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="DB", help="The new one.", callback=_given_path)
    ],
    without: Annotated[
        list[str] | None, typer.Option("--without-cell", metavar="CELL", help="Repeatable.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Merge databases of other areas or cells; a later one replaces what it covers."""
    from mapfilter.workflows.merge import run_merge

    given = [_given_path(path) or path for path in databases]
    with progress_bar("merge") as progress:
        result = run_merge(given, out.absolute(), without=without or (), progress=progress)
    print_result(result, as_json)


@app.command()
def bench(
    stage: Annotated[str, typer.Argument(metavar="[NAME]", help="build.")] = "build",
    runs: Annotated[int, typer.Option("--runs", min=1, help="Runs that medians are of.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Tell how fast a stage is on this machine."""
    from mapfilter.workflows.bench import run_bench

    print_result(run_bench(stage, runs=runs), as_json)


@app.command()
def export(
    database: Annotated[Path, typer.Argument(metavar="DB", callback=_given_path)],
    to: Annotated[
        Path,
        typer.Option("--to", metavar="FILE", help="A .gpkg or .tif file.", callback=_given_path),
    ],
    as_json: JsonOption = False,
) -> None:
    """Write a radio-route database as GeoPackage, or best server and margin as GeoTIFF."""
    from mapfilter.workflows.export import run_export

    print_result(run_export(database, to), as_json)


@app.command()
def info(path: PathArgument, as_json: JsonOption = False) -> None:
    """Tell what a database, raster set or log holds."""
    from mapfilter.workflows.info import run_info

    print_result(run_info(path), as_json)


@app.command()
def simulate(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate journeys with truth along the streets."""
    from mapfilter.workflows.config import load_config
    from mapfilter.workflows.simulate import run_simulate

    seeded = _seeded(settings, seed, "journeys.seed")
    with progress_bar("simulate") as progress:
        result = run_simulate(load_config(config, seeded, out=out), progress)
    print_result(result, as_json)


@app.command()
def replay(
    database: Annotated[Path | None, typer.Option("--db", metavar="DB", help="Database.")] = None,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="LOG", help="A log, or a folder of logs.")
    ] = None,
    filter_name: Annotated[
        str | None, typer.Option("--filter", metavar="NAME", help="candidate.")
    ] = None,
    without: Annotated[
        str | None,
        typer.Option("--without", metavar="KINDS", help="What to leave out: gnss,ta,neighbours."),
    ] = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Locate one log, or every log of a folder; exit code 3 if that was done in part only."""
    from mapfilter.workflows.config import load_config
    from mapfilter.workflows.replay import run_replay
    from mapfilter.workflows.replayed import replay_facts

    given = _seeded(settings, seed, "journeys.seed")
    for key, value in (("database.path", database), ("track.path", log)):
        if value is not None:
            given.append(f"{key}={_toml(str(value))}")
    if filter_name is not None:
        given.append(f"filter.name={_toml(filter_name)}")
    if without is not None:
        given.append(f"track.without={_toml([kind.strip() for kind in without.split(',')])}")
    loaded = load_config(config, given)
    folder = (out or loaded.output.dir / "replay").absolute()
    with progress_bar("replay") as progress:
        result = run_replay(loaded, folder, progress=progress)
    print_result(replay_facts(result), as_json)
    for warning in result.warnings:
        say(warning)
    if result.partial:
        raise typer.Exit(PARTIAL)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        sys.stdout.write(f"mapfilter {__version__}\n")
        raise typer.Exit(DONE)


def main() -> None:
    """Run the command line; a user's error is one clear message and exit code 2."""
    try:
        app()
    except MapfilterError as error:
        say(str(error), "error: ")
        sys.exit(WRONG)
    except MemoryError:
        hint = "too large an area, too fine a resolution, or a value in the wrong unit"
        say(f"memory: expected enough of it, found none left (likely: {hint})", "error: ")
        sys.exit(WRONG)
    except OSError as error:
        if error.errno not in _NO_SPACE:
            raise
        where = error.filename or "the output"
        say(f"{where}: expected space on the disk, found none left", "error: ")
        sys.exit(WRONG)


def _seeded(settings: list[str] | None, seed: int | None, *keys: str) -> list[str]:
    """Return the settings with a seed for each key, after what was set by name."""
    seeds = [] if seed is None else [f"{key}={seed}" for key in keys]
    return [*(settings or ()), *seeds]


def _toml(value: str | list[str]) -> str:
    """Return a text, or a list of texts, as TOML writes it."""
    # Escapes of JSON in the ASCII form are pairs of surrogates, which TOML does not know.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
