"""Cell plan and street map to RxLev rasters, rasters and streets to a radio-route database.

Run it from anywhere; its settings are in ``build_database.toml`` beside it::

    python pipelines/build_database.py --set area.map=CITY.osm.pbf --set area.bbox=W,S,E,N
"""

import sys
from pathlib import Path

from mapfilter.workflows.build import run_build
from mapfilter.workflows.pipeline import Stage, run_pipeline
from mapfilter.workflows.predict import run_predict

if __name__ == "__main__":
    stages: dict[str, Stage] = {"predict": run_predict, "build": run_build}
    sys.exit(run_pipeline(stages, Path(__file__).with_suffix(".toml")))
