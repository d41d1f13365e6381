"""What a fix does beside beliefs that go on without fixes: numbers by hand."""

from dataclasses import replace
from math import isnan, nan

import numpy as np
import pytest

from mapfilter.filters.gaussian import EKF, Gaussian
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.wander import FixWander, FoundErrors
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting, Separation
from mapfilter.positioning.kalman.disputed import FixRecord, Ruling
from mapfilter.positioning.kalman.fix_errors import FixErrors
from mapfilter.positioning.kalman.fixing import FixWeighing
from mapfilter.positioning.kalman.lasting import extended_layout
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.proof import Doubt
from mapfilter.positioning.kalman.reckoning import RECKONED

USUAL = FixErrors(record=FixRecord(agreed=40, agreed_from_s=-1.0), fixed_s=99.0)


def coast(east_m=0.0, variance_m2=4.0, begun_s=10.0):
    mean = np.array([east_m, 0.0, 0.0, 0.0, 0.0])
    covariance = np.diag([variance_m2, variance_m2, 1e-2, 1e-3, 1e-6])
    return Coast.of(begun_s, Gaussian(mean, covariance), 1.0, mean[:2])


def held(one):
    """Errors beside a belief without fixes that has contradicted them."""
    return USUAL._replace(coasting=Coasting((one,), apart=Separation(0.9, one), is_held=True))


def weighed(errors, fix_m=(0.0, 0.0), *, own=RECKONED, mean=(), time_s=100.0, var_m2=9.0, **more):
    """What a fix leads to, of a belief of 1 m²; of what lasts of fixes, ``fix_lasting_m``."""
    lasting_m = more.pop("fix_lasting_m", 0.0)
    options = KalmanOptions(fix_lasting_share=0.0, fix_lasting_m=lasting_m)
    layout = extended_layout(own) if lasting_m else own
    first = np.zeros(layout.size)
    first[: len(mean)] = mean
    belief = more.pop("belief", None) or SumBelief.start(first, np.eye(layout.size))
    how = FixWeighing(options, own, layout, EKF, own.size)
    fix = GnssFix(*fix_m, var_m2, var_m2, 0.0)
    return how.weighed(belief, errors, fix, time_s, drift_deg_per_sqrt_m=0.6, **more)


@pytest.mark.parametrize(
    ("agreed", "doubt", "own", "begins"),
    [
        (8, Doubt.NONE, RECKONED, False), (9, Doubt.NONE, RECKONED, True),
        (58, Doubt.UNTIL_PROVEN, RECKONED, False), (59, Doubt.UNTIL_PROVEN, RECKONED, True),
        (40, Doubt.NONE, MOVING, False), (2, Doubt.NONE, MOVING, False),
    ],
)  # fmt: skip
def test_a_settled_belief_goes_on_without_fixes_too(agreed, doubt, own, begins):
    """After ten fixes that agreed, or sixty in doubt; where steps tell how it goes on."""
    record = FixRecord(agreed=agreed, agreed_from_s=-1.0)
    errors = FixErrors(record=record, fixed_s=99.0, doubt=doubt)
    found = weighed(errors, (2.0, 1.0), own=own)
    assert found.errors.record.agreed == agreed + 1
    assert len(found.errors.coasting.kept) == begins
    # Who rests says nothing of the way.
    assert weighed(errors, own=own, rests_since_s=98.0).errors.coasting.kept == ()
    if begins:
        (one,) = found.errors.coasting.kept
        assert (one.begun_s, one.times) == (100.0, 1.0)
        np.testing.assert_array_equal(one.mean[:5], found.belief.moments.mean)
        np.testing.assert_array_equal(one.covariance[:5, :5], found.belief.moments.covariance)
        assert one.fix_m.tolist() == [2.0, 1.0]


def test_beside_it_is_the_place_that_fixes_are_of():
    """Without their white noise, where some of their errors last."""
    found = weighed(USUAL._replace(lasting_m=2.0), (2.0, 1.0), fix_lasting_m=2.0)
    (one,) = found.errors.coasting.kept
    mean = found.belief.moments.mean
    assert 0.1 < mean[5] < 1.9
    assert one.fix_m.tolist() == mean[5:7].tolist()
    assert one.mean.tolist() == [*mean[:5].tolist(), 0.0, 0.0]


def test_fixes_that_have_come_back_by_and_by_are_believed():
    found = weighed(held(coast()))
    assert found.ruling is Ruling.AGREES
    assert not found.errors.coasting.is_held
    # Those that agree with the belief alone are not.
    found = weighed(held(coast(400.0)))
    assert found.ruling is Ruling.AGREES
    assert found.errors.coasting.is_held
    assert found.errors.coasting.apart.probability == pytest.approx(0.5)


def outliers(count, one, **more):
    """What as many fixes at the place of a belief without fixes lead to, 100 m from the other."""
    errors, belief = held(one)._replace(lasting_m=more.get("fix_lasting_m", 0.0)), None
    for second in range(count):
        given = {"belief": belief} if belief else {"mean": (100.0,)}
        found = weighed(errors, time_s=100.0 + second, **given, **more)
        errors, belief = found.errors, found.belief
    return found


@pytest.mark.parametrize("lasting_m", [0.0, 2.0])
def test_the_second_fix_at_a_known_belief_gives_the_place_back_to_it(lasting_m):
    given = {"fix_lasting_m": lasting_m}
    first = outliers(1, coast(1.0), **given)
    assert (first.ruling, first.used) == (Ruling.OUTLIER, False)
    assert first.errors.coasting.is_held
    assert first.errors.coasting.is_back
    found = outliers(2, coast(1.0), **given)
    assert (found.ruling, found.used) == (Ruling.AGREES, True)
    assert isnan(found.nis)
    # A fix of 9 m² at 0 m, all of which counts, and the belief of 4 m² at 1 m.
    assert found.belief.moments.mean[0] == pytest.approx(9.0 / 13.0)
    assert found.belief.moments.covariance[0, 0] == pytest.approx(36.0 / 13.0)
    errors = found.errors
    assert not errors.coasting.is_held
    assert (errors.doubt, len(errors.wander.rows), errors.record.agreed) == (Doubt.NONE, 1, 0)
    assert found.motion[0][0, 0] == 0.0
    assert found.motion[2][0] == 1.0


def test_what_was_learnt_while_fixes_led_away_is_dropped():
    wander = FixWander(now=FoundErrors(1.0, 3.0), seen_s=50.0)
    errors = outliers(1, coast()).errors._replace(wander=wander, doubt=Doubt.UNTIL_PROVEN)
    found = weighed(errors, mean=(100.0,), time_s=101.0)
    assert found.ruling is Ruling.AGREES
    assert (found.errors.doubt, found.errors.wander.now) == (Doubt.NONE, FoundErrors())


@pytest.mark.parametrize(
    ("count", "ruling"), [(1, Ruling.OUTLIER), (2, Ruling.OUTLIER), (3, Ruling.ANEW)]
)
def test_beside_one_that_is_hardly_known_three_fixes_begin_anew(count, ruling):
    found = outliers(count, coast(variance_m2=3600.0))
    assert found.ruling is ruling
    anew = ruling is Ruling.ANEW
    assert found.used is anew
    assert found.errors.coasting.is_held is not anew
    assert found.errors.doubt is (Doubt.UNTIL_PROVEN if anew else Doubt.NONE)
    assert found.belief.moments.mean[0] == pytest.approx(0.0 if anew else 100.0)


def test_outliers_that_contradict_both_change_nothing():
    found = outliers(3, coast(400.0))
    assert found.ruling is Ruling.OUTLIER
    assert found.errors.coasting.is_held
    assert not found.errors.coasting.is_met
    assert found.errors.coasting.apart.probability == 0.9


@pytest.mark.parametrize(
    "more", [{"is_doubted": True}, {"rests_since_s": 98.0, "is_doubted": True}]
)
def test_where_steps_may_be_wrong_nothing_goes_on_without_fixes(more):
    """One that is held stays until fixes agree with it."""
    kept = USUAL._replace(coasting=Coasting(kept=(coast(),)))
    found = weighed(kept, (100.0, 0.0), **more)
    assert found.ruling is Ruling.EITHER
    assert found.errors.coasting == Coasting()
    stays = held(coast())
    assert weighed(stays, (100.0, 0.0), **more).errors.coasting.is_held
    assert weighed(stays, (100.0, 0.0), **more).errors.coasting.kept == stays.coasting.kept


@pytest.mark.parametrize(("excess", "is_freer"), [(1.0, True), (2.0, False)])
def test_without_steps_fixes_that_are_less_precise_contradict_less(excess, is_freer):
    """20 m off 1 m² and 25 m², or twice these: 13.8 deviations squared are the limit."""
    record = replace(USUAL.record, excess=excess)
    errors = USUAL._replace(record=record, fixed_s=95.0)
    found = weighed(errors, (0.0, 20.0), own=MOVING, mean=(0.0, 6.0), var_m2=25.0)
    assert found.ruling is Ruling.AGREES
    assert found.motion[1].any() == is_freer


def test_a_fix_that_has_none_before_compares_nothing():
    errors = FixErrors(record=FixRecord(agreed=40, agreed_from_s=-1.0), fixed_s=nan)
    assert weighed(errors).ruling is Ruling.AGREES
