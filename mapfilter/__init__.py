"""mapfilter."""
