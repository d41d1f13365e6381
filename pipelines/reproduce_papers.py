"""The experiments of the papers, from map to figure and table.

The settings are in ``reproduce_papers.toml``::

    python pipelines/reproduce_papers.py --set area.map=CITY.osm.pbf --set area.bbox=W,S,E,N
"""

import sys
from pathlib import Path
from typing import Any

from mapfilter.config.sections import Config
from mapfilter.workflows.pipeline import Stage, run_pipeline
from mapfilter.workflows.reproduce import run_reproduce

WORKERS = 2


def khalaf_allah_2007(config: Config) -> dict[str, Any]:
    """Repeat Fig. 5 and Table 4, with the plan's seed and its runs in each cell."""
    return run_reproduce(
        "khalaf-allah-2007",
        config.output.dir / "khalaf-allah-2007",
        map_name=config.area.map,
        bbox=config.area.bbox,
        trials=config.sweep.routes * config.sweep.draws,
        seed=config.sweep.seed,
        workers=WORKERS,
    )


if __name__ == "__main__":
    stages: dict[str, Stage] = {"khalaf_allah_2007": khalaf_allah_2007}
    sys.exit(run_pipeline(stages, Path(__file__).with_suffix(".toml")))
