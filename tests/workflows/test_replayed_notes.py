"""Notes on logs in the figures of a replay of several."""

from types import SimpleNamespace

from mapfilter.workflows.replays.figures import _shared_notes

TOLD = "motion.csv: steps of 3 rows are above 10 km/h"


def test_notes_are_whole_whatever_the_logs_are_called():
    names = ("m", "km", "walk")
    logs = [SimpleNamespace(name=name, notes=(f"logs/{name}/{TOLD}",)) for name in names]
    assert _shared_notes(logs) == [f"{TOLD} (in m, km, walk)"]
