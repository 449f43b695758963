"""How a rig is run: recorder, calibrations in use, health, latency."""
