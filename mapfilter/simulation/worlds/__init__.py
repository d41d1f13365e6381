"""Worlds that share no model with the filter: radio, walkers, phones, sensors, faulty inputs."""
