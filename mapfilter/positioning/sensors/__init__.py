"""Sensors that no longer measure what they seem to, seen by their rows and reports alone."""
