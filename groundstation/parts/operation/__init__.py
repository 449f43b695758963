"""How a rig is run: start sequence, calibrations in use, health, latency."""
