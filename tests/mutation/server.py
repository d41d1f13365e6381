"""A process that has the libraries loaded and runs each pytest in a fork of itself.

It reads one JSON object a line (:class:`Request`) and answers with one (:class:`Outcome`). The
package under test is first imported in the fork, so that a fork sees the files as they are then.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import sys
import time
import traceback
from collections import defaultdict
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import pytest

BROKEN = 70
"""Exit status of a run that pytest never began."""
_POLL_S = 0.02
_WAITING = 10.0
"""A test that waits, or has others work, may take so many times its processor time by the clock."""


@dataclass(frozen=True)
class Request:
    """A run of pytest.

    Parameters
    ----------
    arguments : list of str
    log : str
        File for what it prints.
    limits_s : dict of str to float
        Longest time of a test of each file; any other file may take ``limit_s``.
    limit_s : float
        Longest time of it all.
    keep_bytecode : bool
        Whether bytecode is written, which is of use only for files that stay as they are.
    """

    arguments: list[str]
    log: str
    limits_s: dict[str, float] = field(default_factory=dict)
    limit_s: float = 3600.0
    keep_bytecode: bool = False


@dataclass(frozen=True)
class Outcome:
    """How it ended.

    Parameters
    ----------
    code : int
        Of pytest, or of the signal that ended it, negative.
    test : str
        The test that failed or was running.
    seconds : float
    files_s : dict of str to float
        Time of the tests of each file.
    """

    code: int
    test: str
    seconds: float
    files_s: dict[str, float]

    @property
    def timed_out(self) -> bool:
        """Whether it ran too long."""
        return self.code in (-signal.SIGPROF, -signal.SIGALRM, -signal.SIGKILL)


class Watch:
    """Notes which test runs or failed, and ends the process when one test takes too long."""

    def __init__(self, request: Request, note: Path) -> None:
        self._request, self._note = request, note
        self._files_s: dict[str, float] = defaultdict(float)
        self._failed = ""

    @pytest.hookimpl(tryfirst=True)
    def pytest_load_initial_conftests(self) -> None:
        from hypothesis import Phase, settings

        # That an example fails is enough; to find the smallest one takes longer than all tests.
        phases = (Phase.explicit, Phase.reuse, Phase.generate)
        settings.register_profile("mutants", phases=phases)
        settings.load_profile("mutants")

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        limit_s = self._request.limits_s.get(nodeid.partition("::")[0], self._request.limit_s)
        # Their default actions end the process even within a compiled kernel. Processor time is
        # what a mutant uses up; the clock alone says how busy the machine is.
        signal.setitimer(signal.ITIMER_PROF, limit_s)
        signal.setitimer(signal.ITIMER_REAL, _WAITING * limit_s)
        self._write(nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._files_s[report.nodeid.partition("::")[0]] += report.duration
        self._fail(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        self._fail(report)

    def pytest_sessionfinish(self) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        self._write(self._failed)

    def _fail(self, report: Any) -> None:
        if report.failed and not self._failed:
            self._failed = report.nodeid

    def _write(self, test: str) -> None:
        self._note.write_text(json.dumps([test, self._files_s]))


def run(request: Request) -> Outcome:
    """Run pytest in a fork."""
    note, began_s = Path(f"{request.log}.json"), time.monotonic()
    note.unlink(missing_ok=True)
    child = os.fork()
    if child == 0:
        _become(request, note)
    owner = os.getppid()
    try:
        while (ended := os.waitpid(child, os.WNOHANG))[0] == 0:
            if time.monotonic() - began_s > _WAITING * request.limit_s:
                os.kill(child, signal.SIGKILL)
                ended = os.waitpid(child, 0)
                break
            if os.getppid() != owner:
                raise SystemExit
            time.sleep(_POLL_S)
    finally:
        # Workers that the tests started go with it.
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child, signal.SIGKILL)
    test, files_s = json.loads(note.read_text()) if note.exists() else ("", {})
    seconds = time.monotonic() - began_s
    return Outcome(os.waitstatus_to_exitcode(ended[1]), test, seconds, files_s)


def _become(request: Request, note: Path) -> None:
    code = BROKEN
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.setsid()
        nothing = os.open(os.devnull, os.O_RDONLY)
        log = os.open(request.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for number, file in ((0, nothing), (1, log), (2, log)):
            os.dup2(file, number)
        sys.dont_write_bytecode = not request.keep_bytecode
        # The clock of the tests themselves would stop the one of Watch.
        arguments = [*request.arguments, "-o", "timeout=0"]
        code = int(pytest.main(arguments, plugins=[Watch(request, note)]))
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(code)


def main() -> None:
    """Load the libraries named as arguments and answer requests until there are no more."""
    # Whoever ends this process ends what runs in its fork.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    for name in sys.argv[1:]:
        # Only speed is lost without one.
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    for line in sys.stdin:
        outcome = run(Request(**json.loads(line)))
        sys.stdout.write(json.dumps(asdict(outcome)) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
