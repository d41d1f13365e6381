"""A small made area to draw, with estimates over it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.lattice import Lattice
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report.basemap import BaseMap

CRS = "EPSG:32635"


WEST_M, NORTH_M = 385_000.0, 6_672_000.0


@dataclass(frozen=True)
class Area:
    lattice: Lattice
    base: BaseMap
    plan: CellPlan
    truth: Truth


def estimate(area: Area, switch_s: float | None, error_m: float = 10.0) -> TrackEstimate:
    """Every fifth second; located from ``switch_s`` on, ``error_m`` north of the truth."""
    fixes = []
    for time_s in area.truth.time_s[::5].tolist():
        on = switch_s is not None and time_s >= switch_s
        status = Status.SEARCHING
        if on:
            status = Status.CONVERGED if time_s - 5.0 < switch_s else Status.TRACKING
        east, north = area.truth.at(time_s)
        fixes.append(
            Fix(
                time_s, float(east) if on else np.nan, float(north) + error_m if on else np.nan,
                np.full((2, 2), np.nan), np.full(3, np.nan), status, 7, np.nan, 0, np.nan,
                Reason.USED,
            )
        )  # fmt: skip
    return TrackEstimate.of_fixes(CRS, "candidate", fixes)


def png_size(path: Path) -> tuple[int, int]:
    """Width and height from the header of a whole PNG file."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-8:-4] == b"IEND"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def pixels_near(path: Path, colour: str) -> int:
    """Count the pixels of a colour, to within the rounding of its channels."""
    image = imread(path)[:, :, :3]
    return int((np.abs(image - to_rgb(colour)).max(axis=2) < 0.02).sum())


def drawn_area() -> Area:
    """A street with a walk along it, cells of a site, one indoors and one far away."""
    lattice = Lattice(CRS, WEST_M, NORTH_M, 5.0, 80, 100)
    west, south, east, _ = lattice.bounds_m
    street = np.array([[west, south + 100.0], [east, south + 100.0]])
    base = BaseMap(lattice.bounds_m, (street,), attribution="© OpenStreetMap contributors")
    common = {"north_m": south + 200.0, "height_m": 30.0, "eirp_dbm": 55.0, "frequency_mhz": 1800.0}
    cells = (
        Cell(id="S1A", site="S1", east_m=west + 250.0, azimuth_deg=90.0, **common),
        Cell(id="S1$B$", site="S1", east_m=west + 250.0, azimuth_deg=270.0, **common),
        Cell(id="I1", site="I1", east_m=west + 50.0, azimuth_deg=None, antenna="omni", indoor=True,
             **common),
        Cell(id="far", site="far", east_m=west - 9000.0, azimuth_deg=0.0, **common),
    )  # fmt: skip
    time_s = np.arange(0.0, 301.0)
    truth = Truth(time_s, west + 20.0 + 1.4 * time_s, np.full(301, south + 100.0))
    return Area(lattice, base, CellPlan(CRS, cells), truth)
