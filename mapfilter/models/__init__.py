"""How things move and how they are heard, as equations over arrays."""
