"""The sections ``[buildings]`` and ``[roads]``: where houses are, and where one can be."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from mapfilter.workflows.fields import FilePath, NotNegative, Positive, Section
from mapfilter.workflows.survey_section import Files


class BuildingsSection(Section):
    """``[buildings]``: heights of buildings without one, how storeys count, and where they are.

    ``layer`` is a vector file that replaces the buildings of the map.
    """

    default_height_m: Positive = 12.0
    storey_m: Positive = 3.2
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

    Their format and columns are those of ``[prediction.survey]``.
    """

    files: Files = ()
    max_accuracy_m: Positive = 50.0
    max_gap_m: Positive = 100.0
    min_sessions: Annotated[int, Field(ge=1, le=1_000_000)] = 1


class Roads(Section):
    """``[roads]``: where one can be.

    A vector file (``layer``) or ``tracks`` replace the ways and squares of the map. A land-use
    raster (``landuse`` with its ``landuse_table``) decides alone; ways then only name its points.
    ``half_width_by_class_m`` replaces ``half_width_m`` for some kinds of way; 0 leaves them out.
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
        if self.layer is not None and self.tracks.files:
            raise ValueError("layer, or tracks.files, not both")
        return self
