"""Filters of beliefs over arrays and callables, without roads and radio."""
