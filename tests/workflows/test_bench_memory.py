"""The benchmark of memory: each task by itself, in a process of its own."""

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.workflows.bench import STAGES, made_rasters, run_bench
from mapfilter.workflows.benchmarks import memory as bench_memory


def test_a_task_is_measured_in_a_process_of_its_own(tmp_path):
    ballast = np.ones(100_000_000)
    rasters, _ = made_rasters(tmp_path / "rasters.tif", 2, 200)
    found = bench_memory._in_a_process("build", [rasters.path])
    assert found.task == "build"
    assert 50e6 < found.loaded_memory_bytes < found.peak_memory_bytes < ballast.nbytes
    assert (tmp_path / "peak" / "manifest.json").is_file()


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_has_tasks_and_inputs_of_their_own(monkeypatch, stage):
    asked = []
    monkeypatch.setattr(bench_memory, "_inputs", lambda stage, folder: [folder / stage])

    def measured(task, given):
        asked.append((task, given[0].name))
        return bench_memory.TaskMemory(task, 1, 2)

    monkeypatch.setattr(bench_memory, "_in_a_process", measured)
    found = run_bench(stage, memory=True)
    assert found.stage == stage
    assert [one.task for one in found.tasks] == list(bench_memory.TASKS[stage])
    assert asked == [(task, stage) for task in bench_memory.TASKS[stage]]


def test_a_sweep_and_steps_run_on_what_was_made_for_them(tmp_path):
    small = ("area.bbox=24.9420,60.1660,24.9495,60.1697", "area.resolution_m=10")
    settings = [*small, "journeys.count=1", "journeys.length_m=400"]
    database, logs = bench_memory.make_world(tmp_path, settings)
    for task in ("track", "smoothed track", "500 particles"):
        loaded, peak = bench_memory.done(task, [database, logs[0]])
        # Linux counts the pages of each thread in batches of 64, so that a peak may seem to fall.
        assert 50e6 < loaded < peak + 1e6


def test_peers_and_memory_are_two_questions():
    with pytest.raises(ConfigError, match="one of --peers, --memory"):
        run_bench("filter", peers=True, memory=True)
