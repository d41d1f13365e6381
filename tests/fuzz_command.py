"""``python -m tests.fuzz``: mutations over all readers, with counts; it goes on where it stopped.

Each batch runs in a process of its own, so that a crash or a hang of a library costs one batch, is
counted and can be repeated: the same reader and batch give the same copies.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from fuzz import fuzz

BATCH = 1000
_MEMORY = Path("/dev/shm")
"""Where it is there, copies are written to it: a file system in memory."""
_LONGEST_BATCH_S = 1200.0
"""Of processor time."""
_WAITING_S = 300.0
"""A child that has used no processor time for so long waits for ever."""
_LOOKING_S = 5.0
"""How often children are looked after that say nothing."""
_SEEDS = 1_000_000
"""Batches of one seed at most: the next seed has other copies."""
_KEYS = ("read", "refused", "longest_s")


class Target(NamedTuple):
    """A file, and what reads it."""

    name: str
    path: Path
    read: Callable[[Path], object]


Targets = Callable[[Path], Iterator[Target]]


def main(targets: Targets, arguments: list[str] | None = None) -> int:
    """Run batches in turn over the readers until each had its share; return 1 for faults."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument(
        "--mutations", type=int, default=1_000_000, help="in all, with earlier ones"
    )
    parser.add_argument("--out", type=Path, default=Path("fuzz.json"), help="counts, by reader")
    parser.add_argument("--only", default="", help="readers whose names contain this")
    parser.add_argument("--batch", type=int, default=BATCH, help="copies of a batch (1000)")
    parser.add_argument("--seed", type=int, default=0, help="which copies (0)")
    parser.add_argument("--workers", type=int, default=1, help="batches at a time (1)")
    given = parser.parse_args(arguments)
    counts: dict[str, Any] = json.loads(given.out.read_text()) if given.out.exists() else {}
    within = _MEMORY if _MEMORY.is_dir() else None
    with tempfile.TemporaryDirectory(prefix="mapfilter-fuzz-", dir=within) as folder:
        # Copies of several batches of a reader would overwrite each other.
        sets = [
            _prepared(targets, Path(folder) / str(number), given.only)
            for number in range(given.workers)
        ]
        made = {"seed": given.seed, "batch": given.batch}
        for name in sets[0]:
            known = counts.setdefault(name, _nothing() | made)
            if any(known.get(key, value) != value for key, value in made.items()):
                parser.error(f"{given.out}: {name} was begun with another --seed or --batch")
        for name, number, found in _found(sets, counts, given):
            _add(counts[name], number, found)
            _keep(given.out, counts)
    return report(counts)


def _prepared(targets: Targets, folder: Path, only: str) -> dict[str, _Prepared]:
    """Write the good files into a folder, and read each once."""
    folder.mkdir()
    every = [one for one in targets(folder) if only in one.name]
    for one in every:
        one.read(one.path)
    return {one.name: _Prepared(one, one.path.read_bytes()) for one in every}


@dataclass(frozen=True)
class _Prepared:
    """A reader's file, and its good contents."""

    target: Target
    sample: bytes


def _found(
    sets: list[dict[str, _Prepared]], counts: dict[str, Any], given: argparse.Namespace
) -> Iterator[tuple[str, int, dict[str, Any]]]:
    """Run the batches that are missing, some at a time, and yield what was found in each."""
    free, running = list(sets), dict[Connection, tuple[_Child, dict[str, _Prepared]]]()
    batches = -(-given.mutations // (given.batch * len(sets[0])))
    for number in range(batches):
        for name in sets[0]:
            if counts[name]["batches"] > number:
                continue
            files = free.pop()
            child = _Child.started(files[name], number, given)
            running[child.answers] = child, files
            while not free:
                yield from _ended(running, free)
        # The number of finished batches is all that is kept of a reader.
        while running:
            yield from _ended(running, free)


def _ended(
    running: dict[Connection, tuple[_Child, dict[str, _Prepared]]],
    free: list[dict[str, _Prepared]],
) -> Iterator[tuple[str, int, dict[str, Any]]]:
    """Wait a while, and yield what the children found that answered or wait for ever."""
    answered = wait(list(running), timeout=_LOOKING_S)
    for answers, (child, files) in list(running.items()):
        if answers in answered or child.is_stuck():
            del running[answers]
            found = child.found()
            free.append(files)
            yield child.prepared.target.name, child.number, found


def report(counts: dict[str, Any]) -> int:
    """Print a line for each reader, and the sum; return 1 where there are faults."""
    faults = 0
    for name, known in sorted(counts.items()):
        faults += len(known["faults"])
        of = f"{known['read']} read, {known['refused']} refused, {known['longest_s']:.3g} s at most"
        say(f"{name:32s} {of}, {len(known['faults'])} faults")
        for fault in known["faults"]:
            # An exception, and the number of the copy.
            said = " ".join(fault["what"].splitlines()[-2:])
            say(f"    batch {fault['batch']}: {said}")
    done = sum(known["read"] + known["refused"] for known in counts.values())
    say(f"{done} mutations over {len(counts)} readers, {faults} faults")
    return int(faults > 0)


def say(line: str) -> None:
    sys.stdout.write(line + "\n")


def _nothing() -> dict[str, Any]:
    return {"batches": 0, "read": 0, "refused": 0, "longest_s": 0.0, "faults": []}


def _add(known: dict[str, Any], number: int, found: dict[str, Any]) -> None:
    known["batches"] = number + 1
    if "fault" in found:
        known["faults"].append({"batch": number, "what": found["fault"]})
        return
    known["read"] += found["read"]
    known["refused"] += found["refused"]
    known["longest_s"] = max(known["longest_s"], found["longest_s"])


def _keep(path: Path, counts: dict[str, Any]) -> None:
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    temporary.write_text(json.dumps(counts, indent=1))
    temporary.replace(path)


@dataclass
class _Child:
    """A process that reads the copies of a batch; its end without an answer is a fault, too."""

    prepared: _Prepared
    number: int
    process: multiprocessing.process.BaseProcess
    answers: Connection
    _used_s: float = 0.0
    _since_s: float = field(default_factory=time.monotonic)

    @classmethod
    def started(cls, prepared: _Prepared, number: int, given: argparse.Namespace) -> _Child:
        fork = multiprocessing.get_context("fork")
        answers, answer = fork.Pipe(duplex=False)
        seed = given.seed * _SEEDS + number
        task = (prepared.target, prepared.sample, seed, given.batch, answer)
        process = fork.Process(target=_batch, args=task)
        process.start()
        answer.close()
        return cls(prepared, number, process, answers)

    def is_stuck(self) -> bool:
        """Return whether it used too much processor time, or none for long."""
        now_s = _used_s(self.process.pid)
        if now_s > self._used_s:
            self._used_s, self._since_s = now_s, time.monotonic()
        return now_s > _LONGEST_BATCH_S or time.monotonic() - self._since_s > _WAITING_S

    def found(self) -> dict[str, Any]:
        """Return the answer, or how the process ended, and restore the good file."""
        found: dict[str, Any] = {}
        if self.answers.poll():
            try:
                found = self.answers.recv()
            except EOFError:
                self.process.join()
                code = self.process.exitcode or 0
                what = signal.Signals(-code).name if code < 0 else f"exit code {code}"
                found = {"fault": f"the process ended: {what}"}
        else:
            used_s = _used_s(self.process.pid)
            found = {"fault": f"no answer after {used_s:.0f} s of processor time"}
            self.process.kill()
        self.process.join()
        self.answers.close()
        self.prepared.target.path.write_bytes(self.prepared.sample)
        return found


def _used_s(pid: int | None) -> float:
    """Return a process's processor time; elsewhere than under Linux, the time of the clock."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return time.monotonic()
    user, system = fields[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def _batch(target: Target, sample: bytes, seed: int, count: int, answer: Connection) -> None:
    folder = target.path.parent
    # In memory, and where it is seen what a reader leaves.
    with tempfile.TemporaryDirectory(dir=folder.parent) as temporary:
        tempfile.tempdir = os.environ["CPL_TMPDIR"] = temporary
        before = set(folder.iterdir())

        def read(data: bytes) -> None:
            target.path.write_bytes(data)
            try:
                target.read(target.path)
            finally:
                left = {*folder.iterdir(), *Path(temporary).iterdir()} - before
                assert not left, f"left behind: {sorted(path.name for path in left)}"

        try:
            tally = fuzz(sample, read, count, seed)
            found = {key: getattr(tally, key) for key in _KEYS}
        except BaseException:
            found = {"fault": traceback.format_exc()[-4000:]}
        answer.send(found)
        answer.close()
