"""What the sections of a configuration are made of: paths, numbers with bounds, strict sections."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ClassVar, TypeVar

from annotated_types import Ge, Le
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    create_model,
)

from mapfilter._annotations import Words, plain_types
from mapfilter._inputs import path_fault
from mapfilter.options import Options, Positive, annotations_of, describe_options
from mapfilter.positioning.locators import BUILT_IN

EMBEDDED_MAP = "helsinki"
NO_MAP = "none"
SYNTHETIC_MAP = "synthetic"
MANHATTAN_MAP = "manhattan"
SYNTHETIC_MAPS = (SYNTHETIC_MAP, MANHATTAN_MAP)
MAP_NAMES = (EMBEDDED_MAP, NO_MAP, *SYNTHETIC_MAPS)
_NAME = r"[^\W\d]\w{0,63}+(?:\.[^\W\d]\w{0,63}+){0,15}"
_CUSTOM_FILTER = re.compile(rf"\A{_NAME}:{_NAME}")


def resolve_path(value: Any, info: ValidationInfo) -> Any:
    """Make a path relative to the configuration file absolute."""
    if isinstance(value, str | Path) and str(value):
        folder = info.context["folder"] if info.context else ""
        try:
            path = Path(folder) / Path(value).expanduser()
        except RuntimeError as error:
            raise ValueError("a path whose ~ is the folder of a user") from error
        if fault := path_fault(path):
            raise ValueError(fault)
        return _without_dots(path)
    return value


def _without_dots(path: Path) -> Path:
    """Return a path that names no folder that is left again, for what is printed.

    Links that follow stay: what a file is, is told by its own name and not by that of its target,
    which in a store of data has no suffix.
    """
    parts = path.parts
    if ".." not in parts:
        return path
    after = len(parts) - parts[::-1].index("..")
    return Path(os.path.realpath(Path(*parts[:after])), *parts[after:])


def resolve_map(value: Any, info: ValidationInfo) -> Any:
    """Make a map's path absolute; the embedded map, made ones and no map have names."""
    found = value if value in MAP_NAMES else resolve_path(value, info)
    return str(found) if isinstance(found, Path) else value


def check_filter_name(value: str) -> str:
    """Check that a filter is built in, or has the form ``package.module:Name``."""
    if value not in BUILT_IN and not _CUSTOM_FILTER.fullmatch(value):
        names = ", ".join(map(repr, BUILT_IN))
        raise ValueError(f"{names}, or a custom filter as package.module:Name")
    return value


def listed_file(value: Any) -> Any:
    """Let one file stand for a list of one."""
    return [value] if isinstance(value, str) else value


FilePath = Annotated[Path, BeforeValidator(resolve_path)]
Files = Annotated[tuple[FilePath, ...], BeforeValidator(listed_file), Field(strict=False)]
MapName = Annotated[str, BeforeValidator(resolve_map)]
Box = Annotated[
    tuple[float, float, float, float],
    Field(strict=False),
    Words("four numbers: west, south, east, north"),
]
Pair = Annotated[
    tuple[float, float], Field(strict=False), Words("two numbers: longitude, latitude")
]
Size = Annotated[
    tuple[Positive, Positive],
    Field(strict=False),
    Words("two numbers: metres east, metres north"),
]
FilterName = Annotated[str, AfterValidator(check_filter_name)]
Count = Annotated[int, Ge(1), Le(1_000_000)]


OptionsT = TypeVar("OptionsT", bound=Options)
SectionT = TypeVar("SectionT", bound="Section")


class Section(BaseModel):
    """A section: frozen, and strict about its keys and the types of its values."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
    kinds: ClassVar[tuple[type[Options], ...]] = ()

    def of(self, kind: type[OptionsT], **others: Any) -> OptionsT:
        """Return an option dataclass with the values of this section, and of further fields."""
        own = type(self).model_fields
        values = {one.name: getattr(self, one.name) for one in fields(kind) if one.name in own}
        return kind(**values | others)


class Columns(Section):
    """A section of columns of a table, each with a value or none, such as its name."""

    @property
    def given(self) -> dict[str, Any]:
        """The values of the columns that have one."""
        return {name: column for name, column in self if column is not None}


def field_annotation(section: type[BaseModel], name: str) -> Any:
    """Return the annotation of a field of a section, with its limits."""
    field = section.model_fields[name]
    annotation: Any = field.annotation
    return Annotated[annotation, *field.metadata] if field.metadata else annotation


def with_options(
    *kinds: type[Options], without: Sequence[str] = (), optional: bool = False
) -> Callable[[type[SectionT]], type[SectionT]]:
    """Return a class decorator that gives a section the fields of option dataclasses.

    Names, limits and defaults are those of the dataclasses (None if ``optional``), but for fields
    that the section defines itself and for those in ``without``. A :class:`~pathlib.Path` is a
    file's, relative to the configuration file. :meth:`Section.of` returns the dataclasses again.
    """

    def extended(section: type[SectionT]) -> type[SectionT]:
        given: dict[str, Any] = {}
        for kind in kinds:
            annotations = annotations_of(kind)
            for info in describe_options(kind):
                if info.name not in (*section.model_fields, *without):
                    wanted = _of_file(annotations[info.name])
                    given[info.name] = (wanted | None, None) if optional else (wanted, info.default)
        made = _extended(section, given)
        made.kinds = kinds
        return made

    return extended


def _of_file(annotation: Any) -> Any:
    """Return the annotation of a key for that of an option: paths become files' paths."""
    types = plain_types(annotation)
    if Path not in types:
        return annotation
    return FilePath | None if NoneType in types else FilePath


def with_columns(*names: str) -> Callable[[type[SectionT]], type[SectionT]]:
    """Return a class decorator that gives a section an optional text for each name."""

    def extended(section: type[SectionT]) -> type[SectionT]:
        return _extended(section, dict.fromkeys(names, (str | None, None)))

    return extended


def _extended(section: type[SectionT], given: dict[str, Any]) -> type[SectionT]:
    return create_model(
        section.__name__,
        __base__=section,
        __module__=section.__module__,
        __doc__=section.__doc__,
        **given,
    )
