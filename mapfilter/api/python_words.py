"""Messages that name options of the commands, in the words of Python's arguments."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from typing import ParamSpec

from mapfilter.errors import MapfilterError, notes_of
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.log import TrackLog

P = ParamSpec("P")

_COMMAND = re.compile(r"(mapfilter [a-z]+ [^;)]*)")
"""A whole command to be called in a shell, which stays."""
_OPTION = re.compile(
    r"(?<![\w-])--(?P<name>[a-z][a-z-]*[a-z])"
    r"(?: (?P<key>[\w.-]+)=(?P<value>[^'\s,;)]+))?"
)
_QUOTED = re.compile(r"--column '(\w+)=([^']+)'")
_MAPPINGS = {"column": "columns", "factor": "factors", "offset": "offsets_s"}
_ARGUMENTS = {
    **{name: name for name in ("crs", "format", "zone", "truth")},
    "course-motion": "course_motion",
    "db": "database",
    "filter": "filter",
    "log": "paths",
    "origin": "origin_deg",
    "pose": "walk=WalkOptions(pose=…)",
    "declination": "walk=WalkOptions(declination_deg=…)",
    "step-length": "walk=WalkOptions(step_m=…)",
}
_WITH_VALUE = re.compile(
    r"(?<![\w-])--(crs|filter|truth|format) (EPSG:\w+|ekf|\S+\.\w+|[a-z]+(?=, or none))"
)
_PLACE = re.compile(r"(?<![\w-])--origin LAT,LON")
_SETTING = re.compile(
    r"\bfilter\.(?P<of>bayes|grid|kalman)\.(?P<name>\w+)(?: = (?P<value>[\w.]*\w))?"
)
_OPTIONS = {"bayes": "BayesFilter", "grid": "GridFilter", "kalman": "KalmanFilter"}
_PLAN_LAYOUT = re.compile(r'\bcells\.layout = "(\w+)"')
_PLAN_COLUMN = re.compile(r"\bcells\.columns\.(\w+)")
_PLAN_CRS = re.compile(r"(?<![\w./\\-])cells\.crs\b(?!\.\w)")
_PLAN_DEFAULT = re.compile(r"(?<![\w./\\-])cells\.([a-z]+_[a-z_]+)\b(?!\.\w)")
"""A setting, and no name of a file."""
_RASTERS = 'rasters.resolution_m and rasters.resampling = "bilinear"'
_OPENED = 'mf.open_rasters(…, resolution_m=…, resampling="bilinear")'


def in_python(text: str) -> str:
    """Return a message with arguments of Python in place of options of commands and of settings.

    Examples
    --------
    >>> in_python("turns run clockwise (--factor turn_rad=-1 mends it)")
    'turns run clockwise (factors={"turn_rad": -1} mends it)'
    >>> in_python("give --zone or --offset; --column 'speed_mps=v [m/s]'")
    'give zone or offsets_s; columns={"speed_mps": "v [m/s]"}'
    >>> in_python("mapfilter convert --crs EPSG:CODE; --crs EPSG:CODE")
    'mapfilter convert --crs EPSG:CODE; crs="EPSG:CODE"'
    >>> in_python("if a vehicle moved, set filter.bayes.vehicle = true")
    'if a vehicle moved, set BayesFilter(vehicle=True)'
    >>> in_python("filter.bayes.level_error_db = 7.5 (filter.kalman.fix_sd_m).")
    'BayesFilter(level_error_db=7.5) (fix_sd_m of KalmanFilter).'
    >>> in_python('set cells.layout = "atoll", or name it in cells.columns.east')
    'set layout="atoll", or name it in columns={"east": …}'
    >>> in_python("set cells.eirp_dbm; else name what it holds in [cells.columns]")
    'set defaults={"eirp_dbm": …}; else name what it holds in columns'
    >>> in_python("metres where EPSG:32635 is used, or their CRS in cells.crs")
    'metres where EPSG:32635 is used, or their CRS in plan_crs'
    >>> in_python("cells.new_plan.csv row 7")
    'cells.new_plan.csv row 7'
    """
    text = _PLAN_LAYOUT.sub(r'layout="\1"', text).replace("[cells.columns]", "columns")
    text = _PLAN_COLUMN.sub(r'columns={"\1": …}', text)
    text = _PLAN_CRS.sub("plan_crs", text)
    text = _PLAN_DEFAULT.sub(r'defaults={"\1": …}', text)
    text = _SETTING.sub(_option, text).replace(_RASTERS, _OPENED)
    text = text.replace("--zone of convert and replay", "zone of mf.read_log")
    parts = _COMMAND.split(text)
    return "".join(part if n % 2 else _without_options(part) for n, part in enumerate(parts))


@contextmanager
def python_words() -> Iterator[None]:
    """Name arguments of Python in errors that are raised within; also decorates a function."""
    try:
        yield
    except MapfilterError as error:
        error.faults = tuple(
            replace(
                one,
                where=in_python(one.where),
                expected=in_python(one.expected),
                hint=in_python(one.hint),
            )
            for one in error.faults
        )
        error.args = (error.faults,)
        if notes := notes_of(error):
            error.__notes__[:] = map(in_python, notes)
        raise


def python_log(make: Callable[P, TrackLog]) -> Callable[P, TrackLog]:
    """Decorate what makes a log: its errors and the log's notes are in these words."""

    @wraps(make)
    def made(*args: P.args, **named: P.kwargs) -> TrackLog:
        with python_words():
            log = make(*args, **named)
        return replace(log, notes=tuple(dict.fromkeys(map(in_python, log.notes))))

    return made


def python_plan(make: Callable[P, CellPlan]) -> Callable[P, CellPlan]:
    """Decorate what makes a cell plan: its errors and the plan's notes are in these words."""

    @wraps(make)
    def made(*args: P.args, **named: P.kwargs) -> CellPlan:
        with python_words():
            plan = make(*args, **named)
        return replace(plan, notes=tuple(map(in_python, plan.notes)))

    return made


def _without_options(text: str) -> str:
    text = _QUOTED.sub(r'columns={"\1": "\2"}', text)
    text = _PLACE.sub("origin_deg=(LAT, LON)", text)
    text = _WITH_VALUE.sub(lambda found: f'{_ARGUMENTS[found[1]]}="{found[2]}"', text)
    return _OPTION.sub(_argument, text)


def _option(found: re.Match[str]) -> str:
    of, value = _OPTIONS[found["of"]], found["value"]
    if value is None:
        return f"{found['name']} of {of}"
    shown = value.capitalize() if value in ("true", "false") else value
    return f"{of}({found['name']}={shown})"


def _argument(found: re.Match[str]) -> str:
    name, key, value = found["name"], found["key"], found["value"]
    given = "" if key is None else f" {key}={value}"
    if name in _MAPPINGS:
        if key is None:
            return _MAPPINGS[name]
        shown = f'"{value}"' if name == "column" else value
        return f'{_MAPPINGS[name]}={{"{key}": {shown}}}'
    return _ARGUMENTS.get(name, f"--{name}") + given
