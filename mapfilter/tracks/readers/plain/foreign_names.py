"""Names of columns in German, French, Spanish, Chinese and Japanese.

Most are those that programs write into logs of positions, others the usual words; each has one
meaning in such logs. Words with several are left out: a person names their columns.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

FOREIGN: Mapping[str, tuple[str, ...]] = {
    "time": (
        *("uhrzeit", "heure", "horodatage", "hora"),
        *("时间", "gnss时间", "gps时间", "時間", "日時", "時刻"),
    ),
    "lat_deg": ("breitengrad", "latitud", "纬度", "緯度"),
    "lon_deg": (
        *("längengrad", "laengengrad", "longitud"),
        *("经度", "經度", "経度"),
    ),
    "altitude_m": ("altitud", "海拔", "海拔高度", "高度", "標高"),
    "accuracy_m": ("genauigkeit", "gps-genauigkeit", "précision", "precisión", "precision"),
}
"""Names by field; their values are in the usual units of phones."""

FOREIGN_QUANTITIES: Mapping[str, tuple[str, ...]] = {
    **FOREIGN,
    "altitude_m": (*FOREIGN["altitude_m"], "höhe", "gps höhe"),
    "accuracy_m": (*FOREIGN["accuracy_m"][2:], "genauigkeit", "gps genauigkeit"),
    "speed_mps": (
        *("geschwindigkeit", "gps geschwindigkeit", "vitesse", "velocidad"),
        *("速度", "gnss速度", "gps速度"),
    ),
    "course_deg": ("rumbo", "cap", "航向", "航向角"),
}
"""Words for quantities, beside a unit."""

BESIDE_PLACES = frozenset(
    name for field in ("speed_mps", "course_deg") for name in FOREIGN_QUANTITIES[field]
)
"""Words that mean those of a receiver beside positions; alone they may be of a vehicle."""

ENCODINGS = ("gb18030", "cp932")
"""Of Chinese and Japanese texts that spreadsheets save as CSV."""


def eastern_encoding(line: bytes) -> str:
    """Return the encoding in which a line of names has one for latitude; "" for none.

    Examples
    --------
    >>> eastern_encoding("时间,经度,纬度".encode("gb18030")), eastern_encoding(b"time,lat")
    ('gb18030', '')
    """
    words = [word for word in FOREIGN["lat_deg"] if not word.isascii()]
    for encoding in ENCODINGS:
        try:
            text = line.decode(encoding)
        except UnicodeDecodeError:
            continue
        if any(word in text for word in words):
            return encoding
    return ""


def note_on_foreign(columns: Mapping[str, str], own: Collection[str]) -> str:
    """Return a note on the fields whose columns have names in other languages; "" for none.

    Parameters
    ----------
    columns : mapping of str to str
        Columns by field.
    own : collection of str
        Fields that a person names.

    Examples
    --------
    >>> note_on_foreign({"time": "time", "lat_deg": "latitud"}, ())
    'names of columns in another language: lat_deg=latitud'
    """
    known = {name for names in FOREIGN.values() for name in names}
    told = [
        f"{field}={name}" for field, name in columns.items() if name in known and field not in own
    ]
    return f"names of columns in another language: {', '.join(told)}" if told else ""
