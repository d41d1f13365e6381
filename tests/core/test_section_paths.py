"""Options that are files: keys of the configuration whose paths are relative to it."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from pydantic import ValidationError

from mapfilter.config.fields import Section, with_options
from mapfilter.config.load import load_config
from mapfilter.options import Options


@dataclass(frozen=True, slots=True)
class Terrain(Options):
    """Terrain.

    Parameters
    ----------
    heights : Path, optional
        Raster of heights.
    table : Path
        Table of heights.
    """

    heights: Path | None = None
    table: Path = Path("heights.csv")


@with_options(Terrain)
class TerrainSection(Section):
    """``[terrain]``: heights."""


@with_options(Terrain, optional=True)
class OtherSection(Section):
    """``[other]``: heights."""


@pytest.mark.parametrize("section", [TerrainSection, OtherSection])
def test_paths_are_relative_to_the_file(section, tmp_path):
    values = {"heights": "dem.tif", "table": str(tmp_path / "table.csv")}
    found = section.model_validate(values, context={"folder": tmp_path / "area"}).of(Terrain)
    assert found == Terrain(tmp_path / "area" / "dem.tif", tmp_path / "table.csv")


def test_paths_beside_the_folder_of_the_file_are_written_without_dots(tmp_path):
    folder = tmp_path / "area"
    values = {"heights": "../dem.tif", "table": str(folder / ".." / "table.csv")}
    found = TerrainSection.model_validate(values, context={"folder": folder}).of(Terrain)
    assert found == Terrain(tmp_path / "dem.tif", tmp_path / "table.csv")


def test_the_folder_above_a_link_is_that_of_its_target(tmp_path):
    (tmp_path / "far" / "area").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "far" / "area")
    values = {"table": "../table.csv"}
    found = TerrainSection.model_validate(values, context={"folder": tmp_path / "link"})
    assert found.of(Terrain).table == tmp_path / "far" / "table.csv"


@pytest.mark.parametrize("given", ["../plans/table.csv", "../area/../plans/table.csv"])
def test_links_into_a_store_of_data_keep_their_names(given, tmp_path):
    for name in ("store", "area"):
        (tmp_path / name).mkdir()
    (tmp_path / "store" / "9f3ac1").write_text("cell\n", encoding="utf-8")
    (tmp_path / "store" / "77b0.dir").mkdir()
    (tmp_path / "store" / "77b0.dir" / "table.csv").symlink_to(tmp_path / "store" / "9f3ac1")
    (tmp_path / "plans").symlink_to(tmp_path / "store" / "77b0.dir")
    found = TerrainSection.model_validate({"table": given}, context={"folder": tmp_path / "area"})
    assert found.of(Terrain).table == tmp_path / "plans" / "table.csv"


def test_the_folder_above_is_named_without_dots(tmp_path):
    (tmp_path / "area").mkdir()
    found = TerrainSection.model_validate({"table": ".."}, context={"folder": tmp_path / "area"})
    assert found.of(Terrain).table == tmp_path


def test_without_a_path_there_is_the_default():
    assert TerrainSection().of(Terrain) == Terrain()
    assert OtherSection().table is None
    with pytest.raises(ValidationError):
        TerrainSection.model_validate({"heights": 5})


def test_paths_of_settings_that_are_called_like_maps_are_of_the_working_folder(
    tmp_path, monkeypatch
):
    (tmp_path / "areas").mkdir()
    area = tmp_path / "areas" / "area.toml"
    area.write_text('[area]\nmap = "helsinki"\n')
    monkeypatch.chdir(tmp_path)
    settings = ["database.path=helsinki", 'track.recordings=["none"]']
    config = load_config(area, settings)
    assert config.database.path == tmp_path / "helsinki"
    assert config.track.recordings == (tmp_path / "none",)
    assert config.area.map == "helsinki"
    assert load_config(area, ["area.map=manhattan"]).area.map == "manhattan"
