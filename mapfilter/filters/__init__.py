"""Belief through time. This room knows no roads and no radio: it sees arrays and callables."""
