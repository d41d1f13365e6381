"""Write pictures that ``plot`` methods drew."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from mapfilter._arguments import Argument, check_arguments, path_argument

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@runtime_checkable
class _Drawn(Protocol):
    def plot(self) -> Any: ...


def save_picture(picture: Axes | Figure, path: Path | str | os.PathLike[str]) -> Path:
    """Write the picture of a ``plot`` method: PNG, SVG or PDF, by the suffix of the path.

    The whole figure of the axes is written, with 150 pixels per inch. Equal pictures give equal
    bytes; a missing folder is made.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ConfigError
        It is no picture, or no path.
    OutputError
        The suffix is another one, or the file cannot be written.
    """
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mapfilter.report.saving import save

    check_arguments(
        "save_picture",
        Argument(
            "picture",
            picture,
            Axes | Figure,
            "axes or a figure, as plot returns them",
            ((_Drawn, "what plot() of it returns"),),
        ),
        path_argument("path", path),
    )
    return save(picture, Path(path))
