"""The benchmark of the filter runs on a small task."""

import pytest

from mapfilter.workflows import bench_filter

SMALL = (
    "area.bbox=24.9420,60.1660,24.9495,60.1697", "area.resolution_m=10", "journeys.length_m=400",
)  # fmt: skip


@pytest.mark.filterwarnings("default")
def test_a_small_bench():
    found = bench_filter.bench_filter(
        runs=1, particles=(500,), tracks=1, length_m=400.0, settings=SMALL
    )
    assert (found.runs, found.tracks, found.steps[0].particles) == (1, 1, 500)
    step = found.steps[0]
    assert min(step.step_ns, step.filter_ns) > 0
    assert found.track_s > 0
    assert found.with_alternative in (0, 1)
    assert 50e6 < found.loaded_memory_bytes < found.peak_memory_bytes < 2e9
