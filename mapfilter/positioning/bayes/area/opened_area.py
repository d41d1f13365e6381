"""The area of a database, opened as a whole, or by tiles where it is large."""

from __future__ import annotations

from mapfilter.database.cell_levels import received_cells
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.radio.layers import layers_of

WHOLE_VALUES = 100_000_000
"""Most levels of an area that is held whole: of each pixel those of the received cells, and two of
each layer."""


def open_area(database: RadioRouteDatabase, *, whole: bool = False) -> AreaFrame:
    """Return the map that the filter looks up: of a whole database, or of a large one by tiles.

    Larger areas than :data:`WHOLE_VALUES` are held by tiles unless they have to be ``whole``, or
    no cell has a level anywhere.
    """
    lattice, received = database.lattice, received_cells(database)
    bands = len(received) + 2 * len(set(layers_of(database.plan, received)))
    values = lattice.rows * lattice.cols * bands
    if received and values > WHOLE_VALUES and not whole:
        return TiledArea.of_database(database)
    return AreaMap.of_field(database.field(), database.plan, database.floor_dbm)
