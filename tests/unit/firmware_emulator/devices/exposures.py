"""A star camera on a mock-up that glides and turns, and its exposures."""

import numpy as np

from firmware_emulator.devices.star_camera import StarCamera
from firmware_emulator.failures import Failures
from firmware_emulator.plant.air_table import FloorPulses, Surface
from firmware_emulator.plant.body import Body
from firmware_emulator.plant.motion_state import Motion, PollGrid
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import GasSupply, ThrusterBank, ValveTiming

S = 1_000_000_000


def gliding_vehicle():
    rng = np.random.default_rng(0)
    bank = ThrusterBank([], (0.0, 0.0), ValveTiming(), GasSupply(), rng)
    level, quiet = Surface((0.0, 0.0), 0.0, 1.0, rng), FloorPulses(0.0, 0.0, 0.1, rng)
    return Vehicle(
        Body(), Motion(0.0, 0.0, 0.0, 0.1, 0.0, 0.5), bank, level, quiet, 0.3, True, PollGrid(0, 0.0)
    )


def expose(seconds, failures=(), **changes):
    settings = {
        "rate_hz": 10.0, "exposure_s": 0.02, "readout_s": 0.01, "delay_s": 0.08, "delay_jitter_s": 0.0,
    } | changes  # fmt: skip
    rng = np.random.default_rng(1)
    camera = StarCamera(gliding_vehicle(), **settings, failures=Failures(failures), rng=rng, start_ns=0)
    while camera.next_ns <= seconds * S:
        camera.run(camera.next_ns)
    return [exposure for _, exposure in camera.take(1000 * S)]
