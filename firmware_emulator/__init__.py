"""The laboratory that is not there: truth in, wire formats out.

It shares codecs with the drivers, and no mathematics with the ground station.
"""
