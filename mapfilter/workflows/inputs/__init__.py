"""What commands read: areas, plans, streets and logs of a configuration."""
