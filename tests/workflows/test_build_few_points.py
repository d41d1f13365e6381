"""A build that keeps few points of the roads says how to look at its levels."""

from check_world import base_levels, make_world
from command_line import assert_done, mapfilter, settings


def test_few_points_above_the_floor_are_noted(tmp_path):
    world = make_world(tmp_path, base_levels())
    world.landuse = None
    world.write()
    given = settings(output__pictures="none", output__dir=tmp_path)

    def notes(floor_dbm):
        limit = settings(database__floor_dbm=floor_dbm)
        built = assert_done(mapfilter("build", "-c", world.toml, *given, *limit, "--json"))
        return [note for note in built.json["notes"] if "mapfilter check -c FILE" in note]

    assert notes(-104.0) == []
    (note,) = notes(-55.0)
    assert " points of the roads have a level above the floor (likely: " in note
