"""What journeys tell about a database: faults of its cells, missing ways, noise of the phone."""
