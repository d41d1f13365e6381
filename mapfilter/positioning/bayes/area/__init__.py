"""The area of the map filter: levels and ways, as a whole or by tiles."""
