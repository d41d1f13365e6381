"""Mutation testing: small bugs planted one by one, and whether the tests of their room notice."""
