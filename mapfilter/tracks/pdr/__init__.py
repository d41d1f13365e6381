"""Dead reckoning from raw sensors: steps and attitude of walkers, speed and yaw rate of vehicles.

:func:`mapfilter.tracks.pdr.walk.reckon_walk` turns the sensor tables of a phone into the motion of
a log, :mod:`mapfilter.tracks.pdr.vehicle` the readings of a vehicle. Both also return the
errors of the motion, as far as the recording shows them.
"""
