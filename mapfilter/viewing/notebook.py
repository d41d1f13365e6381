"""Views as notebooks show them: a page in a frame of its own, or a small table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from mapfilter.viewing.page import page_html, write_page


@dataclass(frozen=True, repr=False, eq=False)
class View:
    """An interactive page: a notebook shows it in place, and :meth:`save` writes it as a file.

    Parameters
    ----------
    bundle : mapping
        What it shows.
    height_px : int
        Height of the frame in a notebook.
    """

    bundle: Mapping[str, Any]
    height_px: int = 720

    def __repr__(self) -> str:
        return f"View of {self.bundle['title']!r}; save(path) writes it as an HTML file"

    def _repr_html_(self) -> str:
        """Return the page in a frame without access to the notebook."""
        look = f"width:100%;height:{int(self.height_px)}px;border:0"
        page = escape(page_html(self.bundle), quote=True)
        title = escape(str(self.bundle["title"]), quote=True)
        return (
            f'<iframe sandbox="allow-scripts allow-downloads" title="{title}" style="{look}" '
            f'srcdoc="{page}"></iframe>'
        )

    def save(self, path: str | Path) -> Path:
        """Write the page as a self-contained HTML file, and return its path.

        An older page is replaced.

        Raises
        ------
        OutputError
            There is a file that is no such page, or the file cannot be written.
        """
        file = Path(path)
        write_page(self.bundle, file)
        return file
