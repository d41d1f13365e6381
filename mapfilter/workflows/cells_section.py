"""The section ``[cells]``: a cell plan, or how one is laid out."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mapfilter.workflows.fields import FilePath, Finite, NotNegative, Positive, Section, Seed


class CellColumns(Section):
    """``[cells.columns]``: names of a list's columns, where they differ from the plan's."""

    cell: str | None = None
    site: str | None = None
    lat: str | None = None
    lon: str | None = None
    east: str | None = None
    north: str | None = None
    crs: str | None = None
    height_m: str | None = None
    azimuth_deg: str | None = None
    downtilt_deg: str | None = None
    mechanical_downtilt_deg: str | None = None
    antenna: str | None = None
    beamwidth_deg: str | None = None
    max_attenuation_db: str | None = None
    vertical_beamwidth_deg: str | None = None
    side_lobe_db: str | None = None
    eirp_dbm: str | None = None
    frequency_mhz: str | None = None
    indoor: str | None = None
    penetration_loss_db: str | None = None
    mcc: str | None = None
    mnc: str | None = None
    lac: str | None = None
    ci: str | None = None
    arfcn: str | None = None
    bsic: str | None = None


class Cells(Section):
    """``[cells]``: a cell plan from a file, or laid out by rule over the area.

    ``antennas`` is the folder of the pattern files that the plan names. ``layout`` and ``columns``
    are for lists of others; there, frequency, EIRP and height are those of cells that tell none,
    and cells of OpenCellID farther than ``reach_m`` from the area are left out.
    """

    plan: FilePath | None = None
    layout: Literal["plan", "atoll", "opencellid"] = "plan"
    reach_m: NotNegative = 5000.0
    antennas: FilePath | None = None
    sites: Annotated[int, Field(ge=1, le=1000)] = 2
    sectors: Annotated[int, Field(ge=1, le=6)] = 3
    indoor: Annotated[int, Field(ge=0, le=1000)] = 4
    frequency_mhz: Positive = 1800.0
    eirp_dbm: Finite = 52.0
    height_m: Positive = 30.0
    seed: Seed = 0
    columns: CellColumns = CellColumns()
