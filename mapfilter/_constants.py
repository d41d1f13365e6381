"""Constants of nature, units, and the deviation of normal errors by their median."""

from __future__ import annotations

from datetime import UTC, datetime

LIGHT_MPS = 299_792_458.0
GRAVITY_MPS2 = 9.80665

FOOT_M = 0.3048
KMH_MPS, MPH_MPS, KNOT_MPS = 1 / 3.6, 0.44704, 1852 / 3600
HOUR_S, DAY_S = 3600.0, 86_400.0

GPS_EPOCH_S = datetime(1980, 1, 6, tzinfo=UTC).timestamp()
"""UTC seconds (Unix time) at which GPS time is zero."""

MAD_TO_SD = 1.4826
"""Standard deviation of normal errors over the median of their absolute values."""
