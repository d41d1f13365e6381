"""How much inertial noise the candidate filter stands: success over a grid of steps and headings.

Run ``build_database.py`` first, with the same area; the settings are in ``sweep_imu_noise.toml``::

    python pipelines/sweep_imu_noise.py --set area.map=CITY.osm.pbf --set area.bbox=W,S,E,N
"""

import sys
from pathlib import Path

from mapfilter.workflows.pipeline import Stage, run_pipeline
from mapfilter.workflows.sweep import run_sweep

WORKERS = 2

if __name__ == "__main__":
    stages: dict[str, Stage] = {"sweep": lambda config: run_sweep(config, workers=WORKERS)}
    sys.exit(run_pipeline(stages, Path(__file__).with_suffix(".toml")))
