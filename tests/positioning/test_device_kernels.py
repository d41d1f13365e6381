"""What a graphics processor computes is what the processor does, in numba's simulator."""

from pathlib import Path

import pytest
from simulator import run_simulated

FILES = (
    "filters/simulated_copies.py",
    "models/simulated_models.py",
    "positioning/simulated_device.py",
)
TESTS = Path(__file__).resolve().parents[1]


def test_no_file_is_left_out():
    found = sorted(TESTS.rglob("simulated_*.py"))
    assert [str(path.relative_to(TESTS)) for path in found] == list(FILES)


@pytest.mark.long
def test_kernels_of_a_device_in_the_simulator():
    """All in one process, whose start and imports take longer than some of these files."""
    run_simulated([TESTS / file for file in FILES])
