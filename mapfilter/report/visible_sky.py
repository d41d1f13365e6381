"""How many satellites are seen from where, between houses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from matplotlib import colormaps
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Polygon

from mapfilter._types import Floats
from mapfilter.report.canvas import VERMILLION, picture

_HOUSE = "#d9d9d9"


@dataclass(frozen=True, eq=False)
class SeenMap:
    """Counts of satellites on a grid.

    Parameters
    ----------
    title : str
    count : (rows, cols) array
        Row 0 is the northern edge; NaN where nobody can be.
    extent_m : (float, float, float, float)
        West, east, south, north.
    """

    title: str
    count: Floats
    extent_m: tuple[float, float, float, float]


def plot_seen_satellites(
    maps: Sequence[SeenMap],
    houses: Sequence[shapely.Polygon],
    tracks_m: Sequence[Floats],
    path: Path,
    *,
    title: str,
) -> None:
    """Draw how many satellites are seen on maps side by side, houses and tracks over them.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    most = int(max(np.nanmax(one.count) for one in maps))
    colours = ListedColormap(colormaps["viridis"](np.linspace(0.05, 1.0, most + 1)))
    norm = BoundaryNorm(np.arange(-0.5, most + 1), most + 1)
    with picture(path, 5.4 * len(maps) + 0.8, 5.6) as figure:
        axes = figure.subplots(1, len(maps), squeeze=False).ravel()
        for one, drawn in zip(axes, maps, strict=True):
            image = one.imshow(
                drawn.count, extent=drawn.extent_m, cmap=colours, norm=norm,
                interpolation="nearest",
            )  # fmt: skip
            for house in houses:
                one.add_patch(Polygon(
                    shapely.get_coordinates(house.exterior), closed=True, facecolor=_HOUSE,
                    edgecolor="white", linewidth=0.6,
                ))  # fmt: skip
            for track in tracks_m:
                one.plot(track[:, 0], track[:, 1], color=VERMILLION, linewidth=0.6, alpha=0.7)
            one.plot([], [], color=VERMILLION, linewidth=1.5, label="tracks")
            one.set_xlim(drawn.extent_m[:2])
            one.set_ylim(drawn.extent_m[2:])
            one.set_aspect("equal")
            one.set_title(drawn.title)
            one.set_xlabel("east / m")
        axes[0].set_ylabel("north / m")
        axes[0].legend(loc="upper left")
        bar = figure.colorbar(image, ax=list(axes), ticks=np.arange(most + 1), shrink=0.85)
        bar.set_label("satellites in line of sight")
        bar.ax.minorticks_off()
        figure.suptitle(title, fontsize=12)
