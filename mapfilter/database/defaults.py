"""What a build takes where nothing is given; apart from the build for configurations."""

from __future__ import annotations

from typing import Final

MARGIN_DB: Final = 6.0
"""A point belongs to each cell that is at most so much weaker than the strongest one there."""

TILE_PX: Final = 256
"""Side of a tile, in pixels."""
