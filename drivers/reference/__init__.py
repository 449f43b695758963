"""Poses measured from outside: a motion-capture system, or the emulator's truth."""
