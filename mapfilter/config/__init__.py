"""The configuration: sections, their fields, and reading them from TOML and ``--set``."""
