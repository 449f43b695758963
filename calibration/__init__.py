"""Calibration: recordings in, numbers with provenance out. No bus, no device, no other room."""
