"""Drivers: one folder per device role. They know no bus, no table frame and no other device."""
