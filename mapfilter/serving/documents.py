"""The door for JSON that comes over the network: one object, read strictly, and its faults."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from math import isfinite
from typing import Any

from mapfilter._inputs import is_unicode, json_value, shown
from mapfilter.errors import Fault, Faults, InputError, fail
from mapfilter.radio.identities import UNAVAILABLE

BODY = "body"
"""Name of the whole request body in messages."""

_SHOWN_FAULTS, _SHOWN = 20, 60


class RequestError(Exception):
    """A request that is answered with an error.

    Parameters
    ----------
    code : int
        HTTP status.
    reason : str
        One word for programs, such as ``parseError``.
    message : str
        One sentence for people.
    faults : tuple of Fault
        Each place in the body, where there are several.

    Attributes
    ----------
    retry_s : float
        Seconds after which the same request may be taken; 0 where that is not known.
    """

    def __init__(
        self, code: int, reason: str, message: str, faults: tuple[Fault, ...] = ()
    ) -> None:
        self.code, self.reason, self.message, self.faults = code, reason, message, faults
        self.retry_s = 0.0
        super().__init__(message)

    @classmethod
    def of(cls, error: InputError) -> RequestError:
        """Return the answer to a body with faults."""
        return cls(400, "invalid", str(error), error.faults)

    @property
    def document(self) -> dict[str, Any]:
        """The body of the answer, in the shape of geolocation services."""
        faults = self.faults[:_SHOWN_FAULTS] or (None,)
        errors = [
            {"domain": "mapfilter", "reason": self.reason, "message": self.message}
            if one is None
            else {
                "domain": "mapfilter",
                "reason": self.reason,
                "location": one.where,
                "message": str(one),
            }
            for one in faults
        ]
        return {"error": {"code": self.code, "message": self.message, "errors": errors}}


def read_object(data: bytes) -> dict[str, Any]:
    """Return the JSON object of a body; an empty body is an empty object.

    Raises
    ------
    RequestError
        It is no JSON of RFC 8259 in UTF-8: cut off, nested too deeply, NaN or infinity, a key
        twice in one object, half of a surrogate pair.
    """
    if not data.strip():
        return {}
    try:
        value = json_value(data, _refuse)
    except RecursionError:
        raise RequestError(400, "parseError", f"{BODY}: nested too deeply") from None
    except ValueError as error:
        raise RequestError(400, "parseError", f"{BODY}: expected JSON, found {error}") from None
    if not is_unicode(value):
        text = f"{BODY}: expected text in Unicode, found half of a surrogate pair"
        raise RequestError(400, "parseError", text)
    if not isinstance(value, dict):
        text = f"{BODY}: expected a JSON object, found {type_name(value)}"
        raise RequestError(400, "parseError", text)
    return value


def _refuse(name: str) -> None:
    raise ValueError(f"{name}, which is no JSON; leave the field out, or null")


def type_name(value: object) -> str:
    """Return what JSON calls the type of a value."""
    names = {dict: "an object", list: "a list", str: "a text", bool: "true or false"}
    return "null" if value is None else names.get(type(value), "a number")


def as_json(value: object) -> str:
    """Return a value of a request as messages show it: as in JSON, and not too long.

    Examples
    --------
    >>> as_json(None), as_json([True, 1.5]), as_json("a")
    ('null', '[true, 1.5]', "'a'")
    """
    if isinstance(value, bool | list | dict) or value is None:
        text = json.dumps(value, ensure_ascii=False)
        return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
    return shown(value)


def check_keys(
    given: Mapping[str, Any], known: Collection[str], where: str, faults: Faults
) -> None:
    """Note keys that nobody asked for; they are mostly misspelt."""
    for name in given:
        if name not in known:
            near = get_close_matches(name, known, 1, 0.6)
            faults.add(where, f"keys of {', '.join(known)}", shown(name), near[0] if near else "")


def number(
    value: object,
    where: str,
    expected: str,
    faults: Faults,
    low: float,
    high: float,
    hint: str = "",
) -> float | None:
    """Return a finite number in a range; None, with a fault, for anything else.

    The hint is the likely mistake of a number beyond the range.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            found = float(value)
        except OverflowError:
            found = float("inf")
        if isfinite(found) and low <= found <= high:
            return found
        faults.add(where, expected, as_json(value), hint_of_mark(value) or hint)
        return None
    faults.add(where, expected, as_json(value))
    return None


def whole(
    value: object,
    where: str,
    expected: str,
    faults: Faults,
    low: int,
    high: int,
    hint: str = "",
) -> int | None:
    """Return a whole number in a range; None, with a fault, for anything else.

    JSON knows one kind of numbers: 7.0 is 7, as some programs write it.
    """
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, int) and not isinstance(value, bool):
        if low <= value <= high:
            return value
        faults.add(where, expected, as_json(value), hint_of_mark(value) or hint)
        return None
    faults.add(where, expected, as_json(value))
    return None


def hint_of_mark(value: float) -> str:
    """Return what a number beyond its range says that is Android's mark; "" for others."""
    mark = value > 0 and value in UNAVAILABLE
    return "Android's mark for an unknown value; leave the field out" if mark else ""


def text(value: object, where: str, expected: str, faults: Faults, most: int = 128) -> str | None:
    """Return a text of printable characters that is not empty; None, with a fault, otherwise."""
    if isinstance(value, str) and 0 < len(value) <= most and value.isprintable():
        return value
    faults.add(where, expected, as_json(value))
    return None


def rows_of(value: object, where: str, faults: Faults, most: int) -> list[dict[str, Any]]:
    """Return a list of objects; with a fault, an empty one for anything else."""
    if value is None:
        return []
    if not isinstance(value, list):
        faults.add(where, "a list of objects", type_name(value))
        return []
    if len(value) > most:
        faults.add(where, f"at most {most} entries", len(value), "several requests")
        return []
    for index, one in enumerate(value):
        if not isinstance(one, dict):
            faults.add(f"{where}[{index}]", "an object", type_name(one))
            return []
    return value


def one_fault(where: str, expected: str, got: object, hint: str = "") -> RequestError:
    """Return the answer to a body with a single fault."""
    error = fail(InputError, where, expected, got, hint)
    return RequestError(400, "invalid", str(error), error.faults)
