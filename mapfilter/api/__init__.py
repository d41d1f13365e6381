"""What notebooks call; every name is in :mod:`mapfilter` itself."""
