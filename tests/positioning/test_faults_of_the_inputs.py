"""Each fault of plan, prediction, map, phone and sensors, and the option that is its remedy.

On a walk of 500 m from a known start the filter stays right by its defaults. Without the remedy it
is wrong or gives up, though not on the same walk without the fault. Disturbed headings and long
steps do not lead astray on every walk: they are compared over twelve. Faults that are covered
elsewhere: walks from outside the area in ``test_beyond_the_area``, logs of another city in
``test_another_city``, bounds of levels in ``test_report_evidence``, reports that
repeat themselves in ``test_sensor_watch``.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from faulty_town import TOWN, OffWays, moved, other, turned, walk, without_streets

from mapfilter.filters.contract import Reason
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.merging import epochs

AREA = TOWN.area()
NO_CELL_IS_AT_FAULT = {"fault_probability": 1e-6}
LEVELS_ARE_AS_PREDICTED = {"level_error_db": 2.0}
NOBODY_LEAVES_THE_WAYS = {"off_cost_per_m": 2.0}
THE_COMPASS_IS_EXACT = {"heading_sd_deg": 3.0, "bias_sd_deg": 0.01, "drift_deg_per_sqrt_m": 0.0}
STEPS_ARE_EXACT = {"scale": 0.0}
HALF_TURN, THIRD = np.pi, 2.1


def followed(area, log, seed, since=0.0, **options):
    """Follow a log from its true start; return the share of epochs at which it is right.

    Right is a position that is followed, at most 50 m off, and within its 95 % radius; epochs count
    from a share of the walk on.
    """
    rng = np.random.default_rng(seed)
    few = {"max_particles": 2000, "min_search_particles": 2000, "min_particles": 500}
    positioner = BayesFilter(**few, **options).over_area(area)
    truth = {name: log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")}
    state = positioner.begin_at(truth["east_m"][0], truth["north_m"][0], 5.0, rng)
    right, unused = [], []
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
        fix = output.fix
        east_m, north_m = (
            np.interp(epoch.time_s, truth["time_s"], truth[name]) for name in ("east_m", "north_m")
        )
        off_m = np.hypot(fix.east_m - east_m, fix.north_m - north_m)
        right.append(fix.status.is_followed and off_m <= min(50.0, fix.radii_m[2]))
        unused += [reading.reason for reading in output.unused]
    return float(np.mean(right[round(since * len(right)) :])), unused


@dataclass(frozen=True)
class Fault:
    """A map or a walk with a fault, and the option without the remedy."""

    seed: int
    without: dict[str, float]
    given: object = TOWN
    walker: object = TOWN
    spoilt: object = field(default=lambda log: log)
    length_m: float = 500.0
    since: float = 0.0

    @property
    def log(self):
        return self.spoilt(walk(self.seed, self.walker, self.length_m))


def of_cells(seed, given, without=NO_CELL_IS_AT_FAULT, **more):
    return Fault(seed, without, given, **more)


def of_logs(seed, without, spoilt, **more):
    return Fault(seed, without, spoilt=spoilt, **more)


def indoors(log):
    """The first 200 m are 15 dB weaker."""
    radio = log.radio
    return replace(
        log, radio=radio.assign(level_dbm=radio["level_dbm"] - 15.0 * (radio["time_s"] < 40))
    )


def in_bars(log):
    """Levels are rounded down to 12 dB."""
    level = np.floor(log.radio["level_dbm"] / 12) * 12
    return replace(log, radio=log.radio.assign(level_dbm=level))


def renamed(cell):
    """The cell that this one stands for in the plan has another name on air."""

    def spoilt(log):
        return replace(log, radio=log.radio.assign(cell=log.radio["cell"].replace({cell: "Z"})))

    return spoilt


def drifting(log):
    """A heading that is 20° off, and drifts by 15° in 100 m."""
    walked_m = np.nan_to_num(log.motion["step_m"]).cumsum()
    return turned(log, np.radians(20 + 0.15 * walked_m))


def disturbed(log):
    """A magnetic disturbance of 45° over 50 m."""
    row = np.arange(len(log.motion))
    return turned(log, np.radians(45) * ((row >= 40) & (row < 50)))


def long_steps(log):
    """Steps that are taken for 15 % too long."""
    return replace(log, motion=log.motion.assign(step_m=1.15 * log.motion["step_m"]))


SOME_OFF = (1, 5)
ROTATED = other(turned_rad=(HALF_TURN, HALF_TURN, 0, 0, 0, 0))
FAULTS = {
    "cells-off": [of_cells(seed, TOWN, walker=other(off=SOME_OFF)) for seed in (4, 10)],
    "cells-moved": [of_cells(3, moved(5, -250, -150)), of_cells(11, moved(2, -300, 0))],
    "cells-biased-8": [of_cells(s, other(bias_db=(8, -8, 8, -8, -8, 8))) for s in (4, 10)],
    "cells-biased-12": [of_cells(9, other(bias_db=(12, 0, 0, -12, 0, 0)), LEVELS_ARE_AS_PREDICTED)],
    "sectors-swapped": [
        of_cells(3, other(turned_rad=(0, 0, 0, 0, THIRD, -THIRD))),
        of_cells(5, other(turned_rad=(THIRD, -THIRD, 0, 0, 0, 0))),
    ],
    "site-rotated": [of_cells(seed, ROTATED) for seed in (5, 10, 17)],
    "new-cell": [
        of_cells(9, other(off=(3,)), spoilt=renamed("D")),
        of_cells(3, other(off=(5,)), spoilt=renamed("F")),
    ],
    "ways-missing": [
        of_cells(s, without_streets((1, 3, 5), (1, 3, 5)), NOBODY_LEAVES_THE_WAYS) for s in (0, 4)
    ],
    "district-10db": [
        of_cells(3, other(district=(300, 300, 250, 10)), LEVELS_ARE_AS_PREDICTED),
    ],
    "indoors-start": [of_logs(s, LEVELS_ARE_AS_PREDICTED, indoors) for s in (3, 4)],
    "off-ways": [
        Fault(
            seed,
            NOBODY_LEAVES_THE_WAYS,
            walker=OffWays(TOWN.east_m, TOWN.north_m, TOWN.cells_m),
            length_m=400.0,
            since=0.6,
        )
        for seed in (4, 7)
    ],
    "reports-in-bars": [of_logs(s, LEVELS_ARE_AS_PREDICTED, in_bars) for s in (4, 11)],
    "gyro-drift": [of_logs(s, THE_COMPASS_IS_EXACT, drifting) for s in (3, 5)],
}
WALKS = range(12)
POOLED = {
    "magnetic": [of_logs(s, THE_COMPASS_IS_EXACT, disturbed) for s in WALKS],
    "step-length": [of_logs(s, STEPS_ARE_EXACT, long_steps, length_m=700.0) for s in WALKS],
}


@pytest.mark.parametrize(
    "fault", [pytest.param(f, id=f"{n}-{f.seed}") for n, every in FAULTS.items() for f in every]
)
def test_a_walk_with_a_fault_ends_right_and_not_without_the_remedy(fault):
    area, log, seed = fault.given.area(), fault.log, fault.seed
    within, _ = followed(area, log, seed, fault.since)
    without, _ = followed(area, log, seed, fault.since, **fault.without)
    sound = walk(seed, length_m=fault.length_m)
    control, _ = followed(AREA, sound, seed, **fault.without)
    assert within > 0.95
    assert without < 0.8
    assert control > 0.9


@pytest.mark.parametrize("faults", [pytest.param(f, id=name) for name, f in POOLED.items()])
def test_of_twelve_walks_far_more_epochs_are_right_with_the_remedy(faults):
    shares = []
    for fault in faults:
        log, seed, sound = fault.log, fault.seed, walk(fault.seed)
        tried = (log, {}), (log, fault.without), (sound, fault.without)
        shares.append([followed(AREA, given, seed, **options)[0] for given, options in tried])
    within, without, control = np.array(shares).T
    assert within.mean() > 0.88
    assert without.mean() < within.mean() - 0.1
    assert control.min() > 0.9


def test_of_sixteen_walks_with_a_site_rotated_nearly_all_epochs_are_right():
    faults = [of_cells(seed, ROTATED) for seed in range(16)]
    area = faults[0].given.area()
    within = [followed(area, fault.log, fault.seed)[0] for fault in faults]
    # In two of them a phone that was mirrored before a bend explains the levels as well.
    assert np.mean(within) > 0.9
    assert np.median(within) == 1.0


def test_a_new_cell_is_reported_as_not_in_the_plan():
    (fault, _) = FAULTS["new-cell"]
    _, unused = followed(fault.given.area(), fault.log, fault.seed)
    assert Reason.UNKNOWN_CELL in unused
    _, unused = followed(TOWN.area(), walk(fault.seed), fault.seed)
    assert Reason.UNKNOWN_CELL not in unused
