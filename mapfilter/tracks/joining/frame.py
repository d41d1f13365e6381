"""The projected CRS of a log, and how positions of recordings come into it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from pyproj import Transformer

from mapfilter._crs_reach import project_within
from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import grid_convergence_rad, project, projected_crs, unproject, utm_crs
from mapfilter.tracks.joining.position_units import continuous_deg, near_deg
from mapfilter.tracks.readers.recorded.recording import Recording

_LOCAL = "+proj=tmerc +lat_0={lat} +lon_0={lon} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +type=crs"


class Frame:
    """The CRS of the log, and how positions of recordings come into it."""

    def __init__(
        self,
        recordings: Sequence[Recording],
        crs: str,
        origin_deg: tuple[float, float] | None,
        about_deg: tuple[float, float] | None = None,
    ) -> None:
        self.notes: list[str] = []
        self.local = ""
        places = [
            r.tables[name][["lat_deg", "lon_deg"]]
            for r in recordings
            for name in ("positions", "truth")
            if name in r.tables
        ]
        own = [r for r in recordings if not r.crs and {"places", "true_places"} & set(r.tables)]
        stated = [r.crs for r in recordings if r.crs]
        self.lat_deg, self.lon_deg = float("nan"), float("nan")
        # Without positions it places headings, but a frame of no place has north alone.
        placed = bool(own or (crs and not (places or stated)))
        if places:
            every = pd.concat(places)
            middle = every.assign(lon_deg=continuous_deg(every["lon_deg"])).median()
            self.lat_deg = float(middle["lat_deg"])
            self.lon_deg = float(near_deg(middle["lon_deg"], 0.0))
        elif origin_deg is not None and placed:
            self.lat_deg, self.lon_deg = origin_deg
        if origin_deg is not None:
            self.local = _LOCAL.format(lat=origin_deg[0], lon=origin_deg[1])
        if crs:
            self.crs = projected_crs(crs, "--crs")
        elif own and (origin_deg is not None or not places):
            lat, lon = origin_deg or (0.0, 0.0)
            self.crs = projected_crs(_LOCAL.format(lat=lat, lon=lon))
            if origin_deg is None:
                self.notes.append(
                    f"{own[0].name}: metres in a frame of its own, placed at latitude 0 and "
                    "longitude 0; see --origin and --crs"
                )
        elif stated:
            self.crs = projected_crs(stated[0])
        elif places:
            self.crs = utm_crs(self.lon_deg, self.lat_deg)
        else:
            self.crs = projected_crs(_LOCAL.format(lat=0, lon=0))
            self.notes.append("no positions: the CRS of the log is a local frame")
        if origin_deg is not None and not placed:
            self.notes.append("--origin has no effect: no positions in metres of a local frame")
        if (crs or stated) and not np.isfinite(self.lat_deg):
            self.lat_deg, self.lon_deg = self._middle_deg(recordings)
        if crs and not np.isfinite(self.lat_deg) and about_deg is not None:
            self.lat_deg, self.lon_deg = about_deg
        if own and places and origin_deg is None and not crs:
            names = ", ".join(r.name for r in own)
            expected = "one frame of positions"
            got = "degrees in one file, metres in a frame of its own in this one"
            raise fail(InputError, names, expected, got, "give --origin LAT,LON of the frame")

    @property
    def convergence_rad(self) -> float:
        """Clockwise angle from true north to grid north; 0 where the place is unknown."""
        if not np.isfinite(self.lat_deg):
            return 0.0
        return grid_convergence_rad(self.crs, self.lon_deg, self.lat_deg)

    def _middle_deg(self, recordings: Sequence[Recording]) -> tuple[float, float]:
        """Return latitude and longitude of the middle of places in metres.

        NaN without any, or where the CRS of the log has no such place.
        """
        tables = [
            self.east_north(r.tables[name], r.crs)
            for r in recordings
            for name in ("places", "true_places")
            if name in r.tables
        ]
        if tables:
            lon, lat = unproject(self.crs, *np.median(np.concatenate(tables, axis=1), axis=1))
            if not project_within(self.crs, lon, lat)[2].any():
                return float(lat), float(lon)
        return float("nan"), float("nan")

    def east_north(self, rows: pd.DataFrame, crs: str) -> tuple[Floats, Floats]:
        """Return positions of a table in the log's CRS; ``crs`` is that of its metres."""
        if "lat_deg" in rows:
            return project(self.crs, rows["lon_deg"], rows["lat_deg"])
        east, north = rows["east_m"].to_numpy(), rows["north_m"].to_numpy()
        source = crs or self.local
        if not source or source == self.crs:
            return east, north
        moved = Transformer.from_crs(source, self.crs, always_xy=True).transform(east, north)
        return np.asarray(moved[0], dtype=np.float64), np.asarray(moved[1], dtype=np.float64)
