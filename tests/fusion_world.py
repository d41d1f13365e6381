"""The reference cases, and the hybrid problem that they are about."""

import json
from pathlib import Path

import numpy as np

from mapfilter.models.gaussian import stack
from mapfilter.models.pseudorange import pseudoranges
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import MOVING, MOVING_CLOCK
from mapfilter.models.timing_advance import timing_advances

CASES = json.loads((Path(__file__).parent / "fusion_cases.json").read_text(encoding="utf-8"))
LAYOUT = CASES["fk_layout"]


def hybrid(satellites):
    """Pseudoranges, timing advance and levels of Fritsche & Klein (2009)."""
    state = MOVING_CLOCK if satellites else MOVING
    parts = [
        timing_advances(state, LAYOUT["bs"][:1], LAYOUT["s_ta"]),
        levels(
            state, LAYOUT["bs"], LAYOUT["s_rss"], loss_at_km_db=LAYOUT["A"], exponent=LAYOUT["B"],
            eirp_dbm=LAYOUT["Pt"], boresight_rad=np.radians(LAYOUT["boresight_deg_ccw_from_east"]),
            beamwidth_rad=np.radians(LAYOUT["phi3"]), max_attenuation_db=LAYOUT["Am"],
        ),
    ]  # fmt: skip
    if satellites:
        parts.insert(0, pseudoranges(state, LAYOUT["sats"][:satellites], LAYOUT["s_pr"]))
    return stack(parts)


def zhang(combination, sigma_db=4.0):
    """Timing advances and losses of Zhang et al. (2006)."""
    sites, parts = CASES["zhang"]["bts"], []
    if combination in ("both", "ta"):
        parts.append(timing_advances(MOVING, sites, 288.0))
    if combination in ("both", "rss"):
        parts.append(
            levels(MOVING, sites, sigma_db, loss_at_km_db=132.85, exponent=3.8, quantity="loss")
        )
    return stack(parts)
