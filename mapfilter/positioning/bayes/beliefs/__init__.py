"""Single beliefs: their first hypotheses, motion, paths, and smoothing."""
