"""Calibration: recordings in, numbers with provenance out.

============  ==========================================================================================
``imu``       rests, turns, tilts, whole flights; a running vehicle step by step
``table``     slope and waves of the table
``sky``       star list, lens, mount and delay of the star camera
``overhead``  where the camera over the table hangs
``laboratory``  valves, table, sensors and camera as an emulator has to have them, from one flight
============  ==========================================================================================

Each holds mathematics, procedures (data in, ``Outcome`` out), figures and ``commands``. ``commands.py`` lists
them all; the ground station reaches them by entry points and imports nothing of this package.
"""
