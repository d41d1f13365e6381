"""A sky over the made cross of streets: six satellites, seen from everywhere on it."""

import numpy as np
import pandas as pd
from cross_world import CRS, walk_log

from mapfilter.gnss.almanacs import joined, nominal_galileo, nominal_gps
from mapfilter.gnss.orbits import gps_time
from mapfilter.simulation.satellites import ReceptionModel, receive
from mapfilter.tracks.log import make_log

START_UTC_S = 1_700_000_000.0
HEIGHTS = {"antenna_height_m": 100.0, "antenna_height_sd_m": 20.0}


def sky_table(truth, seed=0, spoofer=None, **model):
    week, _ = gps_time(START_UTC_S)
    almanac = joined(nominal_gps(week), nominal_galileo(week))
    reception = ReceptionModel(**model)
    rng = np.random.default_rng(seed)
    return receive(truth, CRS, None, almanac, START_UTC_S, reception, rng, spoofer)


def sky_log(seed=0, spoofer=None, legs=None, radio=True, **model):
    """A walk on the cross with pseudoranges."""
    log = walk_log(legs) if legs else walk_log()
    tables = {"motion": log.motion, "truth": log.truth}
    if radio:
        tables["radio"] = log.radio
    ranges = sky_table(log.truth, seed, spoofer, **model)
    return make_log(CRS, pseudoranges=ranges, start_utc_s=START_UTC_S, **tables)


def no_rows(log, table):
    return pd.DataFrame(getattr(log, table)).iloc[:0]
