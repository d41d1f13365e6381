"""One fault of a column of a log's motion, by its positions, and what mends it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import nan

from mapfilter._same import EqualByValue

_FIRST_WORDS = {"heading_rad": "headings", "turn_rad": "turns", "step_m": "steps"}

MOTION_COLUMNS = tuple(_FIRST_WORDS)
"""Columns of motion that positions can contradict."""

MIRRORED = "positions are a mirror image of the way by"
BY_COMPASS = "steps and compass"
"""Words of a note on positions that are one; with these by headings of a compass."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionFault(EqualByValue):
    """What is wrong with a column of motion.

    Parameters
    ----------
    column : str
    found, expected : str
        In words.
    factor : float
        By which the column's values become what is expected; NaN where no factor is known.
    remedy : str
        Another option that mends it; "" for none.
    otherwise : str
        What else the positions may have; "" for nothing.

    Examples
    --------
    >>> print(MotionFault("turn_rad", "turns run clockwise", "radians counter-clockwise", -1.0))
    turns run clockwise; expected radians counter-clockwise (--factor turn_rad=-1 mends it)
    """

    column: str
    found: str
    expected: str
    factor: float = nan
    remedy: str = ""
    otherwise: str = ""

    @property
    def option(self) -> str:
        """The option that mends the column; "" where none does."""
        # NaN is not equal to itself.
        known = self.factor == self.factor
        return f"--factor {self.column}={self.factor:.4g}" if known else self.remedy

    def __str__(self) -> str:
        other = f", or {self.otherwise}" if self.otherwise else ""
        mended = f" ({self.option} mends it)" if self.option else ""
        return f"{self.found}; expected {self.expected}{other}{mended}"


def fault_notes(notes: Iterable[str], column: str) -> list[str]:
    """Return those notes of a log that are a fault of a column of its motion by its positions.

    Examples
    --------
    >>> notes = ["motion, turn_rad: turns run clockwise", "motion: 1 exact duplicate row dropped"]
    >>> fault_notes(notes, "turn_rad"), fault_notes(notes, "step_m")
    (['motion, turn_rad: turns run clockwise'], [])
    """
    return [note for note in notes if f", {column}: {_FIRST_WORDS[column]} " in note]
