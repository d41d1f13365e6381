"""What the sections of a configuration are made of: paths, numbers with bounds, strict sections."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo

EMBEDDED_MAP = "helsinki"


def resolve_path(value: Any, info: ValidationInfo) -> Any:
    """Make a path relative to the configuration file absolute."""
    if isinstance(value, str | Path) and str(value):
        folder = info.context["folder"] if info.context else ""
        return Path(folder) / Path(value).expanduser()
    return value


def resolve_map(value: Any, info: ValidationInfo) -> Any:
    """Make a map's path absolute; the embedded map has a name."""
    found = resolve_path(value, info)
    return str(found) if isinstance(found, Path) and value != EMBEDDED_MAP else value


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
Count = Annotated[int, Field(ge=0, le=1_000_000)]


class Section(BaseModel):
    """A section: frozen, and strict about its keys and the types of its values."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
