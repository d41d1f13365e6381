"""A Dask cluster that ends in mid-work, or whose hosts differ in what they have installed."""

import contextlib
import logging
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

import mapfilter
from mapfilter._cluster import cluster_executor
from mapfilter._parallel import ordered_results
from mapfilter.errors import MapfilterError

PATIENCE_S = 120.0

pytestmark = pytest.mark.filterwarnings("default")


@contextlib.contextmanager
def cluster(tmp_path, package):
    """Run a scheduler and a worker that imports the package from a folder; give both."""
    file = tmp_path / "scheduler.json"
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    env = {**os.environ, "PYTHONPATH": str(package)}
    with contextlib.ExitStack() as stack:
        processes = []
        for name, more in (("scheduler", ["--port", "0", "--host", "127.0.0.1"]),
                           ("worker", ["--nthreads", "1", "--no-nanny"])):  # fmt: skip
            given = [sys.executable, "-m", f"distributed.cli.dask_{name}", *common, *more]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            process = subprocess.Popen(given, env=env, cwd=tmp_path, **quiet)
            stack.callback(process.wait)
            stack.callback(process.kill)
            processes.append(process)
        yield address_of(file), processes[0]


def address_of(file):
    """Return the scheduler's address, when a worker has come."""
    import json

    from distributed import Client

    until_s = time.monotonic() + PATIENCE_S
    while not file.exists():
        assert time.monotonic() < until_s, "the scheduler began"
        time.sleep(0.1)
    time.sleep(0.2)
    address = json.loads(file.read_text())["address"]
    with Client(address, timeout=PATIENCE_S) as client:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    return address


def test_a_scheduler_that_is_killed_in_mid_work_is_named(tmp_path):
    package = Path(mapfilter.__file__).parents[1]
    with cluster(tmp_path, package) as (address, scheduler):

        def work():
            with cluster_executor(address) as (executor, _):
                for found, value in enumerate(ordered_results(executor, abs, range(-9, 9))):
                    assert value == abs(found - 9)
                    if found == 2:
                        scheduler.kill()

        began_s, logged = time.monotonic(), []
        handler = logging.Handler()
        handler.emit = logged.append
        logger = logging.getLogger("distributed.client")
        logger.addHandler(handler)
        try:
            error = r"expected a running Dask scheduler.*--resume"
            with pytest.raises(MapfilterError, match=error):
                work()
        finally:
            logger.removeHandler(handler)
        assert [record.getMessage() for record in logged] == []
        assert time.monotonic() - began_s < PATIENCE_S


def test_a_worker_of_another_version_is_named_before_any_work(tmp_path):
    other = tmp_path / "other" / "mapfilter"
    shutil.copytree(Path(mapfilter.__file__).parent, other, ignore=shutil.ignore_patterns("*.nb?"))
    with (other / "errors.py").open("a") as source:
        source.write("# one line more\n")
    with (
        cluster(tmp_path, other.parent) as (address, _),
        pytest.raises(MapfilterError, match=r"worker tcp://.*found other versions"),
        cluster_executor(address),
    ):
        pytest.fail("work with other code")
