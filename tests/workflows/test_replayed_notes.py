"""Notes on logs in the figures of a replay of several."""

from types import SimpleNamespace

import pytest

from mapfilter.filters.contract import Reason
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.workflows.replays.figures import _shared_notes
from mapfilter.workflows.replays.lacks import clocks_note

TOLD = "motion.csv: steps of 3 rows are above 10 km/h"


def test_notes_are_whole_whatever_the_logs_are_called():
    names = ("m", "km", "walk")
    logs = [SimpleNamespace(name=name, notes=(f"logs/{name}/{TOLD}",)) for name in names]
    assert _shared_notes(logs) == [f"{TOLD} (in m, km, walk)"]


@pytest.mark.parametrize(("what", "when"), [("+20 s", "20 s later"), ("-13 s", "13 s earlier")])
def test_reports_of_another_clock_are_told_with_the_remedy(what, when):
    other = UnusedReading(2.0, "radio", "", Reason.STALE_RADIO)
    told = UnusedReading(431.6, "radio", what, Reason.CLOCKS_APART)
    (note,) = clocks_note(SimpleNamespace(unused=(other, told, other)))
    assert f"by 432 s reports fit the positions of about {when}" in note
    assert "--offset" in note
    assert clocks_note(SimpleNamespace(unused=(other, other))) == ()
