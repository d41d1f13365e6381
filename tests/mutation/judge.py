"""Which mutants are tried, what is known of them, and the judging of the others."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

from .operators import Mutant, applied, mutants
from .record import KILLED, SURVIVED, TIMEOUT, Reviewed, Verdict, reason
from .rooms import ROOMS, Imports, Room, checksum
from .server import Outcome
from .workshop import Workshop

_PATIENCE = 4.0
_PATIENCE_S = 45.0
"""A test may take this many times as long as its whole file does, and this much longer: kernels
of the mutant are compiled in it."""
_NO_TESTS = 5
_INDIRECT = 4
"""A test that does not import the file itself is as likely to notice as one that takes so many
times as long."""

Key = tuple[str, str]
Rooms = Mapping[str, Room]


@dataclass(frozen=True)
class Task:
    """A mutant of a room, and why nobody can notice it, if so."""

    room: str
    mutant: Mutant
    equivalent: str | None = None


def plan(
    root: Path,
    room: str,
    count: int | None,
    seed: int,
    entries: Sequence[Reviewed] = (),
    rooms: Rooms = ROOMS,
) -> list[Task]:
    """Return a random sample of a room's mutants, or all of them.

    The order is that of a checksum of seed and mutant: a larger sample begins with a smaller one,
    and a change of one line leaves the mutants of others where they were.
    """
    texts = {file: (root / file).read_text() for file in rooms[room].sources(root)}
    found = [m for file, text in texts.items() for m in mutants(text, file.as_posix())]
    found.sort(key=lambda m: hashlib.sha256(f"{seed}:{m.stable}".encode()).digest())
    chosen: list[Task] = []
    for mutant in found:
        if len(chosen) == (len(found) if count is None else count):
            break
        if _is_sound(applied(texts[Path(mutant.file)], mutant)):
            chosen.append(Task(room, mutant, reason(mutant, entries)))
    return chosen


def _is_sound(text: str) -> bool:
    try:
        compile(text, "mutant", "exec")
    except (SyntaxError, ValueError):
        return False
    return True


def known(
    root: Path, tasks: Iterable[Task], verdicts: Iterable[Verdict], rooms: Rooms = ROOMS
) -> dict[Key, Verdict]:
    """Return the verdicts that still hold: neither the file nor the tests have changed."""
    wanted = {(task.room, task.mutant.stable): task for task in tasks}
    sums: dict[str, str] = {}
    holding = {}
    for verdict in verdicts:
        key = (verdict.room, verdict.stable)
        if key not in wanted:
            continue
        tests = rooms[verdict.room].test_files(root)
        if verdict.room not in sums:
            sums[verdict.room] = checksum(root, tests)
        file = Path(wanted[key].mutant.file)
        noticed = Path(verdict.test.partition("::")[0])
        same_test = noticed in tests and checksum(root, [noticed]) == verdict.test_sha
        same_tests = verdict.tests_sha == sums[verdict.room]
        if checksum(root, [file]) == verdict.file_sha and (same_tests or same_test):
            holding[key] = verdict
    return holding


def judged(
    root: Path,
    out: Path,
    tasks: Sequence[Task],
    verdicts: Mapping[Key, Verdict],
    jobs: int = 1,
    rooms: Rooms = ROOMS,
    package: str = "mapfilter",
) -> Iterator[Verdict]:
    """Judge the mutants that have no verdict and can be noticed, room by room.

    Raises
    ------
    RuntimeError
        The tests of a room fail without any mutant.
    """
    new = [
        task
        for task in tasks
        if not task.equivalent and (task.room, task.mutant.stable) not in verdicts
    ]
    shares = [new[n::jobs] for n in range(min(jobs, len(new)))]
    workers = [
        _Worker(root, out / f"worker-{n}", rooms, package, list(verdicts.values()))
        for n in range(len(shares))
    ]
    if len(shares) == 1:
        yield from workers[0].verdicts(shares[0])
        return
    with ThreadPoolExecutor(jobs) as pool:
        steps = [iter(w.verdicts(share)) for w, share in zip(workers, shares, strict=True)]
        waiting = {pool.submit(next, step, None): step for step in steps}
        while waiting:
            done = next(as_completed(waiting))
            step = waiting.pop(done)
            if (verdict := done.result()) is not None:
                yield verdict
                waiting[pool.submit(next, step, None)] = step


class _Worker:
    """Judges mutants one after the other in a workshop of its own."""

    def __init__(
        self, root: Path, folder: Path, rooms: Rooms, package: str, past: list[Verdict]
    ) -> None:
        self._root, self._folder, self._rooms = root, folder, rooms
        self._package = package
        self._kills = Counter((_file(v), _killer(v)) for v in past if v.status == KILLED)

    def verdicts(self, tasks: Sequence[Task]) -> Iterator[Verdict]:
        """Yield a verdict for each task."""
        with Workshop(self._root, self._folder, self._package) as workshop:
            for room in dict.fromkeys(task.room for task in tasks):
                seconds = self._baseline(workshop, room)
                for task in tasks:
                    if task.room == room:
                        yield self._verdict(workshop, task.mutant, room, seconds)

    def _baseline(self, workshop: Workshop, room: str) -> dict[str, float]:
        """Run the tests without a mutant and return the time that each file takes."""
        root = workshop.copy
        tests = self._rooms[room].test_files(root)
        sources = [file.relative_to(root) for file in root.glob(f"{self._package}/**/*.py")]
        of = checksum(root, [*tests, *sources])
        note = self._folder / f"baseline-{room}.json"
        if note.exists() and (kept := json.loads(note.read_text()))["of"] == of:
            return dict(kept["seconds"])
        outcome = workshop.warm(workshop.request(tests, keep_bytecode=True))
        if outcome.code not in (0, _NO_TESTS):
            said = workshop.said()
            raise RuntimeError(f"{room}: the tests fail without any mutant\n{said}")
        note.write_text(json.dumps({"of": of, **asdict(outcome), "seconds": outcome.files_s}))
        return outcome.files_s

    def _verdict(
        self, workshop: Workshop, mutant: Mutant, room: str, seconds: Mapping[str, float]
    ) -> Verdict:
        tests = self._rooms[room].test_files(workshop.copy)
        ordered = self._ordered(workshop.imports, mutant, tests, seconds)
        limits = {file: _PATIENCE * s + _PATIENCE_S for file, s in seconds.items()}
        whole = _PATIENCE * sum(seconds.values()) + 4 * _PATIENCE_S
        request = workshop.request(ordered, limits_s=limits, limit_s=whole)
        outcome = workshop.judge(mutant, request)
        noticed = Path(outcome.test.partition("::")[0])
        verdict = Verdict(
            mutant.id,
            mutant.stable,
            room,
            mutant.change,
            _status(outcome),
            outcome.test,
            round(outcome.seconds, 2),
            checksum(workshop.copy, [Path(mutant.file)]),
            checksum(workshop.copy, tests),
            checksum(workshop.copy, [noticed]) if noticed in tests else "",
        )
        if verdict.status == KILLED:
            self._kills[mutant.file, noticed.as_posix()] += 1
        return verdict

    def _ordered(
        self, imports: Imports, mutant: Mutant, tests: Sequence[Path], seconds: Mapping[str, float]
    ) -> list[Path]:
        """Put the tests first that are likely to notice, quick ones before slow ones."""

        def rank(test: Path) -> tuple[int, float]:
            name = test.as_posix()
            direct = Path(mutant.file) in imports.direct(test)
            cost = seconds.get(name, 0.0) * (1 if direct else _INDIRECT)
            return -self._kills[mutant.file, name], cost

        ordered = sorted(tests, key=rank)
        # The examples in the docstrings of the file are tests of it, too.
        own = Path(mutant.file)
        return [own, *ordered] if ">>>" in (self._root / own).read_text() else ordered


def _file(verdict: Verdict) -> str:
    return verdict.id.partition(":")[0]


def _killer(verdict: Verdict) -> str:
    return verdict.test.partition("::")[0]


def _status(outcome: Outcome) -> str:
    if outcome.timed_out:
        return TIMEOUT
    return SURVIVED if outcome.code in (0, _NO_TESTS) else KILLED
