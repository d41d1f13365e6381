"""Parts of ``mapfilter bench``: one module for each stage or comparison."""
