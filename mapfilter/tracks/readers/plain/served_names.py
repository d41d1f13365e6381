"""Columns of the serving cell whose names say so, such as ``LTE PCell RSRP`` or ``PCI (serving)``.

Drive test tools export them, beside those of further carriers and of neighbours.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from mapfilter._header_units import parted_unit
from mapfilter.tracks.readers.plain.fields import usual_fields

_TECHNOLOGIES = {
    **dict.fromkeys(("lte", "4g", "eutra"), "lte"),
    **dict.fromkeys(("nr", "5g", "nr5g"), "nr"),
    **dict.fromkeys(("wcdma", "umts", "3g"), "umts"),
    **dict.fromkeys(("gsm", "2g"), "gsm"),
}
_SERVING = {"pcell", "pcc", "serving", "serv", "primary", "servingcell"}
_ASIDE = {"kpi", "info", "smart", "phone"}
"""Words that export formats add, and that tell nothing."""
_JOINED = re.compile(r"^(serving|pcell)(?=(?:rsrp|rscp|pci|psc|earfcn|uarfcn|arfcn|tac|lac)$)")
_MEANT = {
    **dict.fromkeys(("rsrp", "ss rsrp", "rscp"), "level [dbm]"),
    **dict.fromkeys(("pci", "physical cell id", "physical cell identity", "physcellid"), "pci"),
    **dict.fromkeys(("psc", "scrambling code"), "psc"),
    "bsic": "bsic",
    **dict.fromkeys(("arfcn", "dl arfcn", "arfcn dl"), "arfcn"),
    **dict.fromkeys(("earfcn", "dl earfcn", "earfcn dl", "downlink earfcn"), "earfcn"),
    **dict.fromkeys(("uarfcn", "dl uarfcn", "uarfcn dl"), "uarfcn"),
    **dict.fromkeys(("enodeb id", "enodeb", "enb id", "enb"), "enodeb_id"),
    **dict.fromkeys(("cell id", "cellid", "cell identity", "ci", "cid"), "cell_id"),
    "eci": "eci",
    "nci": "nci",
    "tac": "tac",
    "lac": "lac",
    "mcc": "mcc",
    "mnc": "mnc",
    **dict.fromkeys(("timing advance", "ta"), "timing_advance"),
}
"""Names of columns by the words that are left."""
_OF_TECHNOLOGY = {("arfcn", "nr"): "nr_arfcn", ("arfcn", "lte"): "earfcn"}
_NO_UNITS = ("", "dbm")
_WORD = re.compile(r"[a-z0-9]+")


def served_name(column: str) -> str:
    """Return the usual name of a column of the serving cell; "" of another column.

    Examples
    --------
    >>> served_name("lte pcell rsrp"), served_name("pci (serving)"), served_name("nr-arfcn")
    ('level [dbm]', 'pci', 'nr_arfcn')
    >>> served_name("servingrsrp"), served_name("smart phone lte serving cell info pci")
    ('level [dbm]', 'pci')
    >>> served_name("lte scell1 rsrp"), served_name("rsrp"), served_name("serving cell")
    ('', '', '')
    """
    text, unit = parted_unit(column)
    words = _WORD.findall(_JOINED.sub(r"\1 ", text))
    words = [word for word in words if word not in _ASIDE]
    # The cell of "serving cell rsrp" is no part of the quantity.
    beside = [at for at, word in enumerate(words) if word in _SERVING and word[-4:] != "cell"]
    dropped = {
        at + 1 for at in beside if words[at + 1 : at + 2] == ["cell"] and at + 2 < len(words)
    }
    left = [
        word
        for at, word in enumerate(words)
        if not (word in _SERVING or word in _TECHNOLOGIES or at in dropped)
    ]
    if len(left) == len(words) or unit not in _NO_UNITS:
        return ""
    meant = _MEANT.get(" ".join(left), "")
    if unit and meant != "level [dbm]":
        return ""
    technology = next((_TECHNOLOGIES[word] for word in words if word in _TECHNOLOGIES), "")
    return _OF_TECHNOLOGY.get((meant, technology), meant)


def states_serving(column: str) -> bool:
    """Return whether a name states that its column is of the serving cell, not a technology alone.

    Examples
    --------
    >>> states_serving("lte pcell rsrp"), states_serving("lte rsrp")
    (True, False)
    """
    words = _WORD.findall(_JOINED.sub(r"\1 ", column.lower()))
    return any(word in _SERVING and word != "primary" for word in words)


def with_served_names(names: Sequence[str], own: Collection[str] = ()) -> tuple[str, ...]:
    """Return names of columns, those of the serving cell by their usual ones.

    Of several columns that would have one name, as of LTE and of NR, none is renamed, nor is one of
    a field that another column holds, or that a user names.

    Examples
    --------
    >>> with_served_names(["time", "lte pcell rsrp", "lte pcell pci", "lte scell1 rsrp"])
    ('time', 'level [dbm]', 'pci', 'lte scell1 rsrp')
    >>> with_served_names(["time", "lte rsrp", "nr rsrp"])
    ('time', 'lte rsrp', 'nr rsrp')
    """
    meant = {name: served_name(name) for name in names if name not in own}
    taken = usual_fields([name for name in names if not meant.get(name)])
    found = []
    for name in names:
        usual = meant.get(name, "")
        fields = usual_fields([usual.removesuffix(" [dbm]") + "_dbm" if "[" in usual else usual])
        once = usual and list(meant.values()).count(usual) == 1 and names.count(name) == 1
        found.append(usual if once and not fields.keys() & taken.keys() else name)
    return tuple(found)
