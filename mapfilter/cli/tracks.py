"""Commands that make logs and locate them, and the whole chain at once."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Annotated, get_args

import typer

from mapfilter.cli.options import (
    PARTIAL,
    ColumnOption,
    ConfigOption,
    DeclinationOption,
    FactorOption,
    FilterOption,
    JsonOption,
    OffsetOption,
    OutOption,
    SeedOption,
    SetOption,
    StepLengthOption,
    TruthOption,
    ZoneOption,
    check_custom_filter,
    clock_offsets,
    column_map,
    given_path,
    motion_factors,
    named_defaults,
    named_options,
    refuse,
    seeded,
    toml,
    undrawn,
    walk_changes,
)
from mapfilter.errors import ConfigError, already_noted, fail
from mapfilter.tracks.schema import Without
from mapfilter.workflows.outputs.progress_bars import progress_bar, stage_bar
from mapfilter.workflows.outputs.terminal import print_message, print_result, print_text

_UNPROTECTED = "candidate"
"""The built-in filter without protection levels."""


def demo(
    out: OutOption = None,
    seed: SeedOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the whole chain on the embedded map of central Helsinki."""
    from mapfilter.workflows.demo import WHAT_ONE_SEES, run_demo

    with stage_bar("demo") as progress:
        result = run_demo(
            (out or Path("mapfilter-demo")).absolute(), settings or (), seed=seed, progress=progress
        )
    address = result.pop("open")
    print_result(result, as_json)
    if not as_json:
        print_text(f"\nOpen {address} in a browser.\n{WHAT_ONE_SEES}")


def simulate(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate journeys along the streets, with ground truth."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.simulate import run_simulate

    given = seeded(settings, seed, "journeys.seed")
    with named_defaults(config, settings), progress_bar("simulate") as progress:
        result = run_simulate(load_config(config, given, out=out), progress)
    print_result(result, as_json)
    if result.partial:
        print_message("no journey receives a cell: the rasters hold no level along the streets")
        raise typer.Exit(PARTIAL)


def locate(
    database: Annotated[
        Path,
        typer.Option(
            "--db",
            metavar="DB",
            help="Database; or fingerprints: logs or recordings with positions, or a table.",
            callback=given_path,
        ),
    ],
    log: Annotated[
        Path,
        typer.Option(
            "--log", metavar="LOG", help="A log, recording, table, or folder.", callback=given_path
        ),
    ],
    method: Annotated[
        str,
        typer.Option("--method", metavar="NAME", help="auto, knn, probabilistic, gp or centroid."),
    ] = "auto",
    crs: Annotated[
        str | None, typer.Option("--crs", metavar="EPSG", help="CRS of metres in a table.")
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            "--column", metavar="FIELD=COLUMN", help="Column of a plain CSV, the log; repeatable."
        ),
    ] = None,
    truth: TruthOption = None,
    zone: ZoneOption = None,
    offset: OffsetOption = None,
    level_error_db: Annotated[
        float | None,
        typer.Option(
            "--level-error",
            metavar="DB",
            help="Standard deviation of levels of a database. Default: 6.",
        ),
    ] = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Locate each report of a log by itself; exit code 3 if none has a position."""
    from mapfilter.workflows.locate import run_locate

    if level_error_db is not None and not 0 < level_error_db <= 60:
        raise fail(ConfigError, "--level-error", "dB > 0, at most 60", level_error_db)
    folder = (out or Path("located-reports")).absolute()
    with progress_bar("locate") as progress:
        result = run_locate(
            database,
            log,
            folder,
            method=method,
            crs=crs,
            columns=column_map(column),
            zone=zone or "",
            truth=[given_path(path) or path for path in truth or ()],
            offsets_s=clock_offsets(offset),
            level_error_db=level_error_db,
            seed=seed or 0,
            progress=progress,
        )
    print_result(result.shown, as_json)
    if not result.figures["located"]:
        reasons = ", ".join(result.figures["not_located"]) or "the log has no report of a cell"
        print_message(f"nothing is located: {reasons}")
        raise typer.Exit(PARTIAL)


def replay(
    database: Annotated[Path | None, typer.Option("--db", metavar="DB", help="Database.")] = None,
    log: Annotated[
        list[Path] | None,
        typer.Option(
            "--log",
            metavar="LOG",
            help="A log, or a folder of logs; or recordings of one journey, repeatable.",
        ),
    ] = None,
    truth: TruthOption = None,
    zone: ZoneOption = None,
    column: ColumnOption = None,
    offset: OffsetOption = None,
    factor: FactorOption = None,
    course_motion: Annotated[
        bool,
        typer.Option(
            "--course-motion", help="Make motion from speed and course of GNSS, else its positions."
        ),
    ] = False,
    declination: DeclinationOption = None,
    step_length: StepLengthOption = None,
    filter_name: FilterOption = None,
    without: Annotated[
        str | None,
        typer.Option(
            "--without",
            metavar="KINDS",
            help=f"What to leave out, with commas between: {', '.join(get_args(Without))}.",
        ),
    ] = None,
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth", help="Smooth the track by the whole log (forward filtering, backward pass)."
        ),
    ] = False,
    protection: Annotated[
        float | None,
        typer.Option(
            "--protection",
            metavar="RISK",
            help="Probability, at each epoch, that the error exceeds the protection level (1e-3).",
        ),
    ] = None,
    html: Annotated[
        bool,
        typer.Option("--html", help="Write replay.html, too: a page that plays and explains it."),
    ] = False,
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Locate one log, or every log of a folder; exit code 3 if done in part."""
    from mapfilter.workflows.outputs.drawer import drawer_process

    # What draws starts before the imports below, which take as long as its own.
    with nullcontext() if undrawn(config, settings or ()) else drawer_process() as drawers:
        from mapfilter.config.load import load_config
        from mapfilter.workflows.replay import run_replay, unnamed_database
        from mapfilter.workflows.replays.figures import replay_figures
        from mapfilter.workflows.replays.text import replay_text

        given = seeded(settings, seed, "journeys.seed")
        paths = {"database.path": database, "track.path": log[0] if log else None}
        for key, value in (paths | {"track.zone": zone}).items():
            if value is not None:
                given.append(f"{key}={toml(str(value))}")
        for key, files in (("track.recordings", (log or [])[1:]), ("track.truth", truth or [])):
            if files:
                given.append(f"{key}={toml([str(file) for file in files])}")
        columns = column_map(column)
        given += [f"track.columns.{field}={toml(name)}" for field, name in columns.items()]
        if shifts := clock_offsets(offset):
            pairs = ", ".join(f"{toml(name)} = {seconds!r}" for name, seconds in shifts.items())
            given.append(f"track.offsets_s={{{pairs}}}")
        for column_name, number in motion_factors(factor).items():
            given.append(f"track.factors.{column_name}={number!r}")
        if course_motion:
            given.append("track.course_motion=true")
        walk = walk_changes(declination, step_length)
        given += [f"track.walk.{name}={value!r}" for name, value in walk.items()]
        if filter_name is not None:
            given.append(f"filter.name={toml(filter_name)}")
        if without is not None:
            given.append(f"track.without={toml([kind.strip() for kind in without.split(',')])}")
        if smooth:
            given.append("filter.smooth=true")
        if protection is not None:
            given.append(f"integrity.risk={protection!r}")
        with named_options({} if without is None else {"setting track.without": "--without"}):
            loaded = load_config(config, given)
        if walk and not loaded.track.steps:
            refuse(
                {"--declination": declination, "--step-length": step_length}, "track.steps = false"
            )
        if loaded.filter.smooth or loaded.filter.name == _UNPROTECTED:
            whom = "a smoothed track" if loaded.filter.smooth else f"the filter {_UNPROTECTED}"
            refuse({"--protection": protection}, whom)
        check_custom_filter(loaded)
        # With a configuration it is the one that `build` makes of the same file.
        if config is None and (taken := unnamed_database(loaded)) is not None:
            print_message(f"no --db: the database is {taken}")
        if config is None and loaded.track.path is None:
            print_message(f"no --log: the logs are those of {loaded.track_path}")
        folder = (out or loaded.output.dir / "replay").absolute()
        printed: dict[str, None] = {}
        with progress_bar("replay") as progress, already_noted(printed):
            result = run_replay(
                loaded,
                folder,
                html=html,
                beside=True,
                drawers=drawers,
                progress=progress,
                on_notes=partial(_print_notes, printed),
            )
        figures = replay_figures(result)
        print_result(figures if as_json else replay_text(figures), as_json)
        _print_notes(printed, figures["notes"])
        for warning in result.warnings:
            print_message(warning)
        if result.partial:
            raise typer.Exit(PARTIAL)


def _print_notes(printed: dict[str, None], notes: Sequence[str]) -> None:
    """Print each note that has not been printed, and remember it."""
    for note in notes:
        if note not in printed:
            printed[note] = None
            print_message(note, "note: ")
