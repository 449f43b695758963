"""The star camera and the sky above it.

=======================  ==========================================================================
``survey``               the star list from a sweep
``amend, amendment``     the list brought up to date by what was found while flying
``lens``                 lens and mount by the stars, lens by a board
``delay``                from the exposure to the arrival, against the IMU
``self_calibration``     the mathematics of lens and mount under a known ceiling
``sky_adjustment``       least squares over cameras, poses and stars
``residual_structure``   do residuals depend on the place in the picture
=======================  ==========================================================================

A procedure takes arrays, reports its progress through a callback and returns an ``Outcome``: numbers with
their uncertainties, warnings, a summary and a figure. Only ``commands`` prints and writes.
"""
