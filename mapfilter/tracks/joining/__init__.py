"""From recordings of one journey to one log: clocks, positions, motion and cells."""
