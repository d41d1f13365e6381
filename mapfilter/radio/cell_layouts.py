"""Layouts of lists of cells: by which names their columns are the fields of a plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

Layout = Literal["plan", "atoll", "opencellid"]

Columns = Mapping[str, tuple[str, ...]]
"""By field, the names that its column may have; the first that is there counts."""

COLUMNS = (
    *("cell", "site", "lat", "lon", "height_m", "azimuth_deg", "downtilt_deg"),
    *("mechanical_downtilt_deg", "antenna", "beamwidth_deg", "max_attenuation_db"),
    *("vertical_beamwidth_deg", "side_lobe_db", "eirp_dbm", "frequency_mhz", "indoor"),
    *("penetration_loss_db", "mcc", "mnc", "lac", "ci", "arfcn", "bsic"),
    *("technology", "assumed"),
)
"""Columns of a file that mapfilter writes, in order."""
OFFSETS = ("east_offset_m", "north_offset_m")
"""Of an antenna from the place that is stated, its site's, which planning tools keep apart; in no
file that mapfilter writes."""
SELDOM = ("technology", "assumed")
"""Those that are left out where no cell has them."""
ATOLL: Columns = {
    "cell": ("TX_ID", "TX_NAME", "TRANSMITTER"),
    "site": ("SITE_NAME", "SITE"),
    "lat": ("LATITUDE",),
    "lon": ("LONGITUDE",),
    "east": ("X",),
    "north": ("Y",),
    "east_offset_m": ("DX",),
    "north_offset_m": ("DY",),
    "height_m": ("HEIGHT",),
    "azimuth_deg": ("AZIMUT", "AZIMUTH"),
    "downtilt_deg": (
        *("ELECTRICAL_TILT", "ELECTRICAL_DOWNTILT"),
        *("ADDITIONAL_ELECTRICAL_DOWNTILT", "REDT"),
    ),
    "mechanical_downtilt_deg": ("TILT", "MECHANICAL_TILT", "MECHANICAL_DOWNTILT"),
    "antenna": ("ANTENNA_NAME", "ANTENNA"),
    "eirp_dbm": ("EIRP",),
    "frequency_mhz": ("FREQUENCY",),
    "mcc": ("MCC",),
    "mnc": ("MNC",),
    "lac": ("LAC",),
    "ci": ("CELL_IDENTITY", "CI"),
    "arfcn": ("CONTROL_CHANNEL", "BCCH"),
    "bsic": (
        *("BSIC", "PHY_CELL_ID", "PHYSICAL_CELL_ID", "PSC"),
        *("PRIMARY_SCRAMBLING_CODE", "SCRAMBLING_CODE"),
    ),
    "technology": ("TECHNOLOGY",),
}
"""Names of fields, and headings that Atoll shows for them, in which blanks stand for underscores
and a unit in brackets may follow."""
TRANSLATED: Columns = {
    "cell": ("ÉMETTEUR",),
    "site": ("STANDORT",),
    "lat": ("BREITENGRAD",),
    "lon": ("LÄNGENGRAD",),
    "height_m": (
        *("HAUTEUR", "HÖHE", "HOEHE", "HÖHE ÜBER GRUND", "MONTAGEHÖHE ÜBER GRUND"),
        *("ANTENNENHÖHE", "ANTENNENHOEHE"),
    ),
    "azimuth_deg": ("HAUPTSTRAHLRICHTUNG",),
    "downtilt_deg": ("DOWNTILT ÉLECTRIQUE", "TILT ÉLECTRIQUE"),
    "mechanical_downtilt_deg": ("DOWNTILT MÉCANIQUE", "TILT MÉCANIQUE"),
    "antenna": ("ANTENNE",),
    "eirp_dbm": ("PIRE",),
    "frequency_mhz": ("FRÉQUENCE", "FREQUENZ"),
    "technology": ("TECHNOLOGIE",),
    "active": ("ACTIF", "AKTIV"),
}
"""French and German names of columns of transmitters, with one meaning each: headings of Atoll in
French, and of lists of sites of authorities."""
HELPERS: Columns = {
    "band": ("FREQUENCY_BAND", "FBAND", "BAND"),
    "enodeb": ("ENODEB_ID", "ENB_ID"),
    "cell_number": ("CELL_ID", "LOCAL_CELL_ID"),
    "active": ("ACTIVE",),
}
"""Columns of planning tools that are no fields, and state some by other means."""
LIKELY: Columns = {
    "arfcn": ("channel", "carrier"),
    "ci": ("enodeb id", "gnodeb id", "cell id", "cid"),
    "bsic": ("scrambling code",),
    "lac": ("location area", "tracking area"),
    "frequency_mhz": ("band",),
    "cell": ("nom",),
    "eirp_dbm": ("puissance", "sendeleistung"),
}
"""Names that a planning tool's heading may hold if it means a field, and that may mean others."""
USUAL: Columns = {
    "cell": ("cell name", "cellname", "cell id"),
    "site": ("site name", "sitename", "site id", "siteid"),
    "lat": ("latitude",),
    "lon": ("longitude", "lng", "long"),
    "east": ("easting", "x"),
    "north": ("northing", "y"),
}
"""Names by which other tables know fields that every plan needs."""
OPENCELLID: Columns = {
    "technology": ("radio",),
    "lat": ("lat",),
    "lon": ("lon",),
    "mcc": ("mcc",),
    "mnc": ("net", "mnc"),
    "lac": ("area", "lac"),
    "ci": ("cell", "cellid"),
}
OPENCELLID_HEADER = (
    *("radio", "mcc", "net", "area", "cell", "unit", "lon", "lat", "range", "samples"),
    *("changeable", "created", "updated", "averageSignal"),
)
"""Of the downloads of OpenCellID and of the Mozilla Location Service; the former leave it out."""
ALIASES: Columns = {
    "lac": ("tac",),
    "ci": ("eci", "nci"),
    "arfcn": ("uarfcn", "earfcn", "nr_arfcn", "nrarfcn", "narfcn"),
    "bsic": ("psc", "pci"),
    "cgi": ("cgi", "ecgi", "ncgi"),
}
"""Names by technology; a plan may have several of a field, each filled in some rows. A ``cgi`` is
mcc, mnc, lac and ci in one text."""
OF_CARRIERS = {
    "uarfcn": "UMTS",
    "earfcn": "LTE",
    **dict.fromkeys(("nr_arfcn", "nrarfcn", "narfcn"), "NR"),
}
IMPLIED = {**OF_CARRIERS, "psc": "UMTS"}
"""Technologies that values in columns of these names imply: of carriers in any table, as phones
write a PCI as ``psc``, too; and in a plan."""
POSITIONS: Columns = {
    "lat": ("lat", "lat_deg"),
    "lon": ("lon", "lon_deg"),
    "east": ("east", "east_m"),
    "north": ("north", "north_m"),
}
"""Columns of positions in a plan, of which a table has one name each: as in plans, as in logs."""
_OWN: Columns = {
    **{name: (name,) for name in (*COLUMNS, "crs", *OFFSETS)},
    **POSITIONS,
    **{name: (*((name,) if name in COLUMNS else ()), *more) for name, more in ALIASES.items()},
}
LAYOUTS: Mapping[Layout, Columns] = {
    "plan": _OWN,
    "atoll": {
        name: (*ATOLL.get(name, ()), *own, *TRANSLATED.get(name, ()))
        for name, own in {**_OWN, **HELPERS}.items()
    },
    "opencellid": OPENCELLID,
}
