"""Output of commands and pipelines: results on stdout, everything else on stderr."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import errno
import json
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapfilter._printing import printable, printable_json, quiet_callbacks, write
from mapfilter.errors import MapfilterError, Stopped

if TYPE_CHECKING:
    from mapfilter._parallel import Progress
    from mapfilter.config.sections import Config


WRONG = 2
"""Exit code: the input or the command is wrong, or the machine too small for it."""

_AGAIN_S = 0.05
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_MOST_COUNTS = 12
_MAX_TABLE_WIDTH = 200
_STOPS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


def print_message(text: str, kind: str = "") -> None:
    """Write lines to stderr, each with the program's name and ``kind`` before it."""
    for line in text.split("\n"):
        # A message that cannot be shown is no reason to fail otherwise than by the exit code.
        with contextlib.suppress(OSError):
            write(sys.stderr, f"mapfilter: {kind}{printable(line)}\n")


def print_text(text: str) -> None:
    """Write lines to stdout."""
    write(sys.stdout, printable(text) + "\n")


def print_result(result: Any, as_json: bool) -> None:
    """Print a result on stdout: one JSON line, or one line for each figure."""
    found = to_jsonable(result)
    if as_json:
        ascii_only = not (sys.stdout.encoding or "utf-8").lower().startswith("utf")
        text = json.dumps(found, ensure_ascii=ascii_only, allow_nan=False)
        write(sys.stdout, printable_json(text) + "\n")
        return
    for line in text_lines(found):
        print_text(line)


@contextlib.contextmanager
def progress_bar(label: str) -> Iterator[Progress | None]:
    """Show a progress bar on stderr, if that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextlib.contextmanager
def stage_bar(label: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a bar on stderr with the name of each stage, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total, what: None  # noqa: ARG005
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label)

        def show(done: int, total: int, what: str) -> None:
            bar.update(task, completed=done, total=total, description=f"{done + 1}/{total} {what}")

        yield show


def rate_text(per_s: float, unit: str) -> str:
    """Format a rate per second, or per minute below one per second.

    Examples
    --------
    >>> rate_text(13.83, "runs"), rate_text(0.045, "sessions")
    ('13.8 runs/s', '2.7 sessions/min')
    """
    return f"{per_s:.1f} {unit}/s" if per_s >= 1 else f"{60 * per_s:.1f} {unit}/min"


@contextlib.contextmanager
def rate_bar(label: str, unit: str, every_s: float = 30.0) -> Iterator[Progress]:
    """Show progress, rate and time left on stderr: a bar, or without terminal a line now and then.

    ``unit`` is what is counted; ``every_s`` the seconds between two lines.
    """
    bar: Any = None
    task: Any = None
    began_s = printed_s = time.monotonic()
    first = -1

    def show(done: int, total: int) -> None:
        nonlocal began_s, first, printed_s
        now_s = time.monotonic()
        if first < 0:
            began_s, first = now_s, done
        per_s = (done - first) / max(now_s - began_s, 1e-6)
        if bar is not None:
            bar.update(task, completed=done, total=total, rate=rate_text(per_s, unit))
        elif now_s - printed_s >= every_s and done > first:
            printed_s = now_s
            left_s = (total - done) / per_s
            many = f"{done} of {total} {unit}, {rate_text(per_s, unit)}, {left_s:.0f} s left"
            print_message(f"{label}: {many}")

    if not sys.stderr.isatty():
        yield show
        return
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TextColumn

    columns = (*Bar.get_default_columns(), TextColumn("{task.fields[rate]}"))
    # Steps may lie minutes apart; with rich's usual 30 s there would be no time left.
    console = Console(stderr=True)
    bar = Bar(*columns, console=console, transient=True, speed_estimate_period=86_400.0)
    with bar:
        task = bar.add_task(label, total=None, rate="")
        yield show


@contextlib.contextmanager
def stop_signals() -> Iterator[None]:
    """Raise Stopped within the block when a signal asks the process to end; a second one ends it.

    So what is half-written is removed, and workers are ended. Where a signal arrives in a library's
    callback, nobody can catch what is raised there: it is raised again a moment later.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _: object) -> None:
        for one in _STOPS:
            signal.signal(one, signal.SIG_DFL)
        raise Stopped(number)

    def unraisable(lost: sys.UnraisableHookArgs) -> None:
        error = lost.exc_value
        if not isinstance(error, Stopped):
            hook(lost)
            return
        signal.signal(error.signal_number, stop)
        again = threading.Timer(_AGAIN_S, signal.raise_signal, (error.signal_number,))
        again.daemon = True
        again.start()

    hook = sys.unraisablehook
    before = {one: signal.getsignal(one) for one in _STOPS}
    sys.unraisablehook = unraisable
    for one, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(one, stop)
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for one, handler in before.items():
            signal.signal(one, handler)


def stopped_text(error: BaseException) -> str:
    """Return what is kept when a command was stopped, and how to go on."""
    number = error.signal_number if isinstance(error, Stopped) else signal.SIGINT
    kept = getattr(error, "__notes__", None) or [
        "nothing half-written is left, older results are as they were; run the command again"
    ]
    return f"stopped by {signal.Signals(number).name}: {'; '.join(dict.fromkeys(kept))}"


def guarded(run: Callable[[], int | None]) -> int:
    """Run a command and return its exit code, 0 for none; errors of input go to stderr.

    When a signal stops it, stderr gets what is kept, and the code is 128 and the signal's number.
    """
    _open_closed_outputs()
    try:
        with quiet_callbacks(), stop_signals():
            return run() or 0
    except Stopped as error:
        print_message(stopped_text(error))
        return 128 + error.signal_number
    except MapfilterError as error:
        print_message(str(error), "error: ")
    except MemoryError:
        hint = "too large an area, too fine a resolution, or a value in the wrong unit"
        print_message(f"memory: expected enough of it, found none left (likely: {hint})", "error: ")
    except OSError as error:
        if error.errno not in _NO_SPACE:
            raise
        where = error.filename or "the output"
        print_message(f"{where}: expected space on the disk, found none left", "error: ")
    return WRONG


def _open_closed_outputs() -> None:
    """Let what goes to an output that the caller closed go nowhere.

    Without it a file that is opened later would take the output's number, and get the text.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            mode = "r" if name == "stdin" else "w"
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def to_jsonable(value: Any) -> Any:
    """Convert a result to JSON types: paths become text; NaN and infinity become None.

    Examples
    --------
    >>> to_jsonable({"error_m": float("nan"), "outputs": (Path("a.png"),)})
    {'error_m': None, 'outputs': ['a.png']}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_jsonable(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_jsonable(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def text_lines(found: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    r"""Yield one line for each figure, nested ones indented; none for what is empty.

    Rows of the same figures are a table, where it is not too wide. Of many counts the largest are
    shown, and what the others add up to.

    Examples
    --------
    >>> found = {"bounds_m": [385412.52], "lon_deg": 24.9412341, "seconds": {"build": 1.23456}}
    >>> print(*text_lines(found), sep="\n")
    bounds_m:
      385412.5
    lon_deg: 24.941234
    seconds:
      build: 1.235
    >>> rows = [{"name": "levels-6", "runs": 20}, {"name": "cell-20", "runs": 5}]
    >>> print(*text_lines({"cases": rows}), sep="\n")
    cases:
      name      runs
      levels-6    20
      cell-20      5
    >>> counts = {f"cell-{i}": i for i in range(1, 20)}
    >>> print(*list(text_lines({"unknown_cells": counts}))[-2:], sep="\n")
      cell-8: 8
      7 more: 28
    """
    for key, value in found.items():
        if isinstance(value, Mapping | list) and not value:
            continue
        if isinstance(value, Mapping):
            yield f"{indent}{key}:"
            yield from text_lines(_largest(value), indent + "  ")
        elif isinstance(value, list):
            yield f"{indent}{key}:"
            for line in _table(value) or (_one_line(item, key) for item in value):
                yield f"{indent}  {line}"
        else:
            yield f"{indent}{key}: {_short(value, key)}"


def _largest(found: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the largest of many counts, and the sum of the others; anything else as it is."""
    if len(found) <= _MOST_COUNTS or not all(type(value) is int for value in found.values()):
        return found
    rows = sorted(found.items(), key=lambda one: -one[1])
    rest = rows[_MOST_COUNTS:]
    return {**dict(rows[:_MOST_COUNTS]), f"{len(rest)} more": sum(count for _, count in rest)}


def _table(rows: list[Any]) -> list[str]:
    """Return the lines of a table, numbers to the right; none if the rows differ in keys."""
    if len(rows) < 2 or not all(
        isinstance(row, Mapping) and row.keys() == rows[0].keys() for row in rows
    ):
        return []
    names = [name for name in rows[0] if any(row[name] not in (None, "") for row in rows)]
    lines = [names, *([_short(row[name], name) for name in names] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    if sum(widths) + 2 * len(widths) > _MAX_TABLE_WIDTH:
        return []
    texts = [any(isinstance(row[name], str) for row in rows) for name in names]
    return [
        "  ".join(
            cell.ljust(width) if text else cell.rjust(width)
            for cell, width, text in zip(line, widths, texts, strict=True)
        ).rstrip()
        for line in lines
    ]


def _one_line(item: Any, name: str) -> str:
    if isinstance(item, Mapping):
        return ", ".join(f"{key} {_short(value, key)}" for key, value in item.items())
    return _short(item, name)


def _short(value: Any, name: str) -> str:
    """Format a figure: four digits, large ones and degrees to decimetres."""
    if value is None:
        return "-"
    if isinstance(value, float):
        if name.endswith(("lon_deg", "lat_deg")):
            return f"{value:.6f}"
        return f"{value:.1f}" if abs(value) >= 1000 else f"{value:.4g}"
    return str(value)


Stage = Callable[["Config"], Any]


def run_pipeline(stages: Mapping[str, Stage], file: Path, argv: Sequence[str] | None = None) -> int:
    """Run all stages, print their results, and return the exit code: 0, 2, or 3 for partly done.

    Parameters
    ----------
    stages : mapping of str to callable
        Public functions of the workflows, by the name that is printed.
    file : Path
        The pipeline's TOML; ``-c`` names another.
    argv : sequence of str, optional
        Arguments: ``-c FILE``, ``--set section.key=value``, ``--out DIR``, ``--json``; those of
        the process when left out.
    """
    parser = argparse.ArgumentParser(description=f"Stages: {', '.join(stages)}.")
    parser.add_argument("-c", "--config", metavar="FILE", type=Path, default=file)
    parser.add_argument("--set", metavar="SECTION.KEY=VALUE", action="append", default=[])
    parser.add_argument("--out", metavar="DIR", type=Path)
    parser.add_argument("--json", action="store_true", help="one JSON object, last on stdout")
    given = parser.parse_args(argv)
    return guarded(lambda: _run(stages, given))


def _run(stages: Mapping[str, Stage], given: argparse.Namespace) -> int:
    found: dict[str, Any] = {}
    from mapfilter.config.load import load_config

    config = load_config(given.config, given.set, out=given.out)
    for name, stage in stages.items():
        began_s = time.perf_counter()
        found[name] = to_jsonable(stage(config))
        found[name]["seconds"] = round(time.perf_counter() - began_s, 3)
        if not given.json:
            print_result({name: found[name]}, as_json=False)
    if given.json:
        print_result(found, as_json=True)
    return 3 if any(stage.get("partial") for stage in found.values()) else 0
