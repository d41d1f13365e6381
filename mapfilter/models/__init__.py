"""Models of motion and of measurements, as equations over arrays."""
