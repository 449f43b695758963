"""From recordings of an IMU block to its zero offsets, noise, temperature slopes and scales."""
