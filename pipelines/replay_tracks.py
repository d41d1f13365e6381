"""Journeys along the streets of a database's area, located from an unknown start, and scored.

The filter is that of 2007, and the phone is served exactly as predicted, as in the paper: the
success rate is no estimate of accuracy. ``mapfilter evaluate global-positioning`` makes one.

Run ``build_database.py`` first, with the same area; the settings are in ``replay_tracks.toml``::

    python pipelines/replay_tracks.py --set area.map=CITY.osm.pbf --set area.bbox=W,S,E,N
"""

import sys
from pathlib import Path

from mapfilter.workflows.pipeline import Stage, run_pipeline
from mapfilter.workflows.replay import run_replay
from mapfilter.workflows.replays.figures import replay_figures
from mapfilter.workflows.simulate import run_simulate

if __name__ == "__main__":
    stages: dict[str, Stage] = {
        "simulate": run_simulate,
        "replay": lambda config: replay_figures(run_replay(config, config.output.dir / "replay")),
    }
    sys.exit(run_pipeline(stages, Path(__file__).with_suffix(".toml")))
