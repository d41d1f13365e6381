"""Radio-route databases: the points where one can be, and the levels of each cell there."""
