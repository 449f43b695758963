"""What the fork server loads before it forks: everything that processes of a rig import, however late.

Parts import some nodes and devices only where they are used, since OpenCV is heavy. Here it is loaded once
for all processes, and while the laboratory starts.
"""

import importlib

from groundstation.launch import process, recorder
from groundstation.parts.table import installed_tables

__all__ = ["process", "recorder"]

LATE = (
    "groundstation.parts.stars.picture_check",
    "groundstation.parts.stars.spot_finder",
    "groundstation.parts.stars.star_tracker",
    "groundstation.parts.stars.picture_keeper",
    "drivers.imu_block.port",
    "drivers.star_camera.port",
    "drivers.valve_bus.port",
)

installed_tables()
for _module in LATE:
    importlib.import_module(_module)
