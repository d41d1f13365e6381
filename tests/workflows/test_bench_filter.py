"""The benchmark of the filter runs on a small task."""

import pytest

from mapfilter.errors import ConfigError
from mapfilter.workflows.bench import run_bench
from mapfilter.workflows.benchmarks import filter as bench_filter
from mapfilter.workflows.benchmarks import threads as bench_threads

SMALL = (
    "area.bbox=24.9420,60.1660,24.9495,60.1697", "area.resolution_m=10", "journeys.length_m=400",
)  # fmt: skip


@pytest.mark.filterwarnings("default")
def test_a_small_bench(monkeypatch):
    monkeypatch.setattr(bench_filter, "_PER_ROW", 2)
    found = bench_filter.bench_filter(
        runs=1, particles=(500,), tracks=1, length_m=400.0, settings=SMALL
    )
    assert (found.runs, found.tracks, found.steps[0].particles) == (1, 1, 500)
    step = found.steps[0]
    assert min(step.step_ns, step.filter_ns) > 0
    assert found.track_s > 0
    assert found.with_alternative in (0, 1)
    assert 50e6 < found.loaded_memory_bytes < found.peak_memory_bytes < 2e9


@pytest.mark.filterwarnings("default")
def test_a_step_in_one_thread_and_in_two(monkeypatch):
    monkeypatch.setattr(bench_threads, "_PARTICLES_OF_A_TURN", 1)
    found = bench_threads.bench_threads(
        2, runs=1, particles=(500, 3000), least=2048, settings=SMALL
    )
    assert (found.threads, found.runs, found.processors > 0) == (2, 1, True)
    assert found.load_average >= 0
    assert [(one.particles, one.is_divided) for one in found.steps] == [(500, False), (3000, True)]
    for step in found.steps:
        assert step.speedup == pytest.approx(step.one_ns / step.divided_ns)
        ratios = step.best_speedup, step.filter_speedup, step.best_filter_speedup
        assert min(step.one_ns, *ratios) > 0


@pytest.mark.parametrize(
    ("stage", "asked", "expected"),
    [("build", {}, "the stage filter"), ("filter", {"peers": True}, "one of --peers")],
)
def test_threads_are_a_question_of_their_own(stage, asked, expected):
    with pytest.raises(ConfigError, match=expected):
        run_bench(stage, threads=2, **asked)
