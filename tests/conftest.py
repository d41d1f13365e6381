"""Fixtures shared by all rooms."""

import gc
import os
import re
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager
from itertools import count
from pathlib import Path
from typing import Any

# Before NumPy is loaded. Matrices are small: threads of BLAS only wait for each other, and take the
# processor from the other worker.
os.environ["OPENBLAS_NUM_THREADS"] = os.environ.get("OPENBLAS_NUM_THREADS", "1")

import pytest
from _pytest.doctest import DoctestModule
from fuzz import MUTATIONS
from hypothesis import settings

# A slow machine is no failure: speed belongs in benchmarks.
settings.register_profile("mapfilter", deadline=None)
settings.load_profile("mapfilter")

_NEW_OBJECTS = 5000
_SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_addoption(parser: pytest.Parser) -> None:
    said = "damaged copies of each sample that a reader is fed with"
    parser.addoption("--mutations", type=int, default=MUTATIONS, help=said)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put modules with long tests first, so that no worker ends with one of them alone.

    The order is that of paths in all workers, whatever the order in which they collect.
    """
    long = {item.path for item in items if item.get_closest_marker("long") is not None}
    items.sort(key=lambda item: (item.path not in long, item.path))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Collect folders from their ends in every second worker.

    In a fresh clone each module's assertions are rewritten first, and kept for the other worker:
    so each rewrites half of them, not both all of them at the same time.
    """
    report = yield
    worker = getattr(collector.config, "workerinput", {}).get("workerid", "gw0")
    if isinstance(collector, pytest.Session | pytest.Directory) and worker[-1] in "13579":
        report.result = list(reversed(report.result or []))
    return report


@pytest.hookimpl(wrapper=True)
def pytest_collect_file() -> Generator[None, list[Any], list[Any]]:
    """Look for no examples in docstrings of tests, which have none."""
    return [one for one in (yield) if not isinstance(one, DoctestModule)]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Spare the search for unused cycles what stays until the end: all modules and all tests.

    While these are made, nothing is there to be found. Afterwards it comes after as many new
    objects as in a command.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()
        gc.set_threshold(_NEW_OBJECTS)


@pytest.fixture(scope="module", autouse=True)
def _no_waiting_for_disks(request: pytest.FixtureRequest) -> Iterator[None]:
    """Hand files to the system alone: no test cuts the power, and many would wait for disks.

    Tests of writing itself (core), and all processes that a test starts, do flush.
    """
    with pytest.MonkeyPatch.context() as patch:
        if request.path.parent.name != "core":
            # Of a file that is not open this one fails as well.
            patch.setattr(os, "fsync", os.fstat)
        yield


@pytest.fixture(scope="module")
def _folders(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """Make folders of a module's tests, numbered, with the beginning of a test's name."""
    module, number = tmp_path_factory.mktemp(request.path.stem), count()

    def made(name: str) -> Path:
        folder = module / f"{re.sub(r'[^a-z0-9]', '_', name[:30].lower())}{next(number)}"
        folder.mkdir()
        return folder

    return made


@pytest.fixture
def tmp_path(request: pytest.FixtureRequest, _folders: Callable[[str], Path]) -> Path:
    """Return a new folder of this test alone.

    For its own one pytest reads the names of all folders of the tests before: of some thousand of
    them that takes longer than most tests.
    """
    return _folders(request.node.name)


@pytest.fixture(scope="module")
def few_single_reports() -> Iterator[None]:
    """Locate few single reports beside each replay: they take longer than the replay itself."""
    from mapfilter.workflows.replays import baseline as replay_baseline

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(replay_baseline, "MOST_REPORTS", 8)
        patch.setattr(replay_baseline, "CALIBRATED_WITH", 16)
        yield


@pytest.fixture(scope="session")
def drawn_small() -> Callable[[], AbstractContextManager[None]]:
    """Return a context in which pictures have few pixels and are not laid out.

    Laying out takes longer than drawing. For tests that ask for files and names: those of the room
    report have pictures as a user does.
    """

    @contextmanager
    def within() -> Iterator[None]:
        from mapfilter.report import saving

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(saving, "_laid_out", _not_laid_out)
            patch.setattr(saving, "DPI", 20)
            yield

    return within


@pytest.fixture(scope="module")
def small_pictures(drawn_small: Callable[[], AbstractContextManager[None]]) -> Iterator[None]:
    """Draw small pictures in the whole module."""
    with drawn_small():
        yield


@contextmanager
def _not_laid_out(figure: Any) -> Iterator[None]:
    engine = figure.get_layout_engine()
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)


@pytest.fixture(scope="session")
def mutation_count(request: pytest.FixtureRequest) -> int:
    """How many damaged copies of a sample a reader is fed with."""
    return int(request.config.getoption("--mutations"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real maps and recordings, which lies beside the checkout."""
    folder = _SHARED / "data"
    if not folder.is_dir():
        pytest.skip("the real data sets are not beside this checkout (../shared/data)")
    return folder
