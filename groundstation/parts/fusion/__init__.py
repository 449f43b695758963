"""What fusion believes, and what became of each fix."""
