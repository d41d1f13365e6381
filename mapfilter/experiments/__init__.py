"""Experiments over many runs: sweeps over noise, the papers' figures, benchmarks on data sets."""
