"""What commands and pipelines show: results on stdout, everything else on stderr."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import errno
import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapfilter.errors import MapfilterError

if TYPE_CHECKING:
    from mapfilter._parallel import Progress
    from mapfilter.config.sections import Config


def say(text: str, kind: str = "") -> None:
    """Write lines to stderr, each with the program's name and ``kind`` before it."""
    for line in text.splitlines():
        sys.stderr.write(f"mapfilter: {kind}{line}\n")


def print_result(result: Any, as_json: bool) -> None:
    """Print a result on stdout: one JSON line, or one line for each figure."""
    from mapfilter.workflows.terminal import text_lines, to_jsonable

    found = to_jsonable(result)
    if as_json:
        sys.stdout.write(json.dumps(found, ensure_ascii=False, allow_nan=False) + "\n")
        return
    for line in text_lines(found):
        sys.stdout.write(line + "\n")


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


def rate_text(per_s: float, unit: str) -> str:
    """Return a rate by the second, or by the minute where that is clearer.

    Examples
    --------
    >>> rate_text(13.83, "runs"), rate_text(0.045, "sessions")
    ('13.8 runs/s', '2.7 sessions/min')
    """
    return f"{per_s:.1f} {unit}/s" if per_s >= 1 else f"{60 * per_s:.1f} {unit}/min"


@contextlib.contextmanager
def rate_bar(label: str, unit: str, every_s: float = 30.0) -> Iterator[Progress]:
    """Show progress, rate and time left on stderr: a bar, or a line now and then without terminal.

    Parameters
    ----------
    label, unit : str
        What is done, and what is counted.
    every_s : float
        Seconds between two lines.
    """
    began_s = told_s = time.monotonic()
    first = -1

    def rate(done: int) -> float:
        return (done - first) / max(time.monotonic() - began_s, 1e-6)

    def tell(done: int, total: int) -> None:
        nonlocal began_s, first, told_s
        if first < 0:
            began_s, first = time.monotonic(), done
        if time.monotonic() - told_s >= every_s and done > first:
            told_s = time.monotonic()
            left_s = (total - done) / rate(done)
            many = f"{done} of {total} {unit}, {rate_text(rate(done), unit)}, {left_s:.0f} s left"
            say(f"{label}: {many}")

    if not sys.stderr.isatty():
        yield tell
        return
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TextColumn

    columns = (*Bar.get_default_columns(), TextColumn("{task.fields[rate]}"))
    # Steps may lie minutes apart; with rich's usual 30 s there would be no time left.
    with Bar(
        *columns, console=Console(stderr=True), transient=True, speed_estimate_period=86_400.0
    ) as bar:
        task = bar.add_task(label, total=None, rate="")

        def show(done: int, total: int) -> None:
            nonlocal began_s, first
            if first < 0:
                began_s, first = time.monotonic(), done
            told = rate_text(rate(done), unit)
            bar.update(task, completed=done, total=total, rate=told)

        yield show


WRONG = 2
"""Exit code: the input or the command is wrong, or the machine too small for it."""

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def guarded(run: Callable[[], int | None]) -> int:
    """Run a command and return its exit code, 0 for none; errors of input go to stderr."""
    try:
        return run() or 0
    except MapfilterError as error:
        say(str(error), "error: ")
    except MemoryError:
        hint = "too large an area, too fine a resolution, or a value in the wrong unit"
        say(f"memory: expected enough of it, found none left (likely: {hint})", "error: ")
    except OSError as error:
        if error.errno not in _NO_SPACE:
            raise
        where = error.filename or "the output"
        say(f"{where}: expected space on the disk, found none left", "error: ")
    return WRONG


_WIDEST = 200


def to_jsonable(value: Any) -> Any:
    """Turn a result into what JSON knows: paths become text; NaN and infinity become None.

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

    Rows of the same figures are a table, where it is not too wide.

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
    """
    for key, value in found.items():
        if isinstance(value, Mapping | list) and not value:
            continue
        if isinstance(value, Mapping):
            yield f"{indent}{key}:"
            yield from text_lines(value, indent + "  ")
        elif isinstance(value, list) and (table := _table(value)):
            yield f"{indent}{key}:"
            yield from (f"{indent}  {line}" for line in table)
        elif isinstance(value, list):
            yield f"{indent}{key}:"
            for item in value:
                shown = (
                    ", ".join(f"{k} {_short(v, k)}" for k, v in item.items())
                    if isinstance(item, Mapping)
                    else _short(item, key)
                )
                yield f"{indent}  {shown}"
        else:
            yield f"{indent}{key}: {_short(value, key)}"


def _table(rows: list[Any]) -> list[str]:
    """Return the lines of a table, numbers to the right; none where it is not one."""
    if len(rows) < 2 or not all(
        isinstance(row, Mapping) and row.keys() == rows[0].keys() for row in rows
    ):
        return []
    names = [name for name in rows[0] if any(row[name] not in (None, "") for row in rows)]
    lines = [names, *([_short(row[name], name) for name in names] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    if sum(widths) + 2 * len(widths) > _WIDEST:
        return []
    texts = [any(isinstance(row[name], str) for row in rows) for name in names]
    return [
        "  ".join(
            cell.ljust(width) if text else cell.rjust(width)
            for cell, width, text in zip(line, widths, texts, strict=True)
        ).rstrip()
        for line in lines
    ]


def _short(value: Any, name: str) -> str:
    """Return a figure rounded to what one reads: metres to decimetres, degrees to as much."""
    if value is None:
        return "-"
    if isinstance(value, float):
        if name.endswith(("lon_deg", "lat_deg")):
            return f"{value:.6f}"
        return f"{value:.1f}" if abs(value) >= 1000 else f"{value:.4g}"
    return str(value)


Stage = Callable[["Config"], Any]


def run_pipeline(stages: Mapping[str, Stage], file: Path, argv: Sequence[str] | None = None) -> int:
    """Run all stages, print what each found, and return the exit code: 0, 2, or 3 for partly done.

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
