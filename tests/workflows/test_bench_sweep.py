"""The benchmark of sweeps runs, on a small task, and tells figures that belong together."""

import pytest

from mapfilter.workflows.benchmarks import sweep as bench_sweep


@pytest.mark.filterwarnings("default")
def test_a_small_bench(monkeypatch):
    cluster = bench_sweep.cluster_executor

    def one_worker(_):
        return cluster("local:1")

    monkeypatch.setattr(bench_sweep, "cluster_executor", one_worker)
    found = bench_sweep.bench_sweep(runs=1, trials=1)
    assert found.runs == 6
    assert found.epochs == 87
    assert 0 < found.sensed_s < found.located_s
    assert found.filter_step_s == pytest.approx(found.located_s / 87)
    assert found.one_process_runs_per_s == pytest.approx(6 / found.one_process_s)
    assert found.efficiency == pytest.approx(found.speedup / 2)
    assert found.dask_ratio == pytest.approx(found.dask_s / found.two_processes_s)
