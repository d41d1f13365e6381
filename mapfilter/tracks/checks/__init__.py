"""Mistakes that a log's own tables show: units, senses, clocks, exchanged columns."""
