"""What the sections of a configuration are made of: paths, numbers with bounds, strict sections."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    create_model,
)

from mapfilter._io import path_fault
from mapfilter.options import Options, annotations_of

EMBEDDED_MAP = "helsinki"
NO_MAP = "none"
SYNTHETIC_MAP = "synthetic"
MANHATTAN_MAP = "manhattan"
SYNTHETIC_MAPS = (SYNTHETIC_MAP, MANHATTAN_MAP)
MAP_NAMES = (EMBEDDED_MAP, NO_MAP, *SYNTHETIC_MAPS)
MAP_FILTERS = ("candidate", "bayes", "grid")
FUSION_FILTERS = ("ekf", "iekf", "rbukf", "ukf", "ckf")
_NAME = r"[^\W\d]\w*(\.[^\W\d]\w*)*"
_OWN_FILTER = re.compile(f"{_NAME}:{_NAME}")


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
        return path
    return value


def resolve_map(value: Any, info: ValidationInfo) -> Any:
    """Make a map's path absolute; the embedded map, made ones and no map have names."""
    found = value if value in MAP_NAMES else resolve_path(value, info)
    return str(found) if isinstance(found, Path) else value


def check_filter_name(value: str) -> str:
    """See that a filter is one of ours, or has the form ``package.module:Name``."""
    known = (*MAP_FILTERS, *FUSION_FILTERS)
    if value not in known and not _OWN_FILTER.fullmatch(value):
        names = ", ".join(map(repr, known))
        raise ValueError(f"{names}, or your own as package.module:Name")
    return value


FilePath = Annotated[Path, BeforeValidator(resolve_path)]
MapName = Annotated[str, BeforeValidator(resolve_map)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Box = Annotated[tuple[Finite, Finite, Finite, Finite], Field(strict=False)]
Pair = Annotated[tuple[Finite, Finite], Field(strict=False)]
Size = Annotated[tuple[Positive, Positive], Field(strict=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
FilterName = Annotated[str, AfterValidator(check_filter_name)]
Count = Annotated[int, Field(ge=0, le=1_000_000)]


OptionsT = TypeVar("OptionsT", bound=Options)
SectionT = TypeVar("SectionT", bound="Section")


class Section(BaseModel):
    """A section: frozen, and strict about its keys and the types of its values."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    def of(self, kind: type[OptionsT]) -> OptionsT:
        """Return the values of this section that an option dataclass takes."""
        return kind(**{field.name: getattr(self, field.name) for field in fields(kind)})


def with_options(*kinds: type[Options]) -> Callable[[type[SectionT]], type[SectionT]]:
    """Return a class decorator that gives a section the fields of option dataclasses.

    Names, limits and defaults are those of the dataclasses; what the section defines itself goes
    first. :meth:`Section.of` returns the dataclasses again.
    """

    def extended(section: type[SectionT]) -> type[SectionT]:
        given: dict[str, Any] = {}
        for kind in kinds:
            annotations = annotations_of(kind)
            for field in fields(kind):
                default = field.default
                if field.default_factory is not MISSING:
                    default = field.default_factory()
                if field.name not in section.model_fields:
                    given[field.name] = (annotations[field.name], default)
        return create_model(
            section.__name__,
            __base__=section,
            __module__=section.__module__,
            __doc__=section.__doc__,
            **given,
        )

    return extended
