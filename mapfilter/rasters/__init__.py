"""RxLev rasters: the formats of planning tools, lattices, resampling, and the GeoTIFFs written."""
