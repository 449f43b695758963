"""The calibrations of the sky, ready for a command, a console or a notebook.

Each is one function: arrays in, progress told through a callback, an ``Outcome`` out with its numbers,
their uncertainties, warnings, a one-line summary and a figure. Only ``commands`` prints, reads and writes.
"""
