"""Ways, squares, buildings and land use, and the route lattice made of them."""
