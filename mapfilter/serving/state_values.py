"""States of filters as JSON and the bytes of arrays.

The document holds values by explicit types: only those classes that are listed here are made of it,
by their names, with the fields that they have. Values that occur twice are stored once, and are one
object again afterwards.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.hypotheses import BeliefSummary, Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.level_memory import LevelMemory
from mapfilter.positioning.bayes.beliefs.legs import Lead, Leg
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning, RecentPath
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, NullHypothesis
from mapfilter.positioning.bayes.rivals.bends import Straight
from mapfilter.positioning.bayes.rivals.half_turns import HalfTurns
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.bayes.sources.timing import TimingState
from mapfilter.positioning.bayes.sources.timing_errors import DifferenceErrors
from mapfilter.positioning.bayes.state import BayesState, Reported
from mapfilter.positioning.epochs import GnssFix, ReportRow
from mapfilter.positioning.gnss.biases import Biases
from mapfilter.positioning.gnss.receiver import Receiver
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.gnss.trail import Contradiction, FixTrail, TrailFix
from mapfilter.positioning.gnss.wander import FixWander, FoundErrors, WanderFix
from mapfilter.positioning.integrity import SampleTail
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.pauses import RowTimes
from mapfilter.positioning.sensors.places import Place, Places
from mapfilter.positioning.sensors.repeats import MotionRepeats
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.short_steps import ShortSteps
from mapfilter.positioning.sensors.undirected import UndirectedWay
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.step_output import Fix, StepOutput, UnusedReading

_DTYPES = ("<f4", "<f8", "<i2", "<i4", "<i8", "|b1")
_CLASSES: dict[str, type] = {
    one.__name__: one
    for one in (
        AlternativeHypothesis,
        BayesState,
        BeliefSummary,
        Biases,
        Bins,
        Contradiction,
        DeadReckoning,
        DifferenceErrors,
        Fix,
        FixTrail,
        FixWander,
        FoundErrors,
        GnssFix,
        GnssState,
        HalfTurns,
        HeldOtherwise,
        Hold,
        Lead,
        Leg,
        LevelErrors,
        LevelMemory,
        MirroredTwin,
        MotionRepeats,
        MotionStep,
        NullHypothesis,
        Pace,
        ParticleBelief,
        Place,
        Places,
        Receiver,
        RecentPath,
        Recovery,
        ReportRow,
        Reported,
        Rest,
        RowTimes,
        SampleTail,
        SensorWatch,
        ShortSteps,
        StepOutput,
        Straight,
        TimingState,
        TrailFix,
        UndirectedWay,
        UnusedReading,
        WanderFix,
    )
}
_BESIDES = {ParticleBelief.__name__: ("summary",)}
"""What objects may hold that does not follow from their fields: a summary is that before
resampling."""
_ENUMS: dict[str, type[Enum]] = {one.__name__: one for one in (Reason, Status)}


class ValueWriter:
    """Turns values into JSON and the bytes of arrays, which it collects in ``arrays``."""

    def __init__(self) -> None:
        self.arrays: list[bytes] = []
        self.at = 0
        self.known: dict[int, int] = {}
        self.held: list[Any] = []

    def value(self, value: Any) -> Any:
        """Return a value as JSON; TypeError where something in it cannot be stored."""
        if value is None or isinstance(value, bool) or type(value) in (int, str):
            return value
        if isinstance(value, Enum):
            return {"enum": type(value).__name__, "value": value.value}
        if isinstance(value, np.generic):
            return {"scalar": value.dtype.str, "value": self._array(np.asarray(value))}
        if isinstance(value, float):
            # As text, digits come back to the bit, and NaN and infinity are there, too.
            return {"float": repr(value)}
        if id(value) in self.known:
            return {"same": self.known[id(value)]}
        number = len(self.held)
        self.held.append(value)
        self.known[id(value)] = number
        return {"new": number, **self._compound(value)}

    def _compound(self, value: Any) -> dict[str, Any]:
        if isinstance(value, np.ndarray):
            return {"array": self._array(value)}
        if isinstance(value, dict):
            if not all(type(key) is str for key in value):
                raise TypeError("mappings have text keys")
            return {"mapping": {key: self.value(one) for key, one in value.items()}}
        name = type(value).__name__
        if _CLASSES.get(name) is type(value):
            names = _field_names(type(value))
            found = {
                "class": name,
                "fields": {key: self.value(getattr(value, key)) for key in names},
            }
            besides = [key for key in _BESIDES.get(name, ()) if key in vars(value)]
            if besides:
                found["besides"] = {key: self.value(getattr(value, key)) for key in besides}
            return found
        if type(value) is tuple:
            return {"tuple": [self.value(one) for one in value]}
        raise TypeError(f"a session cannot hold {type(value).__module__}.{name}")

    def _array(self, array: np.ndarray[Any, Any]) -> dict[str, Any]:
        if array.dtype.str not in _DTYPES:
            raise TypeError(f"a session cannot hold arrays of {array.dtype}")
        data = array.tobytes()
        self.arrays.append(data)
        place = {"dtype": array.dtype.str, "shape": list(array.shape), "at": self.at}
        self.at += len(data)
        return place


class ValueReader:
    """Makes values of JSON and the bytes of arrays.

    Parameters
    ----------
    data : bytes
        Of all arrays.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.held: dict[int, Any] = {}

    def value(self, given: Any) -> Any:
        """Return the value that JSON stands for; any usual error where it stands for none."""
        if given is None or isinstance(given, bool) or type(given) in (int, str):
            return given
        if "float" in given:
            return float(given["float"])
        if "enum" in given:
            return _ENUMS[given["enum"]](given["value"])
        if "scalar" in given:
            return self._array(given["value"])[()]
        if "same" in given:
            return self.held[given["same"]]
        found = self._compound(given)
        self.held[given["new"]] = found
        return found

    def _compound(self, given: Any) -> Any:
        if "array" in given:
            return self._array(given["array"])
        if "mapping" in given:
            return {str(key): self.value(one) for key, one in given["mapping"].items()}
        if "tuple" in given:
            return tuple(self.value(one) for one in given["tuple"])
        kind = _CLASSES[given["class"]]
        if set(given["fields"]) != set(_field_names(kind)):
            raise KeyError(f"fields of {given['class']}")
        made = kind(**{key: self.value(one) for key, one in given["fields"].items()})
        for key in _BESIDES.get(given["class"], ()):
            if key in given.get("besides", {}):
                vars(made)[key] = self.value(given["besides"][key])
        return made

    def _array(self, place: Mapping[str, Any]) -> np.ndarray[Any, Any]:
        if place["dtype"] not in _DTYPES:
            raise TypeError("dtype")
        dtype, shape, at = np.dtype(place["dtype"]), tuple(place["shape"]), place["at"]
        size = dtype.itemsize
        for side in shape:
            if type(side) is not int or side < 0:
                raise ValueError("shape")
            size *= side
        if type(at) is not int or at < 0 or at + size > len(self.data):
            raise ValueError("array beyond the end")
        count = size // dtype.itemsize
        return np.frombuffer(self.data, dtype, count, at).reshape(shape).copy()


def _field_names(kind: type) -> tuple[str, ...]:
    if is_dataclass(kind):
        return tuple(one.name for one in fields(kind))
    named: tuple[str, ...] = kind._fields  # type: ignore[attr-defined]
    return named
