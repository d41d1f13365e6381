"""The street canyon: hybrid GNSS and time differences of arrival by Bayesian filters."""
