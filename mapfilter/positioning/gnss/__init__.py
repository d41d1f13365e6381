"""Satellites on the map: pseudoranges and fixes, their gate and the receiver clock."""
