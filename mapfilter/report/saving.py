"""Pictures written as files; equal data give equal bytes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mapfilter._io import atomic_file
from mapfilter.errors import OutputError, fail
from mapfilter.report.canvas import DPI, Drawn, figure_of, saved

_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
"""Versions and dates are left out of files: they would change the bytes from one to the next."""

_WRITER: dict[str, dict[str, Any]] = {
    # A third of the time of the default level, and files a tenth larger.
    "png": {"pil_kwargs": {"compress_level": 3}},
    "svg": {},
    "pdf": {},
}

_MOST_LAYOUTS, _SETTLED = 5, 0.005
"""How often maps are laid out again, and how far axes may move still, as a share of the figure."""


@saved
def save(drawn: Drawn, path: Path) -> Path:
    """Write what a ``plot_*`` function returned as PNG, SVG or PDF, by the suffix, in one step.

    The folder is made where it is missing; the path is returned.

    Raises
    ------
    OutputError
        The suffix is another one, or the file cannot be written.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in _METADATA:
        raise fail(OutputError, str(path), "a name that ends in .png, .svg or .pdf", path.name)
    figure = drawn if isinstance(drawn, Figure) else figure_of(drawn)
    with atomic_file(path) as temporary:
        _write(figure, temporary, kind)
    return path


@saved
def png_of(drawn: Drawn) -> bytes:
    """Return the bytes of the PNG that :func:`save` would write."""
    stream = BytesIO()
    _write(drawn if isinstance(drawn, Figure) else figure_of(drawn), stream, "png")
    return stream.getvalue()


def _write(figure: Figure, target: Path | BytesIO, kind: str) -> None:
    with _laid_out(figure):
        figure.savefig(target, format=kind, dpi=DPI, metadata=_METADATA[kind], **_WRITER[kind])


@contextmanager
def _laid_out(figure: Figure) -> Iterator[None]:
    """Lay a figure out now, and not while it is saved: matplotlib would draw it twice to do so."""
    engine, dpi = figure.get_layout_engine(), figure.dpi
    if engine is None:
        yield
        return
    figure.set_dpi(DPI)
    engine.execute(figure)
    if any(axes.get_aspect() != "auto" for axes in figure.axes):
        # Room for titles and labels is that around axes as they were before: of another shape.
        before = np.full((len(figure.axes), 4), np.inf)
        for _ in range(_MOST_LAYOUTS):
            placed = np.array([axes.get_position(original=True).bounds for axes in figure.axes])
            if np.abs(placed - before).max() < _SETTLED:
                break
            before = placed
            engine.execute(figure)
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.set_dpi(dpi)
