"""Parts of ``mapfilter learn``: journeys located, what they teach, and its report."""
