"""What a build notes on cells: those that are received nowhere, and those with one identity."""

import csv

import numpy as np
import rasterio
from command_line import assert_done, mapfilter


def notes(world):
    return assert_done(mapfilter("build", "-c", world.toml, "--json")).json["notes"]


def test_a_cell_without_any_level_is_named(own_world):
    assert not any("received at no point" in note for note in notes(own_world))
    with rasterio.open(own_world.rasters, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as source:
        source.write(np.full(source.shape, np.nan, np.float32), 2)
    told = [note for note in notes(own_world) if "received at no point" in note]
    assert told == [
        "1 cell received at no point: B (likely: no data in the raster, or levels below "
        "database.floor_dbm = -104)"
    ]


def test_cells_with_one_identity_are_named(own_world):
    def given(*identities):
        with own_world.plan.open(newline="") as stream:
            rows = list(csv.DictReader(stream))
        for row, identity in zip(rows, identities, strict=False):
            row |= dict(zip(("mcc", "mnc", "lac", "ci"), identity, strict=True))
        with own_world.plan.open("w", newline="") as stream:
            table = csv.DictWriter(stream, rows[0])
            table.writeheader()
            table.writerows(rows)
        return [note for note in notes(own_world) if "identity" in note]

    assert given((244, 91, 10, 1), (244, 91, 10, 2)) == []
    told = ["Reports by identity cannot tell these cells apart: A, B have 244-91-10-1"]
    assert given((244, 91, 10, 1), (244, 91, 10, 1)) == told
