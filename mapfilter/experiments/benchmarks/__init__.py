"""Accuracy benchmarks: one module for each question, on any map or on published data."""
