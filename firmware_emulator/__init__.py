"""The laboratory that is not there: truth in, wire formats out.

It shares codecs with the drivers, and no mathematics with the ground station.

    plant/      truth: table, valves, rigid bodies, contacts
    sky/        pictures of the ceiling
    devices/    truth to bytes, pictures and CAN frames; CAN frames to forces; each declares its kind
    live/       the same on ptys, TCP and HTTP, by the host's clock

`laboratory.EmulatedLaboratory` runs in virtual time, `python -m firmware_emulator RIG.toml` in real time. The
scenario is the rig's `[laboratory]` table (`config`, `mock_up_config`, `failures`) with a section for each
device; `device_table` lists the kinds, and an installed package may bring more.

Not modelled: the IMU block's firmware instruction by instruction, and with it the moments of the single SPI
transfers within a poll (0.4 ms); vertical shocks, which would show in X + Y of the inclinometers; vehicles
that tilt on their bearings; friction between bumpers.
"""
