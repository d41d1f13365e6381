"""Saved sessions: the state of a filter as plain numbers and names, without any pickle.

A file is one line of JSON (format, version, lengths, SHA-256 of the rest), a JSON document, and the
bytes of arrays. The document holds values by explicit types: only those classes that are listed
here are made of it, by their names, with the fields that they have. Values that occur twice are
stored once, and are one object again afterwards.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._inputs import json_value, read_input
from mapfilter._io import atomic_file
from mapfilter._json_files import check_version
from mapfilter.errors import StoreError, fail
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.hypotheses import BeliefSummary, Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.level_memory import LevelMemory
from mapfilter.positioning.bayes.alternative import AlternativeHypothesis, NullHypothesis
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.held import HeldOtherwise
from mapfilter.positioning.bayes.hold import Hold
from mapfilter.positioning.bayes.mirrored import MirroredTwin
from mapfilter.positioning.bayes.path import DeadReckoning, RecentPath
from mapfilter.positioning.bayes.state import BayesState, Reported
from mapfilter.positioning.bayes.timing import TimingState
from mapfilter.positioning.bayes.timing_errors import DifferenceErrors
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

FORMAT, VERSION = "mapfilter session", 19

_LARGEST_BYTES = 256 << 20
_LARGEST_LINE = 1000
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
        GnssFix,
        GnssState,
        HeldOtherwise,
        Hold,
        LevelErrors,
        LevelMemory,
        MirroredTwin,
        MotionRepeats,
        MotionStep,
        NullHypothesis,
        ParticleBelief,
        Receiver,
        RecentPath,
        Recovery,
        ReportRow,
        Reported,
        Pace,
        Place,
        Places,
        Rest,
        RowTimes,
        SampleTail,
        SensorWatch,
        FoundErrors,
        StepOutput,
        TimingState,
        TrailFix,
        ShortSteps,
        UndirectedWay,
        UnusedReading,
        WanderFix,
    )
}
_BESIDES = {ParticleBelief.__name__: ("summary",)}
"""What objects may hold that does not follow from their fields: a summary is that before
resampling."""
_ENUMS: dict[str, type[Enum]] = {one.__name__: one for one in (Reason, Status)}


def encode(value: Mapping[str, Any]) -> bytes:
    """Return the bytes of a file that holds a value.

    Parameters
    ----------
    value : mapping
        Numbers, texts, arrays, tuples, mappings with text keys, and objects of the classes above.

    Raises
    ------
    TypeError
        Something else is in it.
    """
    writer = _Writer()
    document = json.dumps(writer.value(value), separators=(",", ":"), allow_nan=False).encode()
    rest = b"".join((document, *writer.arrays))
    head = {
        "format": FORMAT,
        "version": VERSION,
        "document_bytes": len(document),
        "bytes": len(rest),
        "sha256": hashlib.sha256(rest).hexdigest(),
    }
    return json.dumps(head).encode() + b"\n" + rest


def decode(data: bytes, where: str) -> dict[str, Any]:
    """Return the value that :func:`encode` was given.

    Raises
    ------
    StoreError
        The bytes are cut off, changed, of another version, or something else.
    """
    line, _, rest = data[: _LARGEST_LINE + 1].partition(b"\n")
    rest = data[len(line) + 1 :]
    try:
        head = json_value(line)
        known = head["format"] == FORMAT
        version, size, digest = head["version"], head["document_bytes"], head["sha256"]
    except (ValueError, TypeError, KeyError, RecursionError):
        known, version, size, digest = False, 0, 0, ""
    if not known:
        raise fail(StoreError, where, f"a {FORMAT}", "something else", "cut off or overwritten")
    check_version(where, version, VERSION)
    if hashlib.sha256(rest).hexdigest() != digest:
        expected, got = "bytes as they were written", "others, by their SHA-256"
        raise fail(StoreError, where, expected, got, "cut off or changed")
    try:
        value = _Reader(rest[size:]).value(json_value(rest[:size]))
        if not isinstance(value, dict):
            raise TypeError(type(value).__name__)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError) as error:
        got = f"others ({type(error).__name__}: {error})"
        hint = "written by another version of mapfilter, or edited"
        raise fail(StoreError, where, "the values of a session", got, hint) from error
    return value


def write_session(path: Path, value: Mapping[str, Any]) -> None:
    """Write a value to a file that only this user can read; it is there whole, or as before."""
    data = encode(value)
    with atomic_file(path) as temporary:
        temporary.touch(mode=0o600)
        temporary.write_bytes(data)


def read_session(path: Path) -> dict[str, Any]:
    """Read what :func:`write_session` has written; raise StoreError where that is not there."""
    data = read_input(path, _LARGEST_BYTES, "a session", StoreError)
    return decode(data, str(path))


class _Writer:
    """Turns values into JSON and the bytes of arrays."""

    def __init__(self) -> None:
        self.arrays: list[bytes] = []
        self.at = 0
        self.known: dict[int, int] = {}
        self.held: list[Any] = []

    def value(self, value: Any) -> Any:
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


class _Reader:
    """Makes values of JSON and the bytes of arrays."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.held: dict[int, Any] = {}

    def value(self, given: Any) -> Any:
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
