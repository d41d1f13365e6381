"""The sections of a configuration about buildings, and about ways and squares."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from mapfilter.config.fields import (
    Count,
    FilePath,
    Files,
    Section,
)
from mapfilter.options import NotNegative, Positive
from mapfilter.roads.defaults import (
    DEFAULT_HEIGHT_M,
    MAX_ACCURACY_M,
    MAX_GAP_M,
    STOREY_HEIGHT_M,
)


class BuildingsSection(Section):
    """``[buildings]``: where buildings come from, and how high they are.

    Parameters
    ----------
    default_height_m : float
        Height of a building without height and storeys.
    storey_m : float
        Height of a storey.
    layer : Path, optional
        Vector file, in any format of GDAL, that replaces the buildings of the map.
    layer_name : str, optional
        Layer of a file with several.
    height_column : str, optional
        Column of heights in metres.
    levels_column : str, optional
        Column of numbers of storeys, used where there is no height.
    """

    default_height_m: Positive = DEFAULT_HEIGHT_M
    storey_m: Positive = STOREY_HEIGHT_M
    layer: FilePath | None = None
    layer_name: str | None = None
    height_column: str | None = None
    levels_column: str | None = None

    @model_validator(mode="after")
    def _columns_go_with_a_layer(self) -> BuildingsSection:
        named = (self.layer_name, self.height_column, self.levels_column)
        if self.layer is None and named != (None, None, None):
            raise ValueError("layer with layer_name, height_column and levels_column")
        return self


class Tracks(Section):
    """``[roads.tracks]``: measurements whose tracks replace the ways, where there is no map.

    Parameters
    ----------
    files : list of Path
        Files or folders, in the format and with the columns of ``[prediction.survey]``.
    max_accuracy_m : float
        Less accurate positions are left out.
    max_gap_m : float
        Positions farther apart are not joined to a way.
    min_sessions : int
        Ways that fewer sessions passed are left out.
    """

    files: Files = ()
    max_accuracy_m: Positive = MAX_ACCURACY_M
    max_gap_m: Positive = MAX_GAP_M
    min_sessions: Count = 1


class Roads(Section):
    """``[roads]``: ways and squares of the map.

    Parameters
    ----------
    profile : {"walking", "driving"}
        Ways that count. Of a ``layer``, driving leaves out the classes that OpenStreetMap has for
        ways on foot (``footway``, ``cycleway``, ``path``, ``track``, ``steps``, …), unless
        ``half_width_by_class_m`` names them; other words and numbers are kept, with a note.
    half_width_m : float
        Points as near as this to the centre line of a way belong to it.
    half_width_by_class_m : dict
        In place of ``half_width_m`` for some classes of way, such as ``steps``; 0 leaves a class
        out.
    squares : bool
        Whether pedestrian squares count (walking).
    cut_buildings : bool
        Whether points inside buildings are removed.
    cut_water : bool
        Whether points in rivers and lakes are removed, except on bridges.
    water_layer : Path, optional
        Vector file of further water, such as the sea.
    water_layer_name : str, optional
        Layer of a file with several.
    layer : Path, optional
        Vector file, in any format of GDAL, that replaces the ways and squares of the map.
    layer_name : str, optional
        Layer of a file with several.
    class_column : str, optional
        Column of the class of way.
    id_column : str, optional
        Column of the number of the way; by default the file's own, from 1.
    raster : Path, optional
        Raster of roads that replaces the ways and squares of the map.
    raster_classes : dict
        Value of its pixels for each class of way, such as ``residential = 1``; others are no roads.
    landuse : Path, optional
        Land-use raster that alone decides which points belong to the map; ways only name them.
    landuse_table : Path, optional
        Table (CSV) of its codes.
    """

    profile: Literal["walking", "driving"] = "walking"
    half_width_m: Positive = 6.0
    half_width_by_class_m: dict[str, NotNegative] = Field(default_factory=dict)
    squares: bool = True
    cut_buildings: bool = True
    cut_water: bool = True
    water_layer: FilePath | None = None
    water_layer_name: str | None = None
    layer: FilePath | None = None
    layer_name: str | None = None
    class_column: str | None = None
    id_column: str | None = None
    raster: FilePath | None = None
    raster_classes: dict[str, int] = Field(default_factory=dict)
    landuse: FilePath | None = None
    landuse_table: FilePath | None = None
    tracks: Tracks = Tracks()

    @model_validator(mode="after")
    def _what_goes_together(self) -> Roads:
        if (self.landuse is None) != (self.landuse_table is None):
            raise ValueError("landuse and landuse_table together")
        named = (self.layer_name, self.class_column, self.id_column)
        if self.layer is None and named != (None, None, None):
            raise ValueError("layer with layer_name, class_column and id_column")
        if self.water_layer is None and self.water_layer_name is not None:
            raise ValueError("water_layer with water_layer_name")
        if (self.raster is None) != (not self.raster_classes):
            raise ValueError("raster and raster_classes together")
        if (self.layer is not None) + (self.raster is not None) + bool(self.tracks.files) > 1:
            raise ValueError("one of layer, raster and tracks.files")
        return self

    @property
    def replace_map(self) -> bool:
        """Whether ways come from elsewhere than the map."""
        return self.layer is not None or self.raster is not None or bool(self.tracks.files)
