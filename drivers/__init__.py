"""Devices on the mock-ups and in the laboratory: one folder per role."""
