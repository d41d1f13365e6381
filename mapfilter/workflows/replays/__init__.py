"""Parts of ``mapfilter replay``: its logs, filters, figures and words."""
