"""What a merged database says of its sources: names that differ, and cells with other values."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_world import FLOOR_DBM, LATTICE, levels_of, make_plan, make_routes

from mapfilter.database.build import build
from mapfilter.database.merge import merge
from mapfilter.database.merge_notes import merge_notes, names_apart
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters


@pytest.fixture
def built(tmp_path):
    """Build a database of a plan in a folder of its own, called as usual."""

    def of(name, plan):
        folder = tmp_path / name
        losses = ((cell, np.float32(50) - level) for cell, level in levels_of(plan, seed=3))
        write_rasters(folder / "rxlev.tif", LATTICE, losses, plan.ids, quantity="loss")
        rasters = open_rasters(folder / "rxlev.tif")
        return build(rasters, plan, make_routes(), folder / "database", floor_dbm=FLOOR_DBM)

    return of


def changed(plan, **cells):
    """Return a plan in which some cells, by their numbers, have other values."""
    new = [
        replace(cell, **cells.get(f"cell{number}", {})) for number, cell in enumerate(plan.cells)
    ]
    return CellPlan(plan.crs, tuple(new))


def test_cells_that_differ_are_noted_with_both_values(built, tmp_path):
    plan = make_plan()
    newer = changed(
        plan,
        cell0={"azimuth_deg": 250.0, "antenna": "sector", "eirp_dbm": 47.5},
        cell1={"arfcn": 612},
    )
    databases = built("north", plan), built("south", newer)
    (note,) = merge_notes(databases)
    one, other = plan.cells[:2]
    azimuth = "none" if one.azimuth_deg is None else f"{one.azimuth_deg:g}"
    assert note.startswith(
        "south/database: 2 cells differ from an earlier database, and the later entry is kept: "
        f"{one.id} (azimuth_deg {azimuth}, now 250, eirp_dbm {one.eirp_dbm:g}, now 47.5"
    )
    before = "none" if other.arfcn is None else other.arfcn
    assert note.endswith(f"{other.id} (arfcn {before}, now 612)")
    assert merge_notes([databases[0], databases[0]]) == ()
    merged = merge(databases, tmp_path / "merged")
    assert merged.plan.cells[0].eirp_dbm == 47.5
    names = [one["name"] for one in merged.manifest["inputs"]]
    assert names == ["north/database", "south/database"]


def test_of_many_cells_that_differ_six_are_named(built):
    """An empty value is called so."""
    plan = make_plan(tuple(f"C{number}" for number in range(9)))
    newer = changed(plan, **{f"cell{number}": {"assumed": "eirp_dbm"} for number in range(1, 9)})
    (note,) = merge_notes([built("north", plan), built("south", newer)])
    shown = ", ".join(f"C{number} (assumed none, now eirp_dbm)" for number in range(1, 7))
    assert note.endswith(f"8 cells differ from an earlier database, and the later entry is kept: "
                         f"{shown} and 2 more")  # fmt: skip


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["/x/a", "/y/b"], ["a", "b"]),
        (["/x/a", "/y/a"], ["x/a", "y/a"]),
        (["/x/z/a", "/y/z/a", "/y/z/b"], ["x/z/a", "y/z/a", "y/z/b"]),
        (["/x/database"], ["x/database"]),
        (["/x/a", "/x/a"], ["a", "a"]),
        (["/x/database", "/x/y/a"], ["x/database", "y/a"]),
        (["/a", "/x/a"], ["/a", "x/a"]),
    ],
)
def test_names_tell_databases_apart(paths, names):
    assert names_apart([Path(path) for path in paths]) == names
