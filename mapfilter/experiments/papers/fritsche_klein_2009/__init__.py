"""Fritsche and Klein (2009): GNSS with timing advances and levels of GSM."""
