"""Calibration of the camera over the table."""
