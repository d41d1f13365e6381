"""A vehicle in a city: few satellites and the levels of GSM."""
