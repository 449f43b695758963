"""Runners, node table, rig files, launcher and supervision."""
