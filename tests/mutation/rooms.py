"""Which tests have to notice a bug in which files: those of its own room, without real data."""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path


@dataclass(frozen=True)
class Room:
    """Files and the tests that watch over them, as patterns relative to the repository."""

    files: tuple[str, ...]
    tests: tuple[str, ...]

    def sources(self, root: Path) -> list[Path]:
        """Return the files, relative to the repository."""
        return _matching(root, self.files)

    def test_files(self, root: Path) -> list[Path]:
        """Return the files of tests, relative to the repository."""
        return _matching(root, self.tests)


ROOMS = {
    "filters": Room(("mapfilter/filters/*.py",), ("tests/filters/test_*.py",)),
    # Kernels of the models take the state of the filter that drives them; the tests beside the
    # models call them without one.
    "models": Room(("mapfilter/models/*.py",), ("tests/models/test_*.py",)),
    "positioning": Room(("mapfilter/positioning/**/*.py",), ("tests/positioning/test_*.py",)),
    "tracks": Room(("mapfilter/tracks/**/*.py",), ("tests/tracks/test_*.py",)),
    "database": Room(("mapfilter/database/*.py",), ("tests/database/test_*.py",)),
    "rasters": Room(
        ("mapfilter/rasters/*.py",),
        ("tests/radio/test_radio_raster*.py", "tests/radio/test_radio_grids.py",
         "tests/radio/test_radio_atoll.py"),
    ),
    "evaluation": Room(("mapfilter/evaluation/*.py",), ("tests/evaluation/test_*.py",)),
    "benchmarks": Room(
        ("mapfilter/experiments/benchmarks/*.py",),
        (
            "tests/experiments/test_ottawa*.py", "tests/experiments/test_satellite_cases.py",
            "tests/experiments/test_benchmark*.py", "tests/experiments/test_missing_ways.py",
            "tests/experiments/test_causes.py", "tests/experiments/test_single_reports.py",
            "tests/experiments/test_world_cases.py", "tests/experiments/test_worst_run.py",
        ),
    ),
}  # fmt: skip


def _matching(root: Path, patterns: Iterable[str]) -> list[Path]:
    found = {path for pattern in patterns for path in root.glob(pattern)}
    return sorted(path.relative_to(root) for path in found if path.name != "__init__.py")


def _is_front_door(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id in ("mf", "mapfilter")


def checksum(root: Path, files: Iterable[Path]) -> str:
    """Return a checksum of names and contents of files."""
    whole = hashlib.sha256()
    for file in sorted(files):
        whole.update(f"{file.as_posix()}\0".encode() + (root / file).read_bytes())
    return whole.hexdigest()[:16]


class Imports:
    """Which files of a package and of its tests import which."""

    def __init__(self, root: Path, package: str = "mapfilter") -> None:
        self._root, self._package = root, package
        self._direct: dict[Path, frozenset[Path]] = {}

    def direct(self, file: Path) -> frozenset[Path]:
        """Return the package's files that a file imports itself; each is looked at once."""
        if file not in self._direct:
            self._direct[file] = self._imported(file)
        return self._direct[file]

    def _imported(self, file: Path) -> frozenset[Path]:
        found = set()
        for node in ast.walk(ast.parse((self._root / file).read_bytes())):
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.Attribute) and _is_front_door(node.value):
                names = [self._front_door.get(node.attr, "")]
            else:
                continue
            found |= {self._files[name] for name in names if name in self._files}
        return frozenset(found)

    def importers(self, file: Path) -> frozenset[Path]:
        """Return the package's files that import a file, be it through others."""
        return frozenset(self._steps(file)) - {file}

    def nearest(self, file: Path, tests: Iterable[Path], count: int) -> list[Path]:
        """Return the files of tests that are nearest to a file, the nearest first.

        Nearest are those that import it themselves, then those that name it most often, as a word
        of their name or text; then those that import a file that does, and so on. Among equals
        those that import the fewest files. None reaches it through no import.
        """
        steps = self._steps(file)
        name = re.compile(rf"(?<![a-z]){file.stem.strip('_').replace('_', '[_ ]')}(?![a-z])", re.I)
        ranked = []
        for test in tests:
            imported = self.direct(test)
            if reached := imported & steps.keys():
                far = min(steps[f] for f in reached)
                named = len(name.findall(f"{test.stem} {(self._root / test).read_text()}"))
                ranked.append((far > 0, -named, far, len(imported), test))
        return [test for *_, test in sorted(ranked)[:count]]

    def _steps(self, file: Path) -> dict[Path, int]:
        """Return the files that import a file, and through how many imports; itself by none."""
        steps, front = {file: 0}, {file}
        while front:
            front = {a for a, b in self._graph.items() if b & front} - steps.keys()
            steps |= dict.fromkeys(front, max(steps.values()) + 1)
        return steps

    @cached_property
    def _front_door(self) -> dict[str, str]:
        """Return the modules of the names that the package itself offers."""
        door = self._root / self._package / "__init__.py"
        nodes = ast.walk(ast.parse(door.read_bytes() if door.exists() else b""))
        return {
            alias.name: node.module
            for node in nodes
            if isinstance(node, ast.ImportFrom) and node.module
            for alias in node.names
        }

    @cached_property
    def _files(self) -> dict[str, Path]:
        files = {}
        for path in sorted((self._root / self._package).rglob("*.py")):
            relative = path.relative_to(self._root)
            files[".".join(relative.with_suffix("").parts)] = relative
        return files

    @cached_property
    def _graph(self) -> dict[Path, frozenset[Path]]:
        return {file: self.direct(file) for file in self._files.values()}
