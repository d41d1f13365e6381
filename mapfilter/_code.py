"""Which code computes: finished parts of another one are not taken over, nor results of workers."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_COMPUTING = ("numpy", "scipy", "numba", "pyarrow", "pandas", "shapely", "rasterio", "pyproj")


@cache
def code_digest() -> str:
    """Return a checksum of the package's sources, of Python, and of the libraries that compute.

    The version of the package alone does not tell two states of a checkout apart.
    """
    digest = hashlib.sha256(platform.python_version().encode())
    for name in _COMPUTING:
        digest.update(f"\0{name} {_version(name)}".encode())
    folder = Path(__file__).parent
    for file in sorted(folder.rglob("*.py")):
        digest.update(f"\0{file.relative_to(folder).as_posix()}\0".encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"
