"""What the IMU block states, from bytes to calibrated samples."""
