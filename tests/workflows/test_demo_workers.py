"""What the demo hands to other processes is done by itself where these died."""

import multiprocessing.synchronize
import multiprocessing.util
import os
import signal
import time
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path

import pytest

from mapfilter._io import atomic_dir
from mapfilter._parallel import (
    SerialExecutor,
    begun,
    local_executor,
    made_ready,
    ordered_results,
    spare_processes,
    warmed,
)
from mapfilter._partial import remove_left
from mapfilter._workers import NoProcessError
from mapfilter.errors import MapfilterError, fail


def _where() -> int:
    return os.getpid()


def _killed_elsewhere(parent: int) -> int:
    if os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return 7


def _wrong() -> int:
    raise fail(MapfilterError, "here", "a number", "none")


class _Elsewhere:
    """A task that knows the process that it was made in."""

    def __init__(self) -> None:
        self.parent = os.getpid()

    def __call__(self) -> int:
        return _killed_elsewhere(self.parent)


def test_a_task_runs_elsewhere_and_its_faults_come_back():
    with local_executor(2) as workers:
        where, wrong = begun(workers, _where), begun(workers, _wrong)
        assert where() != os.getpid()
        with pytest.raises(MapfilterError, match="a number"):
            wrong()


def test_a_task_whose_worker_died_is_done_here():
    with local_executor(2) as workers:
        first = begun(workers, _Elsewhere())
        assert first() == 7
        # The pool is broken by now.
        with pytest.raises(BrokenProcessPool):
            workers.submit(_where)
        assert begun(workers, _where)() == os.getpid()


def test_warming_up_leaves_faults_to_the_tasks():
    with local_executor(2) as workers:
        assert begun(workers, _Elsewhere())() == 7
        warmed(workers, 2, _where)


def _noted(folder):
    (folder / str(os.getpid())).touch()


def test_workers_get_ready_by_themselves(tmp_path):
    with local_executor(2) as workers:
        made_ready(workers, 2, partial(_noted, tmp_path))
    done = {int(file.name) for file in tmp_path.iterdir()}
    assert 1 <= len(done) <= 2
    assert os.getpid() not in done
    made_ready(SerialExecutor(), 2, partial(pytest.fail, "done before it is its turn"))


@pytest.mark.parametrize("lacks", ["semaphores", "room"])
def test_where_no_process_can_be_started_all_is_done_here(monkeypatch, lacks):
    def refused(*_, **__):
        raise OSError(38 if lacks == "semaphores" else 11, "not here")

    place, name = {
        "semaphores": (multiprocessing.synchronize.SemLock, "__init__"),
        "room": (multiprocessing.util, "spawnv_passfds"),
    }[lacks]
    monkeypatch.setattr(place, name, refused)
    with spare_processes(2) as workers:
        warmed(workers, 2, _where)
        assert begun(workers, _where)() == os.getpid()
    expected = "processes beside this one, found .*not here.*use one worker"
    with pytest.raises(NoProcessError, match=expected), local_executor(2) as workers:
        list(ordered_results(workers, abs, range(4)))


def test_on_a_single_processor_a_task_is_done_at_once():
    done = []
    result = begun(SerialExecutor(), lambda: done.append(1))
    assert done == [1]
    assert result() is None
    assert done == [1]


def _half_written(path: str) -> None:
    with atomic_dir(Path(path)) as folder:
        (folder / "half").write_text("half")
        time.sleep(60)


def _stopped_while_one_writes(out: Path, target: Path) -> None:
    # Workers import this file: what they have no use for would keep them waiting.
    from mapfilter.workflows import demo

    with demo._cleared(out), local_executor(2) as workers:
        begun(workers, partial(_half_written, str(target)))
        until_s = time.monotonic() + 60
        while not list(out.rglob("half")):
            assert time.monotonic() < until_s
            time.sleep(0.01)
        raise KeyboardInterrupt


def test_what_a_stopped_worker_left_is_removed(tmp_path):
    target = tmp_path / "results" / "found"
    with pytest.raises(KeyboardInterrupt):
        _stopped_while_one_writes(tmp_path, target)
    assert list(target.parent.iterdir()) == []


def test_what_others_write_stays(tmp_path):
    with atomic_dir(tmp_path / "own") as own:
        remove_left(tmp_path, 0.05)
        assert own.is_dir()
        (own / "half").write_text("whole")
    assert (tmp_path / "own" / "half").read_text() == "whole"
