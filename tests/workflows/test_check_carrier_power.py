"""Plans of LTE with the power of a whole carrier are warned of before anything is predicted."""

import pytest
from check_world import make_world
from command_line import mapfilter, settings


@pytest.fixture
def world(tmp_path, levels):
    world = make_world(tmp_path, levels)
    world.landuse = None
    for row in world.rows:
        row |= {"technology": "LTE", "eirp_dbm": 55.0}
    return world


def found(world, *given):
    findings = mapfilter("check", "-c", world.toml, "--json", *given).json["findings"]
    return [one for one in findings if one["code"] == "eirp-of-carrier"]


def test_before_a_prediction(world):
    """Check found nothing wrong, and predict wrote levels that were 30 dB too high."""
    world.levels = {}
    world.write()
    world.toml.write_text(world.toml.read_text().partition("[rasters]")[0])
    (finding,) = found(world)
    assert finding["severity"] == "warning"
    assert "EIRP of up to 55 dBm for 10 of 10 cells" in finding["evidence"]
    assert "28 to 35 dB" in finding["remedy"]
    for row in world.rows:
        row["eirp_dbm"] = 25.0
    world.write()
    world.toml.write_text(world.toml.read_text().partition("[rasters]")[0])
    assert found(world) == []


def test_rasters_of_losses_need_it_and_those_of_levels_do_not(world):
    """Losses whose file states its unit, without a setting, were taken for levels."""
    world.write()
    assert found(world) == []
    world.quantity = "loss"
    world.each(lambda levels: 55.0 - levels)
    world.write()
    (finding,) = found(world)
    assert finding["severity"] == "warning"
    assert found(world, *settings(rasters__quantity="level")) == []
    assert len(found(world, *settings(rasters__quantity="loss"))) == 1
