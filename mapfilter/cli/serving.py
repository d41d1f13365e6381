"""The command that serves live positions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import ConfigOption, SetOption, given_path, refuse
from mapfilter.errors import ConfigError, fail
from mapfilter.workflows.outputs.progress_bars import progress_bar


def serve(
    database: Annotated[
        Path, typer.Option("--db", metavar="DB", help="Database.", callback=given_path)
    ],
    host: Annotated[
        str, typer.Option("--host", metavar="ADDRESS", help="Address to listen on.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", help="0 takes a free one.")] = 8765,
    host_names: Annotated[
        list[str] | None,
        typer.Option(
            "--host-name", metavar="NAME", help="A name by which clients reach it; repeatable."
        ),
    ] = None,
    token_file: Annotated[
        Path | None,
        typer.Option(
            "--token-file",
            metavar="FILE",
            help="Token that clients must send; or MAPFILTER_TOKEN in the environment.",
            callback=given_path,
        ),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(
            "--state",
            metavar="DIR",
            help="Save sessions there; a restart goes on with them.",
            callback=given_path,
        ),
    ] = None,
    save_every_s: Annotated[
        float | None,
        typer.Option("--save-every", metavar="S", help="Seconds between two savings. Default: 10."),
    ] = None,
    sessions: Annotated[int, typer.Option("--sessions", help="Most sessions at a time.")] = 1000,
    idle_min: Annotated[
        float, typer.Option("--idle", metavar="MIN", help="Minutes after which a session ends.")
    ] = 60.0,
    memory_mib: Annotated[
        int, typer.Option("--memory", metavar="MIB", help="Memory for states of sessions.")
    ] = 1000,
    body_kib: Annotated[
        int, typer.Option("--body", metavar="KIB", help="Largest body of a request.")
    ] = 1024,
    rate_per_s: Annotated[
        float, typer.Option("--rate", help="Epochs and requests a second of one address.")
    ] = 200.0,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Threads that run steps.")] = 2,
    method: Annotated[
        str | None,
        typer.Option("--method", metavar="NAME", help="Of single reports, as locate takes it."),
    ] = None,
    level_error_db: Annotated[
        float | None,
        typer.Option(
            "--level-error",
            metavar="DB",
            help="Standard deviation of levels of a database. Default: 6.",
        ),
    ] = None,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Serve live positions on this machine: a session for each device, and single reports."""
    from mapfilter.config.load import load_config

    try:
        from mapfilter.workflows.serve import ServeOptions, run_serve
    except ModuleNotFoundError as error:
        if error.name not in ("starlette", "uvicorn", "anyio", "h11"):
            raise
        expected = "the packages of the extra serve (pip install 'mapfilter[serve]')"
        raise fail(ConfigError, "serve", expected, f"no {error.name}") from error
    from mapfilter.serving.limits import ServiceLimits

    if state is None:
        refuse({"--save-every": save_every_s}, "serve without --state")
    limits = ServiceLimits(
        sessions=sessions,
        idle_s=60.0 * idle_min,
        state_bytes=memory_mib << 20,
        body_bytes=body_kib << 10,
        rate_per_s=rate_per_s,
    )
    options = ServeOptions(
        host=host,
        port=port,
        host_names=tuple(host_names or ()),
        token_file=token_file,
        state=state.absolute() if state is not None else None,
        save_every_s=10.0 if save_every_s is None else save_every_s,
        workers=workers,
        method=method,
        level_error_db=level_error_db,
        limits=limits,
    )
    loaded = load_config(config, settings or ())
    with progress_bar("serve") as progress:
        run_serve(loaded, database, options, progress)
