"""Published experiments, as they were set up: one module for each paper."""
