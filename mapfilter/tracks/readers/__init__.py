"""Readers of recordings of other programs: one module for each family, one table of formats."""
