"""Radio-route databases: accessible points, and the levels of each cell there."""
