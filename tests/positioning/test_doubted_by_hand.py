"""Which sensor is told to be in doubt where a rival is ahead of the belief."""

from types import SimpleNamespace

import pytest
from made_filters import belief

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.doubted import doubted
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.epochs import Epoch

TURNED, EPOCH = Hold(1.0, 3.0), Epoch(1.0, (MotionStep(1.4, 0.3),))
BELIEFS = SimpleNamespace(may_have_left=lambda _: False, is_pulled=lambda _: False)


def rival(hold, *, elsewhere=True, look=False):
    return SimpleNamespace(hold=hold, is_elsewhere=lambda _: elsewhere, is_look=look)


@pytest.mark.parametrize("main", [Hold(), Hold(-1.0, 0.5, 0.3)])
@pytest.mark.parametrize(
    ("uncounted_leads", "why"), [(True, Reason.MOTION_STUCK), (False, Reason.PHONE_TURNED)]
)
def test_the_likeliest_rival_tells_whether_the_counter_or_the_phone(main, uncounted_leads, why):
    """The likeliest of those elsewhere: what is at the same place leaves no doubt."""
    holds = (main, TURNED) if uncounted_leads else (TURNED, main)
    near = rival(TURNED if uncounted_leads else main, elsewhere=False)
    held = near, *(rival(one) for one in holds)
    state = SimpleNamespace(belief=belief(), hold=main, contested=True, held=held)
    (found,) = doubted(BELIEFS, state, main, EPOCH, [], moves=True)
    assert (found.kind, found.reason) == ("motion", why)


@pytest.mark.parametrize("elsewhere", [True, False])
def test_another_place_by_the_same_readings_puts_no_sensor_in_doubt(elsewhere):
    """It is the likeliest, of those elsewhere or of all; then the phone of the next one counts."""
    held = rival(Hold(), elsewhere=elsewhere, look=True), rival(TURNED)
    state = SimpleNamespace(belief=belief(), hold=Hold(), contested=True, held=held)
    found = doubted(BELIEFS, state, Hold(), EPOCH, [], moves=True)
    assert [one.reason for one in found] == ([] if elsewhere else [Reason.PHONE_TURNED])
