"""JSON files: written whole, sealed by a checksum, and checked with the files that they list."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mapfilter._inputs import is_unicode, json_value, read_input
from mapfilter._io import atomic_file, sha256_file
from mapfilter.errors import Faults, OutputError, StoreError, fail

_LARGEST_JSON_BYTES = 256 << 20
_SEAL = "sha256"


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object atomically, keys in the order given."""
    with atomic_file(path) as temporary:
        text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object; raise StoreError where it is missing, cut off or something else."""
    data = read_input(path, _LARGEST_JSON_BYTES, "JSON", StoreError)
    return parse_json(data, str(path))


def parse_json(data: bytes, where: str) -> dict[str, Any]:
    """Return the JSON object that a file's bytes hold; raise StoreError for something else."""
    try:
        value = json_value(data)
    except (ValueError, RecursionError) as error:
        hint = "cut off" if isinstance(error, json.JSONDecodeError) else "edited or damaged"
        raise fail(StoreError, where, "JSON", f"no JSON ({error})", hint) from error
    if not is_unicode(value):
        hint = "half of a surrogate pair: text cut off, or decoded twice"
        raise fail(StoreError, where, "text in Unicode", "a lone surrogate", hint)
    if not isinstance(value, dict):
        raise fail(StoreError, where, "a JSON object", type(value).__name__)
    return value


def sealed(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object with the SHA-256 of all its other entries under ``sha256``."""
    rest = {key: item for key, item in value.items() if key != _SEAL}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"))
    return {**rest, _SEAL: hashlib.sha256(text.encode()).hexdigest()}


def check_seal(value: Mapping[str, Any], where: str) -> None:
    """Raise StoreError where an object that :func:`sealed` made was changed, if only by a digit."""
    if value.get(_SEAL) != sealed(value)[_SEAL]:
        expected, got = "entries as they were written", "others, by their SHA-256"
        raise fail(StoreError, where, expected, got, "edited or damaged")


def write_sealed(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object with its checksum, for :func:`read_sealed`."""
    write_json(path, sealed(value))


def read_sealed(path: Path) -> dict[str, Any]:
    """Read a JSON object; raise StoreError where it is missing, cut off or changed."""
    value = read_json(path)
    check_seal(value, str(path))
    return value


def check_version(where: str, found: object, known: int) -> None:
    """Raise StoreError where a file has another version than this mapfilter reads."""
    if found == known and not isinstance(found, bool):
        return
    newer = isinstance(found, int) and found > known
    older = isinstance(found, int) and not isinstance(found, bool) and 0 < found < known
    hint = "written by a newer mapfilter; update it" if newer else "edited or damaged"
    if older:
        hint = "written by an older mapfilter; make it again"
    raise fail(StoreError, where, f"version {known}", found, hint)


def check_part(file: Path, part: Mapping[str, Any], faults: Faults, *, full: bool = True) -> bool:
    """Note where a file is missing or has another size (``full``: or SHA-256) than its entry."""
    size, digest, before = part.get("bytes"), str(part.get("sha256")), len(faults.found)
    if not file.is_file():
        faults.add(str(file), f"a file of {size} bytes", "no such file", "not copied whole")
    elif (found := file.stat().st_size) != size:
        faults.add(str(file), f"{size} bytes", f"{found} bytes", "cut off or overwritten")
    elif full and (of_file := sha256_file(file)) != digest:
        expected, got = f"SHA-256 {digest[:12]}…", f"{of_file[:12]}…"
        faults.add(str(file), expected, got, "changed after it was written")
    return len(faults.found) == before


def check_replaceable(folder: Path, head: str, what: str, own: Callable[[str], bool]) -> None:
    """Raise OutputError where a folder, which may be absent, holds files of others.

    Those of mapfilter are listed as ``parts`` in the JSON file ``head``, with ``what`` as format,
    and are as they were written: their names are ``own``, and their checksums those of the list.
    A list that was edited is not believed.
    """
    inner = folder.rglob("*") if folder.is_dir() else ()
    found = {p.relative_to(folder).as_posix() for p in inner if p.is_symlink() or not p.is_dir()}
    try:
        value = read_json(folder / head)
        if _SEAL in value:
            check_seal(value, head)
    except StoreError:
        value = {}
    if value.get("format") == what and isinstance(parts := value.get("parts"), list):
        listed = {str(one.get("path")): one for one in parts if isinstance(one, dict)}
        names = filter(own, found & set(listed))
        found -= {head, *(name for name in names if _as_listed(folder, listed[name]))}
    if foreign := sorted(found):
        got = f"other files ({', '.join(foreign[:3])}{', …' if len(foreign) > 3 else ''})"
        hint = "a mistyped path, or files edited since; choose another, or move the files away"
        raise fail(OutputError, str(folder), f"a {what}, or nothing yet", got, hint)


def _as_listed(folder: Path, part: Mapping[str, Any]) -> bool:
    try:
        return sha256_file(folder / str(part["path"])) == part.get("sha256")
    except (OSError, StoreError):
        return False
