"""What an emulated laboratory flies of two craft in orbit: an order, and the truth and pictures made of it.

Axes ``orbital``: x radial up, y along-track, z along the orbit's normal, turning with the craft that carries
the camera; ``camera``: x right, y down, z forward, origin in that craft's centre of mass; ``body``: principal
axes of the craft that leaves, origin in its centre of mass. Rotations are matrices (3, 3). Pixel (0, 0) is
the centre of the top-left one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import entry_points

import numpy as np
from numpy.typing import NDArray

from drivers.errors import NotFound

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

SEPARATION_GROUP = "groundstation.separations"
"""Entry points that name a function from a `SeparationOrder` to a `Separation`."""


@dataclass(frozen=True, slots=True, eq=False)
class TargetLooks:
    """How the craft that leaves looks in a picture, grey steps of 255.

    Attributes:
        tip_diameter_m: Of the bright disk at each point.
        background: Of the sky.
        level: Of tips.
        noise: One sigma of each pixel.
        body_half_m: Half sides of a bright box, (3,); None: no body is drawn.
        body_level: Of the box.
        antennas: Points that a bright line joins with the box's nearest corner.
        antenna_width_m: Of the lines.
        dim_antennas: Points whose line is dim.
        dim_level: Of these lines.
        glare_from_s: When the body begins to outshine all; None: never.
    """

    tip_diameter_m: float = 0.02
    background: float = 10.0
    level: float = 210.0
    noise: float = 4.0
    body_half_m: Floats | None = None
    body_level: float = 240.0
    antennas: tuple[int, ...] = ()
    antenna_width_m: float = 0.012
    dim_antennas: tuple[int, ...] = ()
    dim_level: float = 50.0
    glare_from_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SeparationOrder:
    """What is to be flown and filmed.

    Attributes:
        times_s: Of the frames, ascending, (n,); the state below is that of the first.
        semi_major_axis_m: Of the orbit of the craft with the camera.
        eccentricity: Of it.
        true_anomaly_rad: Of it at the first frame.
        position_orbital_m: Of the craft that leaves, centre to centre, (3,).
        velocity_orbital_m_s: As seen in the turning axes, (3,).
        inertia_kg_m2: Principal moments along the body axes, (3,).
        camera_from_body: At the first frame, (3, 3).
        rate_body_rad_s: Absolute, body axes, (3,).
        camera_from_orbital: (3, 3).
        keeps_attitude_in_space: The camera's craft does not turn; else it turns with the orbital axes.
        f_px: Focal length.
        size_px: Columns and rows of a picture; the principal point is its middle.
        points_body_m: (k, 3).
        looks: Of the pictures.
        seed: Of their noise.
    """

    times_s: Floats
    semi_major_axis_m: float
    position_orbital_m: Floats
    velocity_orbital_m_s: Floats
    inertia_kg_m2: Floats
    camera_from_body: Floats
    rate_body_rad_s: Floats
    camera_from_orbital: Floats
    f_px: float
    points_body_m: Floats
    eccentricity: float = 0.0
    true_anomaly_rad: float = 0.0
    keeps_attitude_in_space: bool = False
    size_px: tuple[int, int] = (640, 480)
    looks: TargetLooks = field(default_factory=TargetLooks)
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """The truth, and pictures of it.

    Attributes:
        times_s: (n,).
        positions_camera_m: Of the craft that leaves, (n, 3).
        positions_orbital_m: The same in orbital axes, (n, 3).
        velocities_orbital_m_s: As seen in the turning axes, (n, 3).
        camera_from_body: (n, 3, 3).
        rates_body_rad_s: Absolute, (n, 3).
        pixels: Of the points, (n, k, 2), wherever they lie; NaN behind the camera.
        picture: The grey picture (rows, columns) of a frame by its number, each time the same.
    """

    times_s: Floats
    positions_camera_m: Floats
    positions_orbital_m: Floats
    velocities_orbital_m_s: Floats
    camera_from_body: Floats
    rates_body_rad_s: Floats
    pixels: Floats
    picture: Callable[[int], Picture]


def fly_separation(order: SeparationOrder) -> Separation:
    """Fly an order in the emulator that is installed.

    Raises:
        NotFound: None is, or it cannot be loaded.
    """
    points = sorted(entry_points(group=SEPARATION_GROUP), key=lambda point: point.name)
    if not points:
        raise NotFound("no installed package flies separations of two craft")
    try:
        fly: Callable[[SeparationOrder], Separation] = points[0].load()
    except (Exception, SystemExit) as error:  # whatever a package of somebody else raises: it is named
        raise NotFound(f"separations by {points[0].value} cannot be loaded: {error}") from error
    return fly(order)
