"""State of each mock-up from its IMU and late star fixes: pure mathematics, no clock, no I/O."""
