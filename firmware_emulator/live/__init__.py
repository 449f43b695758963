"""The emulated laboratory in real time, on ports that drivers open as they open hardware. Loopback only."""
