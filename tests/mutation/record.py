"""Verdicts on disk, the list of mutants that change nothing, and the score of a room."""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from math import sqrt
from pathlib import Path

from .operators import Mutant

KILLED, SURVIVED, TIMEOUT, EQUIVALENT = "killed", "survived", "timed out", "equivalent"
_Z = 1.959964
"""Of a normal variable, two-sided 95 %."""


@dataclass(frozen=True)
class Verdict:
    """What became of one mutant.

    Parameters
    ----------
    id, stable, room, change : str
    status : {"killed", "survived", "timed out"}
    test : str
        The test that noticed it.
    seconds : float
    file_sha, tests_sha, test_sha : str
        Checksums of the mutated file, of the room's tests, and of the file of that test. A mutant
        is judged anew when the file is another; a survivor also when any test is, one that was
        noticed only when the test that did is.
    """

    id: str
    stable: str
    room: str
    change: str
    status: str
    test: str
    seconds: float
    file_sha: str
    tests_sha: str
    test_sha: str


def read(path: Path) -> list[Verdict]:
    """Return the verdicts of a file, the last one of each mutant; a line cut short is left out."""
    found: dict[tuple[str, str], Verdict] = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            verdict = Verdict(**json.loads(line))
        except (json.JSONDecodeError, TypeError):
            continue
        found[verdict.room, verdict.stable] = verdict
    return list(found.values())


def append(path: Path, verdict: Verdict) -> None:
    """Add a verdict to a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        file.write(json.dumps(asdict(verdict)) + "\n")


@dataclass(frozen=True)
class Reviewed:
    """A mutant that somebody looked at and that no test can notice.

    Parameters
    ----------
    file, line, change : str
        Its file, its line without the blanks around it, and its change as it is listed.
    reason : str
    """

    file: str
    line: str
    change: str
    reason: str


def reviewed(path: Path) -> list[Reviewed]:
    """Read the file of mutants that change nothing.

    Raises
    ------
    ValueError
        One has no reason.
    """
    found = [Reviewed(**entry) for entry in tomllib.loads(path.read_text()).get("mutant", [])]
    bare = [entry for entry in found if not entry.reason.strip()]
    if bare:
        raise ValueError(f"{path}: a reason for each, none for {bare[0].file}: {bare[0].line}")
    return found


def reason(mutant: Mutant, entries: Iterable[Reviewed]) -> str | None:
    """Return why a mutant changes nothing, or None when nobody said so."""
    for entry in entries:
        if (entry.file, entry.line, entry.change) == (mutant.file, mutant.source, mutant.change):
            return entry.reason
    return None


def unmatched(mutants: Iterable[Mutant], entries: Iterable[Reviewed]) -> list[Reviewed]:
    """Return the entries that no mutant answers to any more."""
    there = {(mutant.file, mutant.source, mutant.change) for mutant in mutants}
    return [entry for entry in entries if (entry.file, entry.line, entry.change) not in there]


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927); (0, 1) without trials."""
    if trials == 0:
        return 0.0, 1.0
    share = successes / trials
    centre = share + _Z**2 / (2 * trials)
    half = _Z * sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    scale = 1 + _Z**2 / trials
    return max(0.0, (centre - half) / scale), min(1.0, (centre + half) / scale)


@dataclass(frozen=True)
class Score:
    """How many mutants of a room were judged, and how many of them noticed."""

    room: str
    sampled: int
    killed: int
    survived: int
    timed_out: int
    equivalent: int

    @classmethod
    def of(cls, room: str, statuses: Sequence[str]) -> Score:
        """Count the statuses of a room's mutants."""
        count = Counter(statuses)
        return cls(
            room, len(statuses), *(count[s] for s in (KILLED, SURVIVED, TIMEOUT, EQUIVALENT))
        )

    @property
    def judged(self) -> int:
        """Those that can be noticed."""
        return self.killed + self.survived + self.timed_out

    def row(self) -> str:
        """Return a line of the table."""
        noticed = self.killed + self.timed_out
        counts = f"{self.sampled:8d}{self.equivalent:12d}{self.killed:8d}{self.timed_out:11d}"
        if not self.judged:
            return f"{self.room:<14}{counts}{self.survived:10d}       –"
        low, high = wilson(noticed, self.judged)
        share = f"{100 * noticed / self.judged:6.0f} %  {100 * low:.0f}–{100 * high:.0f} %"
        return f"{self.room:<14}{counts}{self.survived:10d}{share}"


HEAD = (
    f"{'room':<14}{'mutants':>8}{'equivalent':>12}{'killed':>8}{'timed out':>11}"
    f"{'survived':>10}   score  95 % interval"
)
