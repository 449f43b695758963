"""What the IMU block says, from bytes to calibrated samples."""
