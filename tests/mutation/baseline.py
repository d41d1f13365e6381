"""How long each file of tests takes without a mutant."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from .rooms import checksum
from .workshop import Workshop

NO_TESTS = 5
"""Exit status of pytest where a file has no tests."""


class Baseline:
    """Times of files of tests on the sources as they are, kept from run to run.

    Parameters
    ----------
    workshop : Workshop
    note : Path
        Where times are kept, each with a checksum of its file.
    package : str
        All times are dropped when any of its files has changed.
    """

    def __init__(self, workshop: Workshop, note: Path, package: str) -> None:
        self._workshop, self._note = workshop, note
        root = workshop.copy
        sources = [file.relative_to(root) for file in root.glob(f"{package}/**/*.py")]
        self._of = checksum(root, sources)
        kept = json.loads(note.read_text()) if note.exists() else {}
        self._files: dict[str, tuple[str, float]] = {}
        if kept.get("of") == self._of:
            self._files = {name: (of, seconds) for name, (of, seconds) in kept["files"].items()}

    def seconds(self, tests: Sequence[Path]) -> dict[str, float]:
        """Return the time of each file; one that is not known is run, and its kernels are kept.

        Raises
        ------
        RuntimeError
            The tests fail without any mutant.
        """
        return {test.as_posix(): self._second(test) for test in tests}

    def _second(self, test: Path) -> float:
        name, of = test.as_posix(), checksum(self._workshop.copy, [test])
        if self._files.get(name, ("", 0.0))[0] != of:
            outcome = self._workshop.warm(self._workshop.request([test], keep_bytecode=True))
            if outcome.code not in (0, NO_TESTS):
                said = self._workshop.said()
                raise RuntimeError(f"{name}: the tests fail without any mutant\n{said}")
            self._files[name] = of, outcome.files_s.get(name, 0.0)
            self._note.write_text(json.dumps({"of": self._of, "files": self._files}))
        return self._files[name][1]
