"""Benchmarks on public recordings: one module for each data set, one row for each part and method.

A module knows of its data what the README of the data set states, and nothing else.
"""
