"""The satellites of one epoch over a place, and the white noise of their pseudoranges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.filters.contract import Reason
from mapfilter.gnss.sky import GridFrame, directions
from mapfilter.positioning.epochs import Epoch, Pseudorange
from mapfilter.positioning.gnss.options import GnssOptions

Unused = tuple[str, str, Reason]
"""Kind and name of a reading left out, and why."""


@dataclass(frozen=True, eq=False)
class Sky:
    """Satellites (m, 3) received at one epoch, in true east, north and up about a place.

    ``sigma_m`` are standard deviations of the pseudoranges' noise, NaN if not reported;
    ``origin_m`` is the place in the frame of the hypotheses, and ``true_from_grid`` (2, 2) the
    rotation by the grid convergence.
    """

    names: tuple[str, ...]
    satellites_m: Floats
    elevation_rad: Floats
    range_m: Floats
    sigma_m: Floats
    origin_m: tuple[float, float]
    true_from_grid: Floats

    def only(self, chosen: Bools) -> Sky:
        """Return the chosen satellites."""
        return replace(
            self,
            names=tuple(np.array(self.names)[chosen].tolist()),
            satellites_m=self.satellites_m[chosen],
            elevation_rad=self.elevation_rad[chosen],
            range_m=self.range_m[chosen],
            sigma_m=self.sigma_m[chosen],
        )


def sky_over(
    options: GnssOptions,
    crs: str,
    origin_m: tuple[float, float],
    epoch: Epoch,
    middle_m: tuple[float, float],
) -> tuple[Sky | None, tuple[Unused, ...]]:
    """Return the satellites of an epoch over a place, and the readings left out.

    ``origin_m`` is that of the frame of the hypotheses, in the map's CRS; ``middle_m`` the place,
    in that frame.
    """
    unused = list[Unused]()
    chosen: dict[str, Pseudorange] = {}
    for row in epoch.pseudoranges:
        if not isfinite(row.pseudorange_m):
            continue
        if row.satellite in chosen:
            unused.append(("pseudorange", row.satellite, Reason.SECOND_READING))
        elif not all(isfinite(value) for value in row.place_m):
            unused.append(("pseudorange", row.satellite, Reason.UNKNOWN_SATELLITE))
        else:
            chosen[row.satellite] = row
    if not chosen:
        return None, tuple(unused)
    east, north = middle_m[0] + origin_m[0], middle_m[1] + origin_m[1]
    frame = GridFrame(crs, east, north, options.height_m)
    local = frame.local.to_local(np.array([row.place_m for row in chosen.values()]))
    seen = directions(local)
    sky = Sky(
        tuple(chosen),
        local,
        seen.elevation_rad,
        np.array([row.pseudorange_m for row in chosen.values()]),
        np.array([row.sigma_m for row in chosen.values()]),
        middle_m,
        frame.true_from_grid,
    )
    up = seen.above(options.mask_deg)
    for name in np.array(sky.names)[~up].tolist():
        unused.append(("pseudorange", name, Reason.BELOW_HORIZON))
    return (sky.only(up) if up.any() else None), tuple(unused)


def range_sigma_m(options: GnssOptions, sky: Sky, particle_spacing_m: float) -> Floats:
    """Return standard deviations of the white noise of pseudoranges.

    The hypotheses nearest to the true position lie up to ``particle_spacing_m`` from it.
    """
    by_elevation = options.zenith_m / np.sin(sky.elevation_rad)
    white = np.where(np.isfinite(sky.sigma_m), sky.sigma_m, by_elevation)
    beside = particle_spacing_m * np.cos(sky.elevation_rad)
    return np.asarray(np.hypot(white, beside))
