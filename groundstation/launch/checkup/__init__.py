"""What can be wrong with a machine before a flight day, and what to do about it."""
