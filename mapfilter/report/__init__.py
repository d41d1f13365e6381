"""Pictures of maps, beliefs and errors; no other package draws.

Arguments of the same name mean the same in all ``plot_*`` functions: ``base`` is the map below,
``lattice`` is where the pixels of a raster, (rows, cols), lie, ``plan`` gives the sites, sector
azimuths and indoor cells to mark (those outside the map's extent are left out), ``ax`` are axes to
draw on (a figure of its own by default) and ``title`` stands above. A raster that does not have
the size of its lattice is an ``InputError``, a figure or an array given for axes a ``ConfigError``.
"""
