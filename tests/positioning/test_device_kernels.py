"""Steps of the map filter on a graphics processor are those of the processor, in the simulator."""

from pathlib import Path

import pytest
from simulator import run_simulated


@pytest.mark.long
def test_steps_of_a_device_in_the_simulator():
    run_simulated(Path(__file__).with_name("simulated_device.py"))
