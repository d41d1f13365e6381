"""Per-cell radio-route databases: the places where one can be and what would be heard there."""
