"""Times as recordings write them: zones, dates, clocks that are set back."""
