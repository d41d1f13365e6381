"""Remarks on a file, with numbers that are added up over its parts where it is large."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from mapfilter._words import number_of


@dataclass(slots=True)
class _Counted:
    """A note, its numbers so far, and which sources of them were counted."""

    say: Callable[..., str]
    numbers: tuple[int, ...] = ()
    sources: set[int] = field(default_factory=set)


@dataclass(slots=True)
class CountedNotes:
    """The notes of one file whose numbers may grow with its next part.

    Examples
    --------
    >>> counted = CountedNotes()
    >>> [counted.add(lambda n: f"{n} rows left out", (number,)) for number in (3, 4)]
    [('', '3 rows left out'), ('3 rows left out', '7 rows left out')]
    """

    _notes: dict[str, _Counted] = field(default_factory=dict)

    def add(
        self,
        say: Callable[..., str],
        numbers: tuple[int, ...],
        key: str = "",
        source: int | None = None,
    ) -> tuple[str, str]:
        """Add numbers, and return the note before ("" for none) and now.

        Parameters
        ----------
        say : callable
            Returns the note for some numbers; that of the first part stays.
        numbers : tuple of int
        key : str
            What is alike in all parts; "" for the note of equal numbers.
        source : int, optional
            What was counted; it counts once.
        """
        note = self._notes.setdefault(key or say(*(2 for _ in numbers)), _Counted(say))
        before = note.say(*note.numbers) if note.numbers else ""
        if source is None or source not in note.sources:
            old = note.numbers or tuple(0 for _ in numbers)
            note.numbers = tuple(a + b for a, b in zip(old, numbers, strict=True))
        if source is not None:
            note.sources.add(source)
        return before, note.say(*note.numbers)


class Remarks:
    """Collects remarks on a file, of which some are on values that are left out.

    Attributes
    ----------
    notes : list of str
        All, each once.
    ignored : list of str
        Those on values that are left out.
    counted : CountedNotes
    """

    __slots__ = ()
    notes: list[str]
    ignored: list[str]
    counted: CountedNotes

    def note(self, text: str) -> None:
        """Add a remark, once."""
        if text not in self.notes:
            self.notes.append(text)

    def ignore(self, text: str) -> None:
        """Add a remark on values that are left out."""
        self.note(text)
        if text not in self.ignored:
            self.ignored.append(text)

    def count(
        self,
        say: Callable[..., str],
        *numbers: int,
        key: str = "",
        source: int | None = None,
        ignored: bool = False,
    ) -> None:
        """Add a remark with numbers, which are added up over the parts of a large file.

        The parameters are those of :meth:`CountedNotes.add`; ``ignored`` marks remarks on values
        that are left out.
        """
        before, text = self.counted.add(say, numbers, key, source)
        self.notes[:] = [text if note == before else note for note in self.notes]
        self.ignored[:] = [text if note == before else note for note in self.ignored]
        if ignored:
            self.ignore(text)
        else:
            self.note(text)


def number_or_share(bad: int, given: int | None) -> str:
    """Return how many values, of how many where that is known, in words.

    Examples
    --------
    >>> number_or_share(2, None), number_or_share(2, 3)
    ('2 values are', '2 of 3 values are')
    """
    if given is None:
        return number_of(bad, "value is", "values are")
    return f"{bad} of {number_of(given, 'value')} are"
