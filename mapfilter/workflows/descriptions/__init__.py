"""Parts of ``mapfilter info``: kinds of files that need more than their table."""
