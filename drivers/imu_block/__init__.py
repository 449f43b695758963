"""IMU block: a yaw-rate gyro and two inclinometers behind a microcontroller, on a serial line.

- ``protocol``  bytes to frames and back, pure (see ``docs/interfaces/imu_block.md``)
- ``sensors``   counts to SI units, plausibility of the readings
- ``clock``     microcontroller ticks to host time stamps
- ``port``      the serial port
- ``identify``  asks a port who is there
"""
