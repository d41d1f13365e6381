"""One self-contained HTML file: the page's template, styles, scripts and the bundle in it."""

from __future__ import annotations

import gzip
import io
import json
import math
import re
import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from html import escape
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from mapfilter._inputs import json_value, read_input
from mapfilter._io import atomic_file, check_replaceable
from mapfilter.errors import StoreError, fail
from mapfilter.viewing.bundle import FORMAT, VERSION

OPENING = '<script id="mapfilter-bundle" type="text/plain">'
"""Tag before the bundle, which base64 of gzip of JSON follows up to the next tag."""

_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src 'none'; base-uri 'none'; form-action 'none'"
)
_MOST_BYTES = 512 << 20
_LEVEL = 6


def compressed(bundle: Mapping[str, Any]) -> bytes:
    """Return a bundle as gzip of JSON; equal bundles give equal bytes."""
    text = json.dumps(_plain(bundle), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return gzip.compress(text.encode("ascii"), _LEVEL, mtime=0)


def encoded(bundle: Mapping[str, Any]) -> str:
    """Return a bundle as text without any character that HTML gives a meaning to."""
    return b64encode(compressed(bundle)).decode("ascii")


def style_text() -> str:
    """Return the styles of the page."""
    return "\n".join([*_texts(_folder() / "vendor", ".css"), *_texts(_folder(), ".css")])


def script_text() -> str:
    """Return the scripts of the page, in the order of their names."""
    return "\n".join([*_texts(_folder() / "vendor", ".js"), *_texts(_folder(), ".js")])


def page_html(bundle: Mapping[str, Any]) -> str:
    """Return the page with a bundle in it."""
    # A script ends at this text wherever it stands; in a string of JavaScript both are the same.
    script = script_text().replace("</script", "<\\/script")
    head = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
    return _filled(
        title=escape(str(bundle.get("title", ""))),
        head=f"{head}<style>{style_text()}</style>",
        foot=f"{OPENING}{encoded(bundle)}</script>\n<script>{script}</script>",
    )


def live_html(query: str = "") -> str:
    """Return the page without a bundle, which loads its files and a session from a service.

    Parameters
    ----------
    query : str
        Added to the addresses of its files.
    """
    added = escape(query, quote=True)
    return _filled(
        title="mapfilter",
        head=f'<link rel="stylesheet" href="page.css{added}">',
        foot=f'<script src="page.js{added}"></script>',
    )


def _filled(*, title: str, head: str, foot: str) -> str:
    html = (_folder() / "page.html").read_text(encoding="utf-8")
    parts = {"{{TITLE}}": title, "{{HEAD}}": head, "{{FOOT}}": foot}
    # Cut at all markers at once, so that one in a title is none.
    pieces = re.split("|".join(f"({re.escape(marker)})" for marker in parts), html)
    return "".join(parts.get(piece, piece) for piece in pieces if piece is not None)


def _folder() -> Traversable:
    return resources.files("mapfilter.viewing") / "page"


def write_page(bundle: Mapping[str, Any], path: Path) -> None:
    """Write the page with a bundle in it; an older page is replaced.

    Raises
    ------
    OutputError
        There is a file that is no such page, or the file cannot be written.
    """
    check_replaceable(path, _is_page, "an older page")
    with atomic_file(path) as temporary:
        temporary.write_text(page_html(bundle), encoding="utf-8")


def read_page(path: Path) -> dict[str, Any]:
    """Return the bundle of a page.

    Raises
    ------
    StoreError
        The file is missing, too large, damaged, of a newer version, or no such page.
    """
    where, what = str(path), "a page that mapfilter wrote"
    text = read_input(path, _MOST_BYTES, what, StoreError).decode("utf-8", errors="replace")
    _, opening, rest = text.partition(OPENING)
    if not opening:
        raise fail(StoreError, where, what, "no bundle in it")
    try:
        packed = b64decode(rest.partition("<")[0].strip(), validate=True)
        bundle = json_value(_unzipped(packed))
    except (ValueError, OSError, EOFError, zlib.error) as error:
        raise fail(StoreError, where, what, f"{error}", "cut off") from error
    if not isinstance(bundle, dict) or bundle.get("format") != FORMAT:
        raise fail(StoreError, where, what, "another format")
    if bundle.get("version") != VERSION:
        hint = "made by another version of mapfilter; make it again"
        raise fail(StoreError, where, f"version {VERSION}", bundle.get("version"), hint)
    return bundle


def _is_page(path: Path) -> bool:
    """Return whether a file holds a bundle, of whichever version."""
    try:
        text = read_input(path, _MOST_BYTES, "a page", StoreError)
    except StoreError:
        return False
    return OPENING.encode() in text


def _unzipped(packed: bytes) -> bytes:
    with gzip.GzipFile(fileobj=io.BytesIO(packed)) as stream:
        text = stream.read(_MOST_BYTES + 1)
    if len(text) > _MOST_BYTES:
        raise ValueError("more than 512 MB of it")
    return text


def _texts(folder: Traversable, ending: str) -> list[str]:
    if not folder.is_dir():
        return []
    files = sorted((one for one in folder.iterdir() if one.name.endswith(ending)), key=_name)
    return [one.read_text(encoding="utf-8") for one in files]


def _name(file: Traversable) -> str:
    return file.name


def _plain(value: Any) -> Any:
    """Return JSON types, with None for numbers that JSON has not."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
