"""Where one can be: ways, squares, buildings and land use, and the lattice made of them."""
