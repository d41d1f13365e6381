"""Khalaf-Allah (2007): global positioning by the candidate filter."""
