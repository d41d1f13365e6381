"""What a text that is no coordinate reference system most likely means."""

from __future__ import annotations

import re

_LONGEST_MEANT = 40


def meant_crs(text: str) -> str:
    """Return what a text that is no CRS most likely means, or "".

    Examples
    --------
    >>> meant_crs("UTM35"), meant_crs("epsg 32635"), meant_crs("utm zone 34 S"), meant_crs("x")
    ('EPSG:32635, or EPSG:32735 south of the equator', 'EPSG:32635', 'EPSG:32734', '')
    """
    if len(text) > _LONGEST_MEANT:
        return ""
    if code := re.fullmatch(r"(?:epsg)?[\s:_-]{0,3}([0-9]{4,6})", text.strip(), re.IGNORECASE):
        meant = f"EPSG:{code[1]}"
        return meant if meant != text.strip().upper() else ""
    utm = r"\bUTM[\s_-]{0,3}(?:zone)?[\s_-]{0,3}([0-9]{1,2})[\s_-]{0,3}(N|S|north|south)?\s{0,3}"
    zone = re.search(rf"{utm}$", text, re.IGNORECASE)
    if zone is None or not 1 <= int(zone[1]) <= 60:
        return ""
    north, south = f"EPSG:326{int(zone[1]):02}", f"EPSG:327{int(zone[1]):02}"
    known = {"N": north, "S": south}
    return known.get((zone[2] or "")[:1].upper(), f"{north}, or {south} south of the equator")
