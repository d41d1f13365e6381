"""``mapfilter film``: a replay's page as GIF or MP4."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._parallel import Progress
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.report.basemap import BaseMap
from mapfilter.report.film import FilmMoment, FilmTrack, write_film
from mapfilter.report.track_marks import bounds_about
from mapfilter.viewing.arrays import unpacked
from mapfilter.viewing.page import read_page
from mapfilter.workflows.inputs.apart import check_in_no_store
from mapfilter.workflows.views import pages_of

MOST_PICTURES = 240
_AROUND_M = 80.0


def run_film(
    result: Path,
    out: Path,
    *,
    run: int = 0,
    pictures: int = 150,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Write a film of one run of a replay.

    Parameters
    ----------
    result : Path
        A result of ``replay --html``, or a page.
    out : Path
        The film: .gif, or .mp4 where ffmpeg is found.
    run : int
        Of several side by side, counted from 0.
    pictures : int
        How many, evenly chosen in time.
    progress : callable, optional
        Called with the numbers of pictures drawn and of all.

    Raises
    ------
    MapfilterError
        There is no such run, it has no epochs, or the film cannot be written.
    """
    if not 1 <= pictures <= MOST_PICTURES:
        raise fail(ConfigError, "--pictures", f"1 to {MOST_PICTURES}", pictures)
    check_in_no_store(out)
    page = pages_of([result])[0]
    bundle = read_page(page)
    try:
        if not 0 <= run < len(bundle["runs"]):
            raise fail(ConfigError, "--run", f"a run of {len(bundle['runs'])}", run)
        chosen = bundle["runs"][run]
        if not chosen["epochs"]["count"]:
            raise fail(InputError, str(page), "a run with epochs", "none")
        track = _track(bundle, chosen)
        moments = _moments(bundle, chosen, pictures)
        base = _base(bundle, track)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise fail(InputError, str(page), "a whole page", repr(error), "damaged") from error
    write_film(track, moments, base, out, title=str(chosen["name"]), progress=progress)
    return {"film": out, "pictures": len(moments), "megabytes": round(out.stat().st_size / 1e6, 2)}


def _track(bundle: Mapping[str, Any], run: Mapping[str, Any]) -> FilmTrack:
    found, origin_m = run["epochs"], np.array(bundle["frame"]["origin"])
    names = ("east", "north", "truth_east", "truth_north")
    east, north, truth_east, truth_north = (unpacked(found[name]) for name in names)
    return FilmTrack(
        np.column_stack([east, north]) + origin_m,
        np.column_stack([truth_east, truth_north]) + origin_m,
        unpacked(found["r95"]).astype(np.float64),
        tuple(str(bundle["statuses"][code]) for code in unpacked(found["status"]).astype(int)),
    )


def _moments(bundle: Mapping[str, Any], run: Mapping[str, Any], pictures: int) -> list[FilmMoment]:
    west, south = bundle["frame"]["origin"]
    time_s, belief = unpacked(run["epochs"]["time"]), run["belief"]
    frame = {name: np.empty(0) for name in ("epoch", "first", "step", "col", "row", "mass")}
    if belief is not None:
        frame = {name: unpacked(belief[name]) for name in frame}
    # Of a Kalman-type filter estimate and radius tell all.
    shade = frame["mass"] / 255.0
    count = int(run["epochs"]["count"])
    at = np.unique(np.linspace(0, count - 1, min(pictures, count)).astype(np.int64))
    moments = []
    for epoch in at.tolist():
        number = int(np.searchsorted(frame["epoch"], epoch, side="right")) - 1
        some = slice(0, 0)
        step = 1.0
        if number >= 0:
            some = slice(int(frame["first"][number]), int(frame["first"][number + 1]))
            step = float(frame["step"][number])
        corner = np.column_stack([frame["col"][some], frame["row"][some]]) * step + (west, south)
        moments.append(FilmMoment(epoch, f"{time_s[epoch]:.0f} s", corner, step, shade[some]))
    return moments


def _base(bundle: Mapping[str, Any], track: FilmTrack) -> BaseMap:
    """Return the streets about the tracks; a straight one still shows its surroundings."""
    west, south = bundle["frame"]["origin"]
    width, height = bundle["frame"]["size"]
    streets = bundle["background"]["streets"]
    corner = np.column_stack([unpacked(streets["east"]) + west, unpacked(streets["north"]) + south])
    lines = np.split(corner, unpacked(streets["first"])[1:-1].astype(np.int64))
    places = np.concatenate([track.estimate_m, track.truth_m])
    places = places[np.isfinite(places).all(axis=1)]
    bounds = west, south, west + max(width, 1.0), south + max(height, 1.0)
    if len(places):
        bounds = bounds_about(places, _AROUND_M)
    shown = tuple(line for line in lines if len(line) > 1)
    return BaseMap(bounds, shown, attribution=str(bundle["attribution"]))
