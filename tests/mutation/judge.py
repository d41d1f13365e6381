"""Which mutants are tried, what is known of them, and the judging of the others."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from .baseline import NO_TESTS, Baseline
from .operators import Mutant, applied, mutants
from .record import KILLED, SURVIVED, TIMEOUT, Reviewed, Verdict, reason
from .rooms import ROOMS, Imports, Room, checksum
from .server import Outcome
from .workshop import Workshop, is_inlined

_PATIENCE = 4.0
_PATIENCE_S, _COMPILING_S = 10.0, 35.0
"""A test may take this many times as long as its whole file does, and this much longer; still
longer where kernels of the mutant are compiled in it."""
_INDIRECT = 4
"""A test that does not import the file itself is as likely to notice as one that takes so many
times as long."""

Key = tuple[str, str]
Rooms = Mapping[str, Room]


@dataclass(frozen=True)
class Task:
    """A mutant of a room, the files of tests that judge it, and why nobody can notice it, if so."""

    room: str
    mutant: Mutant
    tests: tuple[Path, ...]
    equivalent: str | None = None


def plan(
    root: Path,
    room: str,
    count: int | None,
    seed: int,
    entries: Sequence[Reviewed] = (),
    rooms: Rooms = ROOMS,
    near: int | None = None,
    package: str = "mapfilter",
    files: Sequence[str] = (),
) -> list[Task]:
    """Return a random sample of a room's mutants, or all of them.

    The order is that of a checksum of seed and mutant: a larger sample begins with a smaller one,
    and a change of one line leaves the mutants of others where they were. With ``near`` only so
    many files of tests judge a mutant, those nearest to its file (:meth:`.rooms.Imports.nearest`).
    With ``files`` the sample is drawn from the room's files whose path ends with one of these
    patterns (:meth:`pathlib.PurePath.match`).
    """
    imports, tests = Imports(root, package), tuple(rooms[room].test_files(root))
    nearest: dict[str, tuple[Path, ...]] = {}
    texts = {
        file: (root / file).read_text()
        for file in rooms[room].sources(root)
        if not files or any(file.match(pattern) for pattern in files)
    }
    found = [m for file, text in texts.items() for m in mutants(text, file.as_posix())]
    found.sort(key=lambda m: hashlib.sha256(f"{seed}:{m.stable}".encode()).digest())
    chosen: list[Task] = []
    for mutant in found:
        if len(chosen) == (len(found) if count is None else count):
            break
        if not _is_sound(applied(texts[Path(mutant.file)], mutant)):
            continue
        if near is not None and mutant.file not in nearest:
            nearest[mutant.file] = tuple(imports.nearest(Path(mutant.file), tests, near))
        chosen.append(Task(room, mutant, nearest.get(mutant.file, tests), reason(mutant, entries)))
    return chosen


def _is_sound(text: str) -> bool:
    try:
        compile(text, "mutant", "exec")
    except (SyntaxError, ValueError):
        return False
    return True


def known(root: Path, tasks: Iterable[Task], verdicts: Iterable[Verdict]) -> dict[Key, Verdict]:
    """Return the verdicts that still hold: neither the file nor the tests have changed."""
    wanted = {(task.room, task.mutant.stable): task for task in tasks}
    sums: dict[tuple[Path, ...], str] = {}
    holding = {}
    for verdict in verdicts:
        key = (verdict.room, verdict.stable)
        if key not in wanted:
            continue
        tests = wanted[key].tests
        if tests not in sums:
            sums[tests] = checksum(root, tests)
        file = Path(wanted[key].mutant.file)
        noticed = Path(verdict.test.partition("::")[0])
        same_test = noticed in tests and checksum(root, [noticed]) == verdict.test_sha
        same_tests = verdict.tests_sha == sums[tests]
        if checksum(root, [file]) == verdict.file_sha and (same_tests or same_test):
            holding[key] = verdict
    return holding


def judged(
    root: Path,
    out: Path,
    tasks: Sequence[Task],
    verdicts: Mapping[Key, Verdict],
    jobs: int = 1,
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
        _Worker(root, out / f"worker-{n}", package, list(verdicts.values()))
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

    def __init__(self, root: Path, folder: Path, package: str, past: list[Verdict]) -> None:
        self._root, self._folder, self._package = root, folder, package
        self._kills = Counter((_file(v), _killer(v)) for v in past if v.status == KILLED)

    def verdicts(self, tasks: Sequence[Task]) -> Iterator[Verdict]:
        """Yield a verdict for each task."""
        with Workshop(self._root, self._folder, self._package) as workshop:
            baseline = Baseline(workshop, self._folder / "baseline.json", self._package)
            for task in sorted(tasks, key=lambda task: task.room):
                yield self._verdict(workshop, task, baseline.seconds(task.tests))

    def _verdict(self, workshop: Workshop, task: Task, seconds: Mapping[str, float]) -> Verdict:
        mutant, tests = task.mutant, task.tests
        ordered = self._ordered(workshop.imports, mutant, tests, seconds)
        text = (workshop.copy / mutant.file).read_text()
        more_s = _PATIENCE_S + (_COMPILING_S if is_inlined(text, mutant) else 0.0)
        limits = {file: _PATIENCE * s + more_s for file, s in seconds.items()}
        # Examples in docstrings take next to no time.
        limits[mutant.file] = more_s
        whole = _PATIENCE * sum(seconds.values()) + 4 * more_s
        request = workshop.request(ordered, limits_s=limits, limit_s=whole)
        # Without a file pytest would run all of the repository.
        unseen = Outcome(NO_TESTS, "", 0.0, {})
        outcome = workshop.judge(mutant, request) if ordered else unseen
        noticed = Path(outcome.test.partition("::")[0])
        verdict = Verdict(
            mutant.id,
            mutant.stable,
            task.room,
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
    return SURVIVED if outcome.code in (0, NO_TESTS) else KILLED
