"""Values that are held as long as all of them take no more than some bytes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, Protocol, TypeVar

_ENTRY_BYTES = 300
"""What an entry takes besides its value."""


class Held(Protocol):
    """A value that knows how much memory it takes, such as an array."""

    @property
    def nbytes(self) -> int:
        """Bytes of all of it."""


_Value = TypeVar("_Value", bound=Held | None)


class BoundedCache:
    """Values by keys, of which those that were asked for longest ago are given up."""

    def __init__(self, largest_bytes: int) -> None:
        self._largest_bytes = largest_bytes
        self._entries: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self.bytes = 0

    def get(self, key: Hashable, make: Callable[[], _Value]) -> _Value:
        """Return the value of a key, made where it is not held; None counts as one."""
        entry = self._entries.get(key)
        if entry is not None:
            self._entries.move_to_end(key)
            found: _Value = entry[0]
            return found
        value = make()
        count = (0 if value is None else value.nbytes) + _ENTRY_BYTES
        self._entries[key] = value, count
        self.bytes += count
        while self.bytes > self._largest_bytes and len(self._entries) > 1:
            _, (_, gone) = self._entries.popitem(last=False)
            self.bytes -= gone
        return value
