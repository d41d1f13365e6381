"""Worker processes: none outlives its parent or holds its pipes, and what ended one is named."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from mapfilter._parallel import local_executor, ordered_results
from mapfilter.errors import MapfilterError

LONG_S = 60.0
PATIENCE_S = 40.0

PARENT = """
import os, sys, time
from pathlib import Path
import mapfilter._workers as workers
from mapfilter._parallel import local_executor, ordered_results

if sys.argv[2] == "without prctl":
    workers._PR_SET_PDEATHSIG = 0

def sleep(folder):
    (folder / str(os.getpid())).touch()
    print("a worker writes to nobody", flush=True)
    time.sleep(60)

if __name__ == "__main__":
    with local_executor(2) as executor:
        list(ordered_results(executor, sleep, [Path(sys.argv[1])] * 4))
"""


def is_alive(pid):
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    return False


def wait_for(condition, message):
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        if condition():
            return
        time.sleep(0.05)
    pytest.fail(message)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks processes up in /proc")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["SIGKILL", "SIGTERM"])
@pytest.mark.parametrize("watch", ["as it is", "without prctl"])
def test_workers_end_with_their_parent_whatever_ends_it(tmp_path, number, watch):
    script, pids = tmp_path / "parent.py", tmp_path / "pids"
    script.write_text(PARENT)
    pids.mkdir()
    given = [sys.executable, str(script), str(pids), watch]
    with subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as parent:
        try:
            wait_for(lambda: len(list(pids.iterdir())) == 2, "two workers began")
            workers = [int(path.name) for path in pids.iterdir()]
            parent.send_signal(number)
            # Returns at the end of the pipes, which nobody holds any more.
            out, _ = parent.communicate(timeout=PATIENCE_S)
        finally:
            parent.kill()
    assert parent.returncode == -number
    assert out == b""
    wait_for(lambda: not any(map(is_alive, workers)), "no worker outlives its parent")


def sleep(_):
    time.sleep(LONG_S)


def test_a_block_that_is_left_waits_for_no_task():
    began_s = time.monotonic()

    def leave(executor):
        executor.submit(os.getpid).result()
        for _ in range(4):
            executor.submit(sleep, None)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), local_executor(2) as executor:
        leave(executor)
    assert time.monotonic() - began_s < LONG_S / 2


def test_a_block_that_is_left_leaves_no_thread_of_its_pool():
    # An interpreter that ends while the thread closes its pipe prints a traceback.
    def leave(executor):
        executor.submit(os.getpid).result()
        raise ZeroDivisionError

    before = set(threading.enumerate())
    with pytest.raises(ZeroDivisionError), local_executor(2) as executor:
        leave(executor)
    assert [one for one in threading.enumerate() if not one.daemon and one not in before] == []


def killed(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def crashes(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGSEGV)
    return number


def out_of_memory(number):
    if number == 1:
        raise MemoryError
    return number


@pytest.mark.parametrize(
    ("function", "named"),
    [
        (killed, r"killed \(signal 9\), as the system does when memory runs out"),
        (crashes, r"crashed \(SIGSEGV"),
        (out_of_memory, "ran out of memory"),
    ],
)
def test_what_ended_a_worker_is_named(function, named):
    told = rf"worker processes: .*one that .*{named}.*too many workers.*--resume"
    with pytest.raises(MapfilterError, match=told), local_executor(2) as executor:
        list(ordered_results(executor, function, range(4)))


OTHER_CODE = """
import sys
import mapfilter._parallel as parallel
from mapfilter.errors import MapfilterError

if __name__ == "__mp_main__":
    parallel.code_digest = lambda: "another"

if __name__ == "__main__":
    try:
        with parallel.local_executor(2) as executor:
            list(parallel.ordered_results(executor, abs, range(4)))
    except MapfilterError as error:
        print(error)
"""


def test_a_worker_with_other_code_does_nothing(tmp_path):
    script = tmp_path / "other.py"
    script.write_text(OTHER_CODE)
    run = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=True, timeout=120
    )
    assert "worker on" in run.stdout
    assert "found other versions (likely: install the same on all hosts)" in run.stdout


def _half_a_result(_, code=9):
    """End as a killed worker may, or one in which a library exits: while it sends a result."""
    send = Connection._send

    def half(self, data, write=os.write):
        send(self, data[: len(data) // 2], write)
        os._exit(code)

    Connection._send = half
    return bytes(1_000)


def _half_and_no_error(task):
    return _half_a_result(task, code=0)


def _other(task):
    return _half_a_result(task) if task == 0 else time.sleep(LONG_S)


HALF = """
import signal, sys
from mapfilter._parallel import local_executor, ordered_results
from test_workers import _half_a_result, _half_and_no_error, _other

def stopped(executor):
    executor.submit(_half_a_result, 0).add_done_callback(lambda _: None)
    while not any(one.exitcode for one in executor._context.started):
        pass
    raise KeyboardInterrupt

if __name__ == "__main__":
    with local_executor(2) as executor:
        if sys.argv[1] == "stopped":
            stopped(executor)
        if sys.argv[1] == "without an error":
            list(ordered_results(executor, _half_and_no_error, [0]))
        if sys.argv[1] == "forgotten":
            signal.signal(signal.SIGCHLD, signal.SIG_IGN)
            list(ordered_results(executor, _half_a_result, [0]))
        list(ordered_results(executor, _other, range(int(sys.argv[1]))))
"""


@pytest.mark.parametrize("tasks", ["1", "4", "stopped", "without an error", "forgotten"])
def test_a_worker_that_ends_while_it_sends_a_result_hangs_nobody(tmp_path, tasks):
    script = tmp_path / "half.py"
    script.write_text(HALF)
    given, where = [sys.executable, str(script), tasks], {"PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run(
        given, env=os.environ | where, capture_output=True, text=True, timeout=PATIENCE_S
    )
    expected = "KeyboardInterrupt" if tasks == "stopped" else "worker processes: expected all"
    assert expected in done.stderr
    assert done.returncode not in (0, None)


CLOSED_AT_LEISURE = """
import os, signal, sys, time
from multiprocessing.connection import Connection
from mapfilter._parallel import begun, worker_processes

close = Connection._close

def slowly(self, _close=os.close):
    close(self)
    time.sleep(0.2)

Connection._close = slowly
here = os.getpid()

def task(parent):
    if os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return "done here"

if __name__ == "__main__":
    from functools import partial
    for _ in range(4):
        with worker_processes(1) as worker:
            print(begun(worker, partial(task, here))())
"""


def test_a_pipe_is_closed_by_one_thread_only(tmp_path):
    """Else the second one closes what has the same number by then, or nothing, which fails."""
    script = tmp_path / "leisure.py"
    script.write_text(CLOSED_AT_LEISURE)
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[:4] == ["done here"] * 4


DONE_WITH = """
import atexit, sys
from functools import partial
from pathlib import Path
from mapfilter._parallel import worker_processes

class Module:
    def __init__(self, folder, touch=Path.touch):
        self.file, self.touch = folder / "taken apart", touch

    def __del__(self):
        self.touch(self.file)

def task(folder):
    sys.modules["large"] = Module(folder)
    atexit.register((folder / "cleaned up").touch)

if __name__ == "__main__":
    with worker_processes(1) as worker:
        worker.submit(partial(task, Path(sys.argv[1]))).result()
"""


def test_a_worker_that_is_done_cleans_up_and_takes_no_module_apart(tmp_path):
    """Which the main process would wait for."""
    script, left = tmp_path / "done.py", tmp_path / "left"
    script.write_text(DONE_WITH)
    left.mkdir()
    given = [sys.executable, str(script), str(left)]
    done = subprocess.run(given, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in left.iterdir()] == ["cleaned up"]
