"""Faults at any moment: writers that are killed, readers of what is being replaced.

    python -m tests.faults kill --count 1000
    python -m tests.faults orphans --count 40
    python -m tests.faults replace --count 200

Outcomes are kept in ``--work`` after each fault, and the same command goes on where it was stopped.
Whole old and whole new results are good, and a plain word that something was replaced or is to be
resumed; anything else ends the run with an error.
"""

import argparse
import contextlib
import hashlib
import importlib.util
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    _HERE = Path(__file__).resolve().parent
    sys.path[:0] = [str(_HERE / room) for room in ("", "database", "learning", "workflows")]

import small_world

from mapfilter.database.build import build
from mapfilter.database.merge import merge
from mapfilter.database.store import open_database
from mapfilter.errors import StoreError
from mapfilter.rasters.opening import open_rasters

_BEYOND = 1.5
"""A writer is killed within so many times the time that it takes: it may be the next one."""
PATIENCE_S = 600.0
"""A process at the lowest priority of a busy machine takes a minute to start."""

_TURNS = (*("build", "merge", "sweep") * 3, "learn")

_GRID = (
    "sweep.sigma_orient_deg=[0, 6]",
    "sweep.routes=2",
    "sweep.draws=12",
    'output.pictures="none"',
)
_RESUME = "is not finished: go on with --resume"


def digest_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file in a folder; hidden ones are of writes cut short."""
    files = sorted(
        path
        for path in folder.rglob("*")
        if path.is_file() and not path.relative_to(folder).parts[0].startswith(".")
    )
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }


@dataclass(frozen=True)
class Job:
    """A writer of one of two results into ``out``, and what a look at the result finds."""

    out: Path
    write: Callable[[int], object]
    look: Callable[[], str]

    def whole(self) -> list[str]:
        """Write both results, and return what a look at each finds."""
        found = []
        for variant in (0, 1):
            self.write(variant)
            found.append(self.look())
        return found


def job_of(name: str, work: Path) -> Job:
    """Return a writer by its name, over inputs that :func:`make_inputs` made."""
    out = work / name / "out"
    if name in ("build", "merge"):

        def database() -> str:
            return open_database(out, verify="full").generation

        if name == "merge":
            parts = [open_database(work / "inputs" / part) for part in ("north", "south")]
            return Job(out, lambda v: merge(parts, out, without=parts[0].cell_ids[:v]), database)
        rasters = open_rasters(work / "inputs" / "rxlev.tif")
        given = rasters, small_world.make_plan(), small_world.make_routes(), out
        options = {"tile_px": 8, "resume": True}
        floor_dbm = small_world.FLOOR_DBM
        return Job(out, lambda v: build(*given, floor_dbm=floor_dbm + v, **options), database)
    return _sweeping(work, out) if name == "sweep" else _learning(work, out)


# What these two import takes long, and who only builds or merges needs none of it.
def _sweeping(work: Path, out: Path) -> Job:
    from mapfilter.config.load import load_config
    from mapfilter.experiments.sweep.run import sweep
    from mapfilter.experiments.sweep.table import read_runs
    from mapfilter.workflows.sweeps.plan import sweep_plans, sweep_world

    config = work / "inputs" / "world" / "world.toml"
    plans = [sweep_plans(load_config(config, [*_GRID, f"sweep.seed={v}"])) for v in (0, 1)]
    world = sweep_world(load_config(config, _GRID), plans[0][0][0].radios)
    folders = {key: one.path for key, one in plans[0][1].items()}

    def table() -> str:
        try:
            return hashlib.sha256(read_runs(out / "runs.parquet").to_csv().encode()).hexdigest()
        except StoreError as error:
            return _RESUME if _RESUME in str(error) else str(error)

    return Job(out, lambda v: sweep(plans[v][0], world, folders, out), table)


def _learning(work: Path, out: Path) -> Job:
    from mapfilter.config.load import load_config
    from mapfilter.workflows.learn import run_learn

    settings = [f"database.path={json.dumps(str(work / 'inputs' / 'taught' / 'database'))}"]
    configs = [
        load_config(None, [*settings, f"track.path={json.dumps(str(work / 'inputs' / logs))}"])
        for logs in ("logs-0", "logs-1")
    ]

    def report() -> str:
        changed = open_database(out, verify="full").generation
        return json.dumps({"database": changed, **digest_of(out.with_name("out-report"))})

    return Job(out, lambda v: run_learn(configs[v], out, accept=True, resume=True), report)


def make_inputs(work: Path, *jobs: str) -> None:
    """Make the inputs of some writers, once."""
    inputs = work / "inputs"
    makers = {"build": _rasters, "merge": _parts, "sweep": _world, "learn": _journeys}
    for job in jobs:
        if not (inputs / f"made-{job}").exists():
            inputs.mkdir(parents=True, exist_ok=True)
            makers[job](inputs)
            (inputs / f"made-{job}").touch()


def _rasters(inputs: Path) -> None:
    small_world.make_world(inputs)


def _parts(inputs: Path) -> None:
    for name, ids in (("north", small_world.IDS[:2]), ("south", small_world.IDS[1:])):
        plan = small_world.make_plan()
        chosen = type(plan)(plan.crs, tuple(cell for cell in plan.cells if cell.id in ids))
        levels = [item for item in small_world.levels_of(plan) if item[0] in ids]
        small_world.write_rasters(inputs / f"{name}.tif", small_world.LATTICE, levels, chosen.ids)
        rasters = open_rasters(inputs / f"{name}.tif")
        options = {"floor_dbm": small_world.FLOOR_DBM, "tile_px": 8}
        build(rasters, chosen, small_world.make_routes(), inputs / name, **options)


def _world(inputs: Path) -> None:
    (inputs / "world").mkdir()
    _module("workflows/conftest.py").make_world(inputs / "world")


def _journeys(inputs: Path) -> None:
    import learning_world

    from mapfilter.tracks.store import write_log

    plan = learning_world.plan_of()
    learning_world.database_of(plan, inputs / "taught")
    rng = np.random.default_rng(3)
    true = learning_world.plan_of(sites=((300, 300), (900, 900), (330, 860)))
    for variant in (0, 1):
        for number in range(3 + variant):
            log = learning_world.log_of(true, rng, silent=("S1C",), blocks=16)
            write_log(log, inputs / f"logs-{variant}" / f"j{number}")


def _module(name: str):  # type: ignore[no-untyped-def]
    spec = importlib.util.spec_from_file_location("of_commands", Path(__file__).parent / name)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["of_commands"] = module
    spec.loader.exec_module(module)
    return module


def kill(work: Path, count: int, seed: int = 1) -> Counter[str]:
    """Kill each of the writers in turn at random moments, and look at what it left."""
    turns = _TURNS if count >= len(_TURNS) else ("build", "merge")
    make_inputs(work, *sorted(set(turns)))
    later = ["mapfilter.workflows.learn", "mapfilter.workflows.sweeps.plan"]
    context = _forks(*(later if "sweep" in turns else ()))
    with _outcomes(work, "kill") as outcomes:
        jobs = {name: job_of(name, work) for name in sorted(set(turns))}
        whole, longest_s = {}, {}
        for name, job in jobs.items():
            whole[name] = job.whole()
            began_s = time.monotonic()
            job.write(0)
            longest_s[name] = _BEYOND * (time.monotonic() - began_s)
        for number in range(outcomes.total(), count):
            name = turns[number % len(turns)]
            ready, rng = context.Event(), np.random.default_rng((seed, number))
            writer = context.Process(target=_keep_writing, args=(name, work, number, ready))
            writer.start()
            try:
                assert ready.wait(PATIENCE_S)
                time.sleep(rng.uniform(0, longest_s[name]))
            finally:
                writer.kill()
                writer.join()
            outcomes[f"{name}: {_judged(jobs[name].look(), whole[name], number)}"] += 1
            outcomes.keep()
        for name, job in jobs.items():
            assert job.whole() == whole[name], f"{name}: other results than before the faults"
            left = [path.name for path in job.out.parent.glob(".*")]
            assert not left, f"{name} left {left}"
    return outcomes


def _judged(found: str, whole: list[str], number: int) -> str:
    if found in whole:
        return "whole"
    if found == _RESUME:
        return "told to resume"
    if found.startswith("{"):
        # Files of one report are replaced one after the other, each as a whole.
        both = [json.loads(one) for one in whole]
        if all(value in [one.get(key) for one in both] for key, value in json.loads(found).items()):
            return "each file whole, of two reports"
    raise AssertionError(f"fault {number}: {found}")


def _keep_writing(name: str, work: Path, number: int, ready) -> None:  # type: ignore[no-untyped-def]
    job = job_of(name, work)
    ready.set()
    # Whoever is stopped leaves no writer behind.
    while multiprocessing.parent_process().is_alive():
        number += 1
        job.write(number % 2)


def replace(work: Path, count: int) -> Counter[str]:
    """Replace a database while two readers open it and read all of it."""
    make_inputs(work, "build")
    context = _forks()
    with _outcomes(work, "replace") as outcomes:
        job = job_of("build", work)
        whole = []
        for variant in (0, 1):
            job.write(variant)
            whole.append(_read_all(job.out))
        stop, found = context.Event(), context.SimpleQueue()
        readers = [
            context.Process(target=_keep_reading, args=(job.out, whole, stop, found))
            for _ in range(2)
        ]
        for reader in readers:
            reader.start()
        assert all(found.get() == "ready" for _ in readers)
        for number in range(outcomes["replacements"], count):
            job.write(number % 2)
            outcomes["replacements"] += 1
        stop.set()
        for _ in readers:
            for key, times in found.get().items():
                outcomes[f"reader: {key}"] += times
        for reader in readers:
            reader.join()
        outcomes.keep()
    return outcomes


def _read_all(folder: Path) -> str:
    database = open_database(folder)
    digest = hashlib.sha256(repr(database.floor_dbm).encode())
    time.sleep(0.01)
    field, points = database.field(), database.points()
    arrays = [field.level_dbm, field.way_id, points.point, points.best_level_dbm]
    for cell_id in database.cell_ids:
        arrays += database.cell_points(cell_id)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _keep_reading(folder: Path, whole: list[str], stop, found) -> None:  # type: ignore[no-untyped-def]
    outcomes: Counter[str] = Counter()
    found.put("ready")
    while not stop.is_set() and multiprocessing.parent_process().is_alive():
        try:
            outcomes["whole" if _read_all(folder) in whole else "a mix, silently"] += 1
        except StoreError as error:
            told = "replaced while in use" in str(error)
            outcomes["told that it was replaced" if told else str(error)] += 1
    found.put(dict(outcomes))


def orphans(work: Path, count: int, seed: int = 1) -> Counter[str]:
    """Kill commands with workers at random moments; see who lives, and who holds their pipes."""
    make_inputs(work, "sweep")
    toml = work / "inputs" / "world" / "world.toml"
    made = toml.with_name("out")
    rasters = f"--set=rasters.path={json.dumps(str(made / 'rxlev.tif'))}"
    grid = [f"--set={text}" for text in (*_GRID, "sweep.draws=400")]
    grid += [rasters, f"--set=database.path={json.dumps(str(made / 'database'))}"]
    tiles = [rasters, "--set=database.tile_px=16", '--set=output.pictures="none"']
    commands = {
        "build --workers 2": ["build", *tiles, "--workers", "2"],
        "sweep --workers 2": ["sweep", *grid, "--workers", "2"],
        "build --cluster local:2": ["build", *tiles, "--cluster", "local:2"],
    }
    with _outcomes(work, "orphans") as outcomes:
        for number in range(outcomes.total(), count):
            name = list(commands)[number % len(commands)]
            rng = np.random.default_rng((seed, number))
            out = ["--out", str(work / "killed" / name.split()[0])]
            given = [sys.executable, "-m", "mapfilter", *commands[name], "-c", str(toml), *out]
            seconds = rng.uniform(0.0, 4.0)
            signal_number = [signal.SIGKILL, signal.SIGTERM][number // len(commands) % 2]
            word = signal.Signals(signal_number).name
            outcomes[f"{name}, {word}: {_killed(given, seconds, signal_number)}"] += 1
            outcomes.keep()
    return outcomes


def _killed(command: list[str], seconds: float, number: signal.Signals) -> str:
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, start_new_session=True) as process:
        # The moment counts from the first of the workers.
        until_s = time.monotonic() + PATIENCE_S
        while process.poll() is None and len(_session(process.pid)) < 2:
            assert time.monotonic() < until_s, f"{command}: no worker"
            time.sleep(0.02)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        ended = process.poll()
        assert ended in (None, 0), f"{command}: {process.communicate()}"
        workers = len(_session(process.pid)) - 1
        process.send_signal(number)
        try:
            process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            for pid in _session(process.pid):
                os.kill(pid, signal.SIGKILL)
            raise AssertionError(f"{command}: somebody holds the pipes") from None
    until_s = time.monotonic() + PATIENCE_S
    while _session(process.pid):
        assert time.monotonic() < until_s, f"{command}: {_session(process.pid)} live on"
        time.sleep(0.05)
    if ended == 0:
        return "was done by then"
    return "with other processes, none left" if workers > 0 else "alone at that moment"


def _session(leader: int) -> list[int]:
    """Return the processes of a session that live."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, _, session, *_ = stat.read_text().rpartition(")")[2].split()
            if int(session) == leader and state not in "ZX":
                found.append(int(stat.parent.name))
    return found


class Outcomes(Counter[str]):
    """Counts of outcomes that are kept in a file."""

    file: Path

    def keep(self) -> None:
        """Write the counts."""
        text = json.dumps({**dict(sorted(self.items()))}, indent=1)
        self.file.with_suffix(".new").write_text(text)
        self.file.with_suffix(".new").replace(self.file)


@contextlib.contextmanager
def _outcomes(work: Path, kind: str) -> Iterator[Outcomes]:
    file = work / f"{kind}.json"
    outcomes = Outcomes(json.loads(file.read_text()) if file.exists() else {})
    outcomes.file = file
    yield outcomes


def _forks(*modules: str):  # type: ignore[no-untyped-def]
    context = multiprocessing.get_context("forkserver")
    used = ["mapfilter.database.build", "mapfilter.database.merge", "small_world"]
    context.set_forkserver_preload([*used, *modules])
    return context


def main() -> None:
    """Run one kind of faults."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("kind", choices=["kill", "orphans", "replace"])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--work", type=Path, default=Path("out/faults"))
    given = parser.parse_args()
    work = given.work.absolute()
    work.mkdir(parents=True, exist_ok=True)
    outcomes = {"kill": kill, "orphans": orphans, "replace": replace}[given.kind](work, given.count)
    sys.stdout.write(json.dumps(dict(sorted(outcomes.items())), indent=1) + "\n")


if __name__ == "__main__":
    main()
