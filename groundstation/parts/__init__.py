"""The parts of the system: each folder is one part, declared in its ``part.py``."""
