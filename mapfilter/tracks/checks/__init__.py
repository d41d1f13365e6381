"""What a log tells of its own mistakes: units, senses, clocks, exchanged columns."""
