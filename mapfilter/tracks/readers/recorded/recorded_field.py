"""A column of a recorded table: its range, and what values out of it most likely are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats

_NOISE_SHARE = 0.2


@dataclass(frozen=True, slots=True)
class Field:
    """One column of a recorded table.

    Parameters
    ----------
    name : str
        With its unit.
    low, high : float
        Inclusive range.
    expected : str
        The range, in messages.
    required : bool
        Whether a row without a value is unusable; other values out of range become missing.
    text : bool
        Whether values are texts.
    hints : tuple of (float, float, str)
        Likely mistakes behind values within these intervals.
    vital : bool
        Whether a file is refused most of whose values are out of range, as a log needs them.
    turn : float
        Of headings, which may be unwrapped, a turn in their unit, 2π or 360; else 0.
    marks : int
        Up to so many different values out of range are marks of missing ones, and no reason to
        refuse a file.
    mostly : float
        Share of other values out of range above which it is refused, or where the column is not
        vital left out as another quantity, if it may have marks.
    noise : float
        Values below the range by less are noise about its end, see :meth:`is_noise`.
    """

    name: str
    low: float = -np.inf
    high: float = np.inf
    expected: str = "a finite number"
    required: bool = False
    text: bool = False
    hints: tuple[tuple[float, float, str], ...] = ()
    vital: bool = False
    turn: float = 0.0
    marks: int = 1
    mostly: float = 0.5
    noise: float = 0.0

    def mistake(self, largest: float) -> str:
        """Return the likely mistake behind values out of range, by the largest; "" for none."""
        return next((hint for low, high, hint in self.hints if low <= largest <= high), "")

    def is_another(self, outside: Floats, given: int) -> bool:
        """Return whether values out of range show that a column holds another quantity.

        Parameters
        ----------
        outside : (N,) array
            Values out of range.
        given : int
            Number of all values.
        """
        if self.vital or self.marks < 2 or len(outside) <= self.mostly * given:
            return False
        return len(np.unique(outside)) > self.marks

    def is_noise(self, values: Floats) -> Bools:
        """Return which values below the range are noise about its end, and mean the end itself.

        There are none where they are more than a fifth as far below as the largest value is above:
        such are values of both signs.

        Parameters
        ----------
        values : (N,) array
            All values; NaN where missing.
        """
        near = (values < self.low) & (values > self.low - self.noise)
        if not near.any():
            return near
        beyond, above = self.low - values[near].min(), np.nanmax(values) - self.low
        return near & bool(beyond <= _NOISE_SHARE * above)

    @property
    def kind(self) -> str:
        """What a value is, in messages."""
        return "text" if self.text else "number"

    def mistakes(self, values: Floats, bad: Bools) -> Iterator[tuple[str, Bools]]:
        """Yield the likely mistake behind bad values, and which of them are its."""
        for low, high, hint in self.hints:
            of = bad & (np.abs(values) >= low) & (np.abs(values) <= high)
            if of.any():
                yield f" (likely: {hint})", of
                bad = bad & ~of
        if bad.any():
            yield "", bad
