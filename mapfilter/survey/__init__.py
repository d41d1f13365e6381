"""Drive tests: measured levels to rasters, cell positions and their validation."""
