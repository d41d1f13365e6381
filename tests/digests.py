"""Digests of the results of fixed small cases, to show that a refactoring has not changed them.

``python -m tests.digests --out before.json`` at one commit, and ``python -m tests.digests --compare
before.json`` at another, on the same machine: across machines the last bits differ. Results come
from the commands, whose names and files stay; the inputs from :mod:`digest_inputs`.
"""

import argparse
import contextlib
import hashlib
import io
import json
import re
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyarrow.parquet as pq

ROOT = Path(__file__).resolve().parents[1]
OWN_FILTER = "my_filter_of_the_digests"
TIMES = (
    *("seconds", "seconds_per_track", "seconds_per_track_low", "seconds_per_track_high"),
    *("out", "outputs"),
)
"""Figures that differ from run to run, and paths."""

BARE = "bayes --without gnss,ta"
REPLAYS: Mapping[str, tuple[str, ...]] = {
    "candidate": ("candidate",),
    "bayes": ("bayes",),
    BARE: ("bayes", "--without", "gnss,ta"),
    "bayes --smooth": ("bayes", "--without", "gnss", "--smooth"),
    "bayes, cells only": ("bayes", "--without", "gnss", "--set", "filter.bayes.levels=false"),
    "grid": ("grid",),
    "ekf": ("ekf",),
    "iekf": ("iekf",),
    "rbukf": ("rbukf",),
    "ukf": ("ukf",),
    "ckf": ("ckf",),
    "ekf --smooth": ("ekf", "--smooth"),
    "own": (f"{OWN_FILTER}:MyFilter",),
}
CASES = ("levels-6", "cell-6", "levels-bias10", "satellites-4")
SWEEPS = {
    "as predicted": (),
    "prediction error": ("--set", "sweep.prediction_error_db=7"),
}


def digest(values: Any) -> str:
    """Return the SHA-256 of an array's kind, shape and bytes, or of other values as JSON.

    All NaN count as one.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        text = json.dumps(values, sort_keys=True, default=_plain)
        return hashlib.sha256(text.encode()).hexdigest()
    if array.dtype.kind == "f":
        array = np.where(np.isnan(array), np.array(np.nan, array.dtype), array)
    head = f"{array.dtype.str} {array.shape} "
    return hashlib.sha256(head.encode() + np.ascontiguousarray(array).tobytes()).hexdigest()


def _plain(value: Any) -> Any:
    return value.hex() if isinstance(value, bytes) else str(value)


def table_digests(path: Path) -> dict[str, str]:
    """Return a digest for each column of a Parquet file: of its values, not of the file's bytes."""
    with pq.ParquetFile(path) as source:
        table = source.read()
    found = {}
    for name in table.column_names:
        values = table[name].to_pylist()
        numbers = all(isinstance(one, int | float) and one is not None for one in values)
        found[name] = digest(table[name].to_numpy() if numbers and values else values)
    return found


def without_times(figures: Any) -> Any:
    """Return figures without wall times and paths."""
    match figures:
        case Mapping():
            kept = {name: one for name, one in figures.items() if name not in TIMES}
            return {name: without_times(one) for name, one in kept.items()}
        case list():
            return [without_times(one) for one in figures]
    return figures


def run(*arguments: object) -> Any:
    """Run a command in this process; return the JSON object that it prints."""
    from mapfilter.cli import main

    out, err, code = io.StringIO(), io.StringIO(), 0
    argv = ["mapfilter", *map(str, arguments), "--json"]
    with (
        patch.object(sys, "argv", argv),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
    # 3: a filter that did not converge; its result counts.
    if code not in (0, 3):
        raise RuntimeError(f"{' '.join(argv)}: exit code {code}\n{err.getvalue()}")
    return json.loads(out.getvalue().splitlines()[-1])


def build_digests(folder: Path) -> dict[str, Any]:
    """Build the database; return the digests of its points, levels and cells."""
    run("build", "-c", folder / "world.toml")
    database = folder / "out" / "database"
    found: dict[str, Any] = {}
    for path in sorted(database.rglob("*.parquet")):
        found[path.relative_to(database).as_posix()] = table_digests(path)
    manifest = json.loads((database / "manifest.json").read_text(encoding="utf-8"))
    return found | {"counts": digest(manifest["counts"])}


def replay_digests(folder: Path, arguments: Sequence[str]) -> dict[str, Any]:
    """Replay the log; return the digests of the estimate's columns and of what was not used."""
    out = folder / "replay"
    name, *more = arguments
    log = ("--log", folder / "walk", "--out", out, "--filter", name)
    run("replay", "-c", folder / "world.toml", *log, *more)
    path = out / "estimate.parquet"
    with pq.ParquetFile(path) as source:
        meta = json.loads(source.schema_arrow.metadata[b"mapfilter"])
    return table_digests(path) | {"unused": digest(meta["unused"])}


def sweep_digests(folder: Path, name: str) -> dict[str, Any]:
    """Run a small sweep; return the digests of the columns of its table."""
    out = folder / f"sweep {name}"
    given = ("--set", f"rasters.path={json.dumps(str(folder / 'rxlev.tif'))}")
    found = run("sweep", "-c", folder / "world.toml", "--out", out, *given, *SWEEPS[name])
    return table_digests(Path(found["table"]))


def benchmark_digests(folder: Path, world: Sequence[str]) -> dict[str, Any]:
    """Run cases of the benchmark on a made city; return the digests of each case's figures."""
    cases = [part for name in CASES for part in ("--case", name)]
    given = ("--runs", 5, "--workers", 1, "--out", folder / "benchmark", *cases, *world)
    found = run("evaluate", "global-positioning", "-c", folder / "made.toml", *given)
    rows = {
        one["name"]: {k: digest(v) for k, v in without_times(one).items()} for one in found["cases"]
    }
    return rows | {"points": digest(found["points"])}


def paper_digests(folder: Path, paper: str) -> dict[str, Any]:
    """Run a paper of Kalman-type filters (and Gaussian sums); return the digests of its figures."""
    found = run("reproduce", paper, "--trials", 2, "--out", folder / paper)
    return {name: digest(one) for name, one in without_times(found).items()}


def all_digests(folder: Path, world: Sequence[str] = ()) -> dict[str, Any]:
    """Return the digests of all cases, or how one failed; how long each takes goes to stderr."""
    sys.path.insert(0, str(folder))
    page = (ROOT / "docs" / "howto" / "own-filter.rst").read_text(encoding="utf-8")
    text = re.search(r"code-block:: python\n\n((?:   .*\n|\n)+)", page)
    assert text is not None
    (folder / f"{OWN_FILTER}.py").write_text(textwrap.dedent(text[1]), encoding="utf-8")
    inputs = sorted(path for path in folder.rglob("*") if path.suffix in (".csv", ".osm", ".toml"))
    found: dict[str, Any] = {
        "inputs": {
            path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in inputs
        }
    }
    tasks: dict[str, Any] = {"build": lambda: build_digests(folder)}
    for name, arguments in REPLAYS.items():
        tasks[f"replay {name}"] = lambda arguments=arguments: replay_digests(folder, arguments)
    for name in SWEEPS:
        tasks[f"sweep {name}"] = lambda name=name: sweep_digests(folder, name)
    for paper in ("zhang-2006", "fritsche-klein-2009"):
        tasks[f"reproduce {paper}"] = lambda paper=paper: paper_digests(folder, paper)
    tasks["evaluate"] = lambda: benchmark_digests(folder, world)
    for name, task in tasks.items():
        began_s = time.perf_counter()
        try:
            found[name] = task()
        except Exception as error:
            # One case that a commit refuses says nothing of the others.
            found[name] = {"failed": f"{type(error).__name__}: {error}"}
            sys.stderr.write(f"{name}: {error}\n")
        sys.stderr.write(f"{name}: {time.perf_counter() - began_s:.1f} s\n")
    return found


def differences(before: Any, after: Any, where: str = "") -> Iterable[str]:
    """Yield a line for each digest that differs or is on one side only."""
    if isinstance(before, Mapping) and isinstance(after, Mapping):
        for name in sorted({*before, *after}):
            place = f"{where} / {name}" if where else name
            if name not in before or name not in after:
                yield f"{place}: only {'before' if name in before else 'after'}"
            else:
                yield from differences(before[name], after[name], place)
    elif before != after:
        yield f"{where}: differs"


def main() -> int:
    """Print the digests as one JSON object; 1 where they are not those to compare with."""
    # Run as tests.digests, this folder is not where Python looks; under pytest it is.
    sys.path.insert(0, str(Path(__file__).parent))
    from digest_inputs import write_inputs

    parser = argparse.ArgumentParser(prog="python -m tests.digests", description=__doc__)
    parser.add_argument("--out", type=Path, metavar="FILE", help="also write them to a file")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="digests of another commit")
    parser.add_argument("--world", metavar="NAME", help="of evaluate global-positioning, if any")
    given = parser.parse_args()
    world = () if given.world is None else ("--world", given.world)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_inputs(folder)
        found = all_digests(folder, world)
    text = json.dumps(found, indent=1, sort_keys=True)
    sys.stdout.write(text + "\n")
    if given.out is not None:
        given.out.write_text(text + "\n", encoding="utf-8")
    if given.compare is None:
        return 0
    lines = list(differences(json.loads(given.compare.read_text(encoding="utf-8")), found))
    for line in lines:
        sys.stderr.write(f"{line}\n")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
