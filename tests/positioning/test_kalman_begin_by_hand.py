"""States of a Kalman-type filter before the first epoch: what each kind of measurement needs."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.filters.gaussian import EKF
from mapfilter.positioning.kalman.filter import KalmanTracker
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.radio.cells import Cell, CellPlan


def tracker(sites, **options):
    cells = tuple(
        Cell(f"C{k}", f"S{k}", 500_000.0 + 900.0 * k, 4.6e6, 30.0, None, 50.0, 1800.0, "omni")
        for k in range(sites)
    )
    given = KalmanOptions(**{"fix_lasting_share": 0.0} | options)
    return KalmanTracker(SiteModels(CellPlan("EPSG:32629", cells), given), EKF)


@pytest.mark.parametrize(
    ("sites", "kinds", "slots"),
    [
        # Errors of twelve cells are kept at a time.
        (3, {"serving"}, 3), (12, {"neighbour", "motion"}, 12), (13, {"serving", "motion"}, 12),
        (30, {"serving", "neighbour"}, 12), (30, {"motion", "gnss"}, 0), (0, {"serving"}, 0),
    ],
)  # fmt: skip
def test_as_many_cells_have_errors_as_are_received(sites, kinds, slots):
    state = tracker(sites).begin(kinds)
    assert state.slots.cells == ("",) * slots
    # East and north with a rate each, or with three errors of dead reckoning.
    own = 5 if "motion" in kinds else 4
    assert state.layout.size == own + (slots + 1 if slots else 0)


@pytest.mark.parametrize(("kinds", "size"), [({"motion"}, 7), ({"gnss"}, 6)])
def test_errors_of_fixes_that_last_are_two_more(kinds, size):
    assert tracker(2, fix_lasting_m=3.0).begin(kinds).layout.size == size


def test_nothing_is_known_before_the_first_epoch():
    state = tracker(2).begin()
    assert state.belief is None
    assert np.isnan(state.time_s)
    assert len(state.recent_nis) == 0
    with pytest.raises(InputError, match="kinds"):
        tracker(2).begin({"gps"})


def test_other_options_are_of_the_same_sites():
    one = tracker(2)
    other = one.with_options(KalmanOptions(fix_sd_m=8.0))
    assert other.made_of.fix_sd_m == 8.0
    assert other.sites.plan is one.sites.plan
    assert other.method is one.method
    assert set(one.uses) == {"motion", "serving", "neighbour", "gnss"}
