"""The recording of one file: its tables, usable values, and remarks on the others."""
