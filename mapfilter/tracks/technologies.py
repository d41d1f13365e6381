"""Largest values of carriers, codes and timing advances by radio technology.

3GPP TS 45.005 and 45.010 (GSM), 25.101 and 25.213 (UMTS), 36.101, 36.211 and 36.213 (LTE), 38.104,
38.211 and 38.213 (NR).
"""

from __future__ import annotations

LIMITS: dict[str, dict[str, int]] = {
    "GSM": {"arfcn": 1023, "bsic": 63, "lac": 65_535, "ci": 65_535, "timing_advance": 219},
    "UMTS": {"arfcn": 16_383, "bsic": 511, "lac": 65_535, "ci": 2**28 - 1},
    "LTE": {"arfcn": 262_143, "bsic": 503, "lac": 65_535, "ci": 2**28 - 1, "timing_advance": 1282},
    "NR": {
        "arfcn": 3_279_165,
        "bsic": 1007,
        "lac": 2**24 - 1,
        "ci": 2**36 - 1,
        "timing_advance": 3846,
    },
}
"""Columns ``arfcn`` (ARFCN, UARFCN, EARFCN, NR-ARFCN), ``bsic`` (BSIC, PSC, PCI), ``lac`` (LAC,
TAC), ``ci`` (CI, ECI, NCI) and ``timing_advance`` of the table ``radio``."""
