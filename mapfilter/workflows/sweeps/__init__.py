"""Parts of ``mapfilter sweep``: its plan and its tables."""
