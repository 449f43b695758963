"""What the reference system reports: truth of the emulator, or motion capture."""
