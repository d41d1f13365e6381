"""Worlds with truth: networks laid out by rule, journeys, and what phone and sensors report."""
