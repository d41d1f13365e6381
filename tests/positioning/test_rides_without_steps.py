"""Walkers who take a bus: the steps of a pedometer's log end, but for single ones, and go on."""

import numpy as np
from made_town import Town, slowed, walk_log

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

FROM_M, TO_M, FASTER = 1200.0, 2000.0, 6.0
ROWS_M = 5.0


def ridden(log, every_row):
    """Return a walk of 1.25 m/s with a ride between, of which a row now and then is a step."""
    ends_s = [way_m / ROWS_M * 4.0 for way_m in (FROM_M, TO_M)]

    def at(time_s):
        inside = np.clip(time_s, *ends_s) - ends_s[0]
        return time_s - inside * (1 - 1 / FASTER)

    motion = log.motion
    ride = motion["time_s"].between(*ends_s, inclusive="neither").to_numpy()
    single = np.arange(len(motion)) % every_row == 0
    motion = motion.assign(step_m=np.where(ride, 0.6, motion["step_m"]))[~ride | single]
    # Steps come when they are made: at no fixed intervals.
    jitter_s = np.random.default_rng(1).uniform(-1.0, 1.0, len(motion))
    tables = {"motion": motion.assign(time_s=motion["time_s"] + jitter_s)}
    tables |= {"radio": log.radio, "truth": log.truth}
    moved = {name: rows.assign(time_s=at(rows["time_s"])) for name, rows in tables.items()}
    return make_log(log.crs, **moved), at(ends_s[0]), at(ends_s[1])


def test_rides_are_noticed_and_most_walks_after_them_are_found():
    """Nothing wrong is claimed in any town; a walk may end before it is found again."""
    found = 0
    for seed in (1, 2, 3):
        town = Town.of(seed)
        log, from_s, to_s = ridden(slowed(walk_log(town, seed, 3400.0)), every_row=11)
        positioner = BayesFilter(claim_mass=0.95).over_area(town.area())
        track = locate(log, positioner, np.random.default_rng(seed)).estimate
        place_m = [
            np.interp(track.time_s, log.truth["time_s"], log.truth[name])
            for name in ("east_m", "north_m")
        ]
        error_m = np.hypot(track.east_m - place_m[0], track.north_m - place_m[1])
        claimed = np.array([one in (Status.CONVERGED, Status.TRACKING) for one in track.status])
        off_s = track.time_s[claimed & (error_m > 50)]
        assert ((off_s > from_s) & (off_s < from_s + 60)).all()
        assert not claimed[(track.time_s > from_s + 60) & (track.time_s < to_s)].any()
        found += claimed[-1] and error_m[-1] < 20
    assert found >= 2
