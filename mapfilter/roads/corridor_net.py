"""A net of ways that grows along tracks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from mapfilter._types import Bools, Floats

Place = tuple[float, float]
# A track's own last vertices, two to a reach, are not what it meets again.
_TRAIL = 5
# Two vertices are joined already when so few steps lead from one to the other.
_NEIGHBOURHOOD = 12


class _Net:
    """Lines accepted so far, and their vertices in squares of one reach."""

    def __init__(self, reach_m: float) -> None:
        self.lines: list[list[Place]] = []
        self.reach_m = reach_m
        self._squares: dict[tuple[int, int], list[tuple[Place, int]]] = {}
        self._next: dict[Place, set[Place]] = {}

    def nearest(self, place: Place, before: int) -> Place | None:
        """Return the nearest vertex within reach that was added before a moment."""
        return next((other for other, moment in self._about(place, 1) if moment < before), None)

    def join_end(self, place: Place) -> None:
        """Join a line's end to the nearest vertex that it is apart from, within two reaches."""
        for other, _ in self._about(place, 2):
            if not self.are_joined(place, other):
                self.keep([place, other])
                return

    def add(self, place: Place, moment: int) -> None:
        """Add a vertex of a line that is still growing."""
        self._squares.setdefault(self._square(place), []).append((place, moment))

    def keep(self, line: list[Place]) -> None:
        """Accept a line whose vertices were added."""
        self.lines.append(line)
        for a, b in itertools.pairwise(line):
            self._next.setdefault(a, set()).add(b)
            self._next.setdefault(b, set()).add(a)

    def end(
        self, before: Place | None, own: Sequence[tuple[Place, int]], joint: Place | None
    ) -> None:
        """End a line whose own vertices were added, between older ones or nothing.

        It is accepted where it is long enough or joins what was apart.
        """
        places = [place for place, _ in own]
        length_m = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
        joins = before is not None and joint is not None and not self.are_joined(before, joint)
        if length_m >= self.reach_m or joins:
            self.keep([place for place in (before, *places, joint) if place is not None])
            return
        for place, moment in own:
            self._squares[self._square(place)].remove((place, moment))

    def are_joined(self, a: Place, b: Place) -> bool:
        """Return whether a few steps along lines lead from one vertex to another."""
        seen, edge = {a}, {a}
        for _ in range(_NEIGHBOURHOOD):
            if b in seen:
                return True
            edge = {after for place in edge for after in self._next.get(place, ())} - seen
            seen |= edge
        return b in seen

    def _about(self, place: Place, reaches: int) -> list[tuple[Place, int]]:
        """Return the vertices within some reaches of a place, the nearest first."""
        row, col = self._square(place)
        steps = range(-reaches, reaches + 1)
        found = [
            (math.dist(other, place), moment, other)
            for i in steps
            for j in steps
            for other, moment in self._squares.get((row + i, col + j), ())
        ]
        near = (entry for entry in sorted(found) if entry[0] <= reaches * self.reach_m)
        return [(other, moment) for _, moment, other in near]

    def _square(self, place: Place) -> tuple[int, int]:
        return int(place[0] // self.reach_m), int(place[1] // self.reach_m)


def grown_lines(
    tracks: Sequence[Floats], usable: Sequence[Bools], reach_m: float
) -> list[list[Place]]:
    """Return the lines of a network that covers tracks once.

    Tracks have vertices, shape (N, 2), at most half a reach apart; those that are not usable
    interrupt a line. A vertex within reach of an older one is not new. New parts shorter than a
    reach are left out, unless they join what was apart. An end within two reaches of another line
    is joined to it.
    """
    net, moment = _Net(reach_m), 0
    for vertices, taken in zip(tracks, usable, strict=True):
        moment += _TRAIL
        before: Place | None = None
        own: list[tuple[Place, int]] = []
        for (x, y), may in zip(vertices.tolist(), taken.tolist(), strict=True):
            moment += 1
            there = net.nearest((x, y), moment - _TRAIL) if may else None
            if may and there is None:
                own.append(((x, y), moment))
                net.add((x, y), moment)
            else:
                net.end(before, own, there)
                before, own = there, []
        net.end(before, own, None)
    for line in tuple(net.lines):
        net.join_end(line[0])
        net.join_end(line[-1])
    return net.lines
