"""Plant small bugs one by one and see whether the tests of their room notice them.

    python -m tests.mutation --sample 40 --seed 1            every room
    python -m tests.mutation --room models --room filters    some rooms
    python -m tests.mutation --room models --list            what would be planted
    python -m tests.mutation --room models --near 5          by the five nearest files of tests
    python -m tests.mutation --room models --file way_spread.py --all      those of some files alone

Verdicts go to ``out/mutants/verdicts.jsonl``; what was judged already is not judged again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from . import record
from .judge import Task, judged, known, plan
from .rooms import ROOMS

ROOT = Path(__file__).resolve().parents[2]
EQUIVALENT = Path(__file__).with_name("equivalent.toml")


def parsed(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser("tests.mutation", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--room", action="append", choices=ROOMS, help="a room; all by default")
    parser.add_argument(
        "--file",
        action="append",
        default=[],
        metavar="PATTERN",
        help="only files whose path ends so, as bayes/timing.py or 'bayes/*.py'; all by default",
    )
    parser.add_argument("--sample", type=int, default=40, help="mutants of each room (40)")
    parser.add_argument("--seed", type=int, default=1, help="which ones (1)")
    parser.add_argument("--all", action="store_true", help="all mutants of each room")
    parser.add_argument("--list", action="store_true", help="list them and end")
    parser.add_argument("--anew", action="store_true", help="judge again what was judged already")
    parser.add_argument("--near", type=int, help="only so many files of tests, the nearest ones")
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time (1)")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutants", help="folder")
    options = parser.parse_args(arguments)
    # Tests run in the copy, from where a relative path leads elsewhere.
    options.out = options.out.resolve()
    return options


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 3 when mutants survived."""
    options = parsed(arguments)
    rooms, count = options.room or list(ROOMS), None if options.all else options.sample
    entries = record.reviewed(EQUIVALENT)
    tasks = [
        task
        for room in rooms
        for task in plan(
            ROOT, room, count, options.seed, entries, near=options.near, files=options.file
        )
    ]
    if options.list:
        for task in tasks:
            print(f"{task.room:<12}{task.mutant.id}  {task.mutant.change}")  # noqa: T201
            if options.near is not None:
                print(" " * 12 + " ".join(test.name for test in task.tests))  # noqa: T201
        return 0
    path = options.out / "verdicts.jsonl"
    verdicts = {} if options.anew else known(ROOT, tasks, record.read(path))
    try:
        for verdict in judged(ROOT, options.out, tasks, verdicts, options.jobs):
            record.append(path, verdict)
            verdicts[verdict.room, verdict.stable] = verdict
            said = f"{verdict.status:<10}{verdict.seconds:6.1f} s  {verdict.id}  {verdict.change}"
            print(said, file=sys.stderr, flush=True)  # noqa: T201
    except KeyboardInterrupt:
        print("interrupted; verdicts so far are kept", file=sys.stderr)  # noqa: T201
    return report(rooms, tasks, verdicts)


def report(
    rooms: Sequence[str], tasks: Sequence[Task], verdicts: dict[tuple[str, str], record.Verdict]
) -> int:
    """Print what survived, what nobody can notice, and the table; return the exit status."""
    statuses: dict[str, list[str]] = {room: [] for room in rooms}
    survivors = 0
    for task in tasks:
        verdict = verdicts.get((task.room, task.mutant.stable))
        mutant = task.mutant
        if task.equivalent:
            statuses[task.room].append(record.EQUIVALENT)
            print(f"equivalent  {mutant.file}:{mutant.line}  {mutant.change}")  # noqa: T201
            print(f"            {task.equivalent}")  # noqa: T201
        elif verdict is not None:
            statuses[task.room].append(verdict.status)
            if verdict.status == record.SURVIVED:
                survivors += 1
                print(f"survived    {mutant.file}:{mutant.line}  {mutant.change}")  # noqa: T201
                print(f"            {mutant.source}")  # noqa: T201
    print(record.HEAD)  # noqa: T201
    for room in rooms:
        print(record.Score.of(room, statuses[room]).row())  # noqa: T201
    return 3 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
