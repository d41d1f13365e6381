"""Parts of ``mapfilter evaluate``: one module for each kind of benchmark."""
