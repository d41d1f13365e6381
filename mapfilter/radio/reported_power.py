"""Which part of a cell's power phones report, and how well usual values stand for unknown ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from mapfilter.errors import ConfigError, fail

REPORTED_SHARE_DB: Final[Mapping[str, float]] = {
    "GSM": 0.0,
    "UMTS": 10.0,
    "LTE": 29.5,
    "NR": 32.0,
}
"""By how much what phones report is below the power of the carrier, by technology.

RxLev is that of the whole BCCH carrier. RSCP is that of the pilot, a tenth of a carrier's power.
RSRP and SS-RSRP are those of one subcarrier: 10 log10(12 N), with N resource blocks. That is 27.8,
29.5 and 30.8 dB with 10, 15 and 20 MHz of LTE, and 27.9 to 35.2 dB of NR.
"""

ASSUMABLE: Final = ("height_m", "azimuth_deg", "eirp_dbm")
"""Fields of a cell that public lists lack, so that usual values stand for them."""


def reported_eirp_dbm(carrier_dbm: float, technology: str | None) -> float:
    """Return the EIRP of what phones report, of the EIRP of a carrier.

    Parameters
    ----------
    carrier_dbm : float
        Of the whole carrier, antenna gain included.
    technology : {"GSM", "UMTS", "LTE", "NR"} or None
        None, where it is unknown, leaves the power as it is.

    Raises
    ------
    ConfigError
        There is no such technology.

    Examples
    --------
    >>> [reported_eirp_dbm(58.0, technology) for technology in ("GSM", "LTE", None)]
    [58.0, 28.5, 58.0]
    """
    if technology is None:
        return carrier_dbm
    if technology not in REPORTED_SHARE_DB:
        raise fail(ConfigError, "technology", ", ".join(REPORTED_SHARE_DB), repr(technology))
    return carrier_dbm - REPORTED_SHARE_DB[technology]
