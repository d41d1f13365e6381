"""Angles in degrees, minutes and seconds, as some planning tools and authorities write them."""

from __future__ import annotations

import re

_NUMBER = re.compile(r"[0-9]+(?:[.,][0-9]+)?")
_MARKS = frozenset(" \t\u00a0°º'’′\"”″:dms")
_LONGEST = 40


def sexagesimal_deg(text: str, hemispheres: str) -> float | None:
    r"""Return an angle of degrees, minutes and seconds in degrees, or None.

    Parameters
    ----------
    hemispheres : str
        The letters of positive and of negative angles: ``"NS"`` or ``"EW"``. A number alone needs
        one of them.

    Examples
    --------
    >>> sexagesimal_deg("60°10'12\"N", "NS"), sexagesimal_deg("W 8 30.6", "EW")
    (60.17, -8.51)
    >>> sexagesimal_deg("8,51 W", "EW"), sexagesimal_deg("-33:30:00", "NS")
    (-8.51, -33.5)
    >>> sexagesimal_deg("60°70'N", "NS"), sexagesimal_deg("60.5°30'N", "NS")
    (None, None)
    """
    text = text.strip()
    ends = {text[:1], text[-1:]}.intersection(hemispheres)
    if len(text) > _LONGEST or len(ends) > 1:
        return None
    letter = "".join(ends)
    bare = text.removesuffix(letter).removeprefix(letter).strip()
    size = bare.removeprefix("-")
    if letter and size != bare:
        return None
    parts = _NUMBER.findall(size)
    marks = set(_NUMBER.sub("", size))
    if not marks <= _MARKS or size[:1] in marks or not (1 if letter else 2) <= len(parts) <= 3:
        return None
    values = [float(part.replace(",", ".")) for part in parts]
    if any(value >= 60 for value in values[1:]) or not all(part.isdecimal() for part in parts[:-1]):
        return None
    size_deg: float = round(sum(value / 60**n for n, value in enumerate(values)), 12)
    return -size_deg if size != bare or letter == hemispheres[1] else size_deg
