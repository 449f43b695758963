"""Devices: truth to bytes, pictures and CAN frames; CAN frames to forces."""
