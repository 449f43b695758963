"""The emulated laboratory as a port: failures that it injects are messages, and can be asked for."""
