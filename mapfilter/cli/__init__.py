"""The command line: parses, calls one workflow, prints. Logs and progress go to stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Annotated, Any

import typer
from typer.core import TyperArgument, TyperCommand
from typer.main import get_command

from mapfilter._io import program_version
from mapfilter._kernel_cache import keep_kernels
from mapfilter._memory import keep_freed_memory, search_cycles_rarely
from mapfilter.cli.convert import convert
from mapfilter.cli.databases import bound, build, check, export, info, merge, predict
from mapfilter.cli.evaluate import evaluate
from mapfilter.cli.experiments import bench, reproduce, sweep
from mapfilter.cli.learning import learn
from mapfilter.cli.options import DONE
from mapfilter.cli.serving import serve
from mapfilter.cli.tracks import demo, locate, replay, simulate
from mapfilter.cli.views import film, view
from mapfilter.workflows.outputs.guard import guarded

__all__ = ["app", "main"]

_COMMANDS: tuple[tuple[Callable[..., None], str, str], ...] = (
    (demo, "--out demo", "quickstart.rst"),
    (check, "-c area.toml", "cli.rst"),
    (predict, "-c area.toml --out area", "howto/sites-and-osm.rst"),
    (build, "-c area.toml --out area --workers 4", "howto/planner-rasters.rst"),
    (merge, "north/database south/database --out both", "cli.rst"),
    (export, "area/database --to area.gpkg", "cli.rst"),
    (info, "area/database", "cli.rst"),
    (bound, "area/database --out bound", "howto/where-will-it-work.rst"),
    (convert, "walk.txt --truth watch.gpx --out walk", "howto/recordings.rst"),
    (simulate, "-c area.toml --out area", "explanation/simulated-worlds.rst"),
    (locate, "--db fingerprints --log walk --out located-reports", "howto/single-reports.rst"),
    (
        replay,
        "--db area/database --log walk --html --out located",
        "howto/which-filter.rst",
    ),
    (serve, "--db area/database --state sessions", "howto/serve.rst"),
    (view, "located other --out both.html", "howto/see-a-replay.rst"),
    (film, "located --out walk.gif", "howto/see-a-replay.rst"),
    (learn, "area/database --logs walks --out learned", "tutorial/learn.rst"),
    (sweep, "-c sweep.toml --out sweep --workers 4", "howto/sweep.rst"),
    (reproduce, "khalaf-allah-2007 --trials 20 --out paper", "explanation/success-statistics.rst"),
    (evaluate, "global-positioning --case levels-6 --runs 5", "explanation/simulated-worlds.rst"),
    (bench, "filter --runs 3", "explanation/scale.rst"),
)
"""Commands, each with an example and a page of the documentation."""


class _Command(TyperCommand):
    """A command that takes its database also by ``--db``, as those do which take a log beside."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse arguments; click's own, where ``--db`` is no option."""
        if any(one.name == "database" and isinstance(one, TyperArgument) for one in self.params):
            plain = (arg.removeprefix("--db=") for arg in args)
            args = [arg for arg in plain if arg != "--db"]
        return super().parse_args(ctx, args)


def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        sys.stdout.write(f"mapfilter {program_version()}\n")
        raise typer.Exit(DONE)


def _app_of(commands: Sequence[tuple[Callable[..., None], str, str]]) -> typer.Typer:
    """Return the command line of some of the commands."""
    app = typer.Typer(
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        no_args_is_help=True,
        help="Find where a phone or a vehicle is without GNSS.",
        epilog="\b\nStart with:\n  mapfilter demo\n\nDocumentation: docs/quickstart.rst",
    )
    app.callback(invoke_without_command=True)(_version)
    for command, example, page in commands:
        name = command.__name__
        app.command(
            cls=_Command,
            short_help=(command.__doc__ or "").partition("\n")[0],
            epilog=f"\b\nExample:\n  mapfilter {name} {example}\n\nDocumentation: docs/{page}",
        )(command)
    return app


app = _app_of(_COMMANDS)


def main() -> None:
    """Run the command line; a user's error gives one message and exit code 2."""
    # Work is shared between processes, and matrices are small: threads of BLAS, which read this
    # when NumPy is loaded, would take several times as long, most of it waiting for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    keep_freed_memory()
    search_cycles_rarely()
    # The command itself, because a Typer app puts its own hook for exceptions in place.
    sys.exit(guarded(_run))


def _run() -> int | None:
    keep_kernels()
    return _command_line(sys.argv[1] if len(sys.argv) > 1 else "")()


@cache
def _command_line(name: str) -> Callable[[], int | None]:
    """Return the command of a name, or all of them where the arguments begin with none.

    To look at the types of the options of all commands takes as long as many commands.
    """
    named = [command for command in _COMMANDS if command[0].__name__ == name]
    return get_command(_app_of(named) if named else app)
