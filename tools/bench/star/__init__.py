"""The star tracker on the emulator's sky, beside other methods on the same pictures."""
