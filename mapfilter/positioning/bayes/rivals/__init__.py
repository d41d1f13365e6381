"""Beliefs beside the main one: what they assume, and when they take over."""
