"""Epochs that a watch of the sensors sees, and what it says of them."""

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched

STEP = (MotionStep(1.4, 0.0),)
NO_STEP = (MotionStep(float("nan"), 0.0),)
STILL = (MotionStep(0.0, 0.0),)
CELLS = tuple("ABCDEFG")


def report(levels_dbm, serving="A"):
    return tuple(
        ReportRow("serving" if cell == serving else "neighbour", cell, None, None, float(level), 0)
        for cell, level in zip(CELLS, levels_dbm, strict=False)
    )


def told(sequence, watch=None):
    """Watch epochs; return the watch, the epochs as they come out, and the reasons."""
    watch, found = watch or SensorWatch(), []
    for epoch in sequence:
        watch, seen, reasons = watched(watch, epoch)
        found.append((seen, *reasons))
    return watch, found


def walked(seconds=20, motion=STEP):
    return [Epoch(float(second), motion) for second in range(seconds)]
