"""Parts of ``mapfilter check``: logs, places, and suspects by journeys."""
