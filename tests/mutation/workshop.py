"""A copy of the repository in which mutants are planted, and the process that runs tests there.

Nothing in the working tree changes. Compiled kernels are kept from mutant to mutant, but never
those of a file that imports the mutated one: a kernel inlines what it calls, and numba only looks
at the file in which the kernel itself stands.
"""

from __future__ import annotations

import ast
import fcntl
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from types import TracebackType

from .operators import Mutant, applied
from .rooms import Imports
from .server import BROKEN, Outcome, Request
from .source import Source

PARTS = ("data", "pipelines", "tests", "docs", "pyproject.toml", "README.md")
LIBRARIES = (
    "numpy", "scipy.stats", "scipy.ndimage", "scipy.optimize", "scipy.interpolate",
    "scipy.spatial", "pandas", "pyarrow.parquet", "pyarrow.dataset", "shapely", "pyproj",
    "geopandas", "rasterio", "pydantic", "numba",
)  # fmt: skip
"""Loaded once, before any fork, by the process that the package's tests are forked from."""
_NEVER_COPIED = ("__pycache__", "_build", ".hypothesis")
_COMPILING = ("numba", "on_demand", "@kernel")
"""Words of files whose functions are compiled; the last two call numba in another file."""
_LATER_NS = 3_600_000_000_000
"""By how much a mutated file is newer: caches are asked for by the time of their file."""


class Workshop:
    """The copy, its caches and its process.

    Parameters
    ----------
    root : Path
        The repository.
    folder : Path
        Where the copy and the caches lie; kept from run to run.
    package : str
        The package that is mutated.

    Raises
    ------
    RuntimeError
        Another run works in the folder.
    """

    def __init__(self, root: Path, folder: Path, package: str = "mapfilter") -> None:
        self.copy = folder / "copy"
        self._root, self._folder, self._package = root, folder, package
        self._parts = (package, *PARTS)
        self._kernels, self._warm = folder / "kernels", folder / "kernels-warm"
        self._log, self._examples = folder / "log.txt", folder / "hypothesis"
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Workshop:
        self._folder.mkdir(parents=True, exist_ok=True)
        self._lock = (self._folder / "lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise RuntimeError(f"{self._folder}: another run is at work here") from None
        changed = self._synchronise()
        self.imports = Imports(self.copy, self._package)
        for file in changed:
            self._forget(self._warm, file)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        if self._process is not None:
            with self._process as process:
                process.terminate()
        self._lock.close()

    def warm(self, request: Request) -> Outcome:
        """Run tests on the sources as they are, and keep the kernels that they compile."""
        self._restore_kernels()
        outcome = self._run(request)
        shutil.rmtree(self._warm, ignore_errors=True)
        shutil.copytree(self._kernels, self._warm, copy_function=os.link)
        return outcome

    def judge(self, mutant: Mutant, request: Request) -> Outcome:
        """Run tests on a mutant."""
        file = self.copy / mutant.file
        pristine, stamp = file.read_text(), file.stat()
        self._restore_kernels()
        if is_inlined(pristine, mutant):
            self._forget(self._kernels, Path(mutant.file))
        try:
            file.write_text(applied(pristine, mutant))
            os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns + _LATER_NS))
            return self._run(request)
        finally:
            file.write_text(pristine)
            os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))

    def request(self, tests: Iterable[Path], **more: object) -> Request:
        """Return a request for some files of tests."""
        arguments = ["-x", "-q", "-p", "no:cacheprovider", "--hypothesis-seed=0"]
        files = [test.as_posix() for test in tests]
        return Request([*arguments, *files], str(self._log), **more)  # type: ignore[arg-type]

    def said(self) -> str:
        """Return the end of what the last run printed."""
        return self._log.read_text(errors="replace")[-3000:] if self._log.exists() else ""

    def _run(self, request: Request) -> Outcome:
        # Examples that broke one mutant are no part of the tests of the next.
        shutil.rmtree(self._examples, ignore_errors=True)
        if self._process is None or self._process.poll() is not None:
            self._process = self._started()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(asdict(request)) + "\n")
        self._process.stdin.flush()
        outcome = Outcome(**json.loads(self._process.stdout.readline()))
        if outcome.code == BROKEN:
            raise RuntimeError(f"pytest could not be started\n{self.said()}")
        return outcome

    def _started(self) -> subprocess.Popen[str]:
        paths = [str(self.copy), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "NUMBA_CACHE_DIR": str(self._kernels),
            "HYPOTHESIS_STORAGE_DIRECTORY": str(self._examples),
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        # By its path: the copy's own tests are what is imported in the forks.
        command = [sys.executable, str(Path(__file__).with_name("server.py"))]
        if self._package == "mapfilter":
            command += LIBRARIES
        return subprocess.Popen(
            command,
            cwd=self.copy,
            env=environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )

    def _restore_kernels(self) -> None:
        shutil.rmtree(self._kernels, ignore_errors=True)
        if self._warm.exists():
            shutil.copytree(self._warm, self._kernels, copy_function=os.link)
        self._kernels.mkdir(exist_ok=True)

    def _forget(self, kernels: Path, file: Path) -> None:
        """Delete the kernels of a file and of all that import it."""
        for stale in (file, *self.imports.importers(file)):
            for kernel in kernels.glob(f"{stale.parent.name}_*/{stale.stem}.*"):
                kernel.unlink()

    def _synchronise(self) -> list[Path]:
        """Make the copy equal to the repository and return the package's changed files."""
        wanted = {file for part in self._parts for file in self._files(self._root, part)}
        there = {file for part in self._parts for file in self._files(self.copy, part)}
        for file in there - wanted:
            (self.copy / file).unlink()
        changed = []
        for file in sorted(wanted):
            source, target = self._root / file, self.copy / file
            if not target.exists() or _stamp(source) != _stamp(target):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target)
                changed.append(file)
        return [file for file in changed if file.parts[0] == self._package]

    def _files(self, root: Path, part: str) -> list[Path]:
        whole = root / part
        files = [whole] if whole.is_file() else (p for p in whole.rglob("*") if p.is_file())
        relative = (file.relative_to(root) for file in files)
        return [file for file in relative if not set(file.parts) & set(_NEVER_COPIED)]


def is_inlined(text: str, mutant: Mutant) -> bool:
    """Return whether kernels may hold what a mutant changes: constants and compiled functions.

    Functions of a file that names nothing that compiles are compiled nowhere.
    """
    if any(word in text for word in _COMPILING):
        return True
    source = Source(text)
    functions = [node for node in ast.walk(source.tree) if isinstance(node, ast.FunctionDef)]
    return not any(source.start(f) <= mutant.start < source.end(f) for f in functions)


def _stamp(file: Path) -> tuple[int, int]:
    found = file.stat()
    return found.st_mtime_ns, found.st_size
