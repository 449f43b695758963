"""Scenes of relative navigation made without the product: motions by numerical integration, pixels by a
matrix.

Rotations are scipy's, orbits and spins are integrated as differential equations (DOP853), a camera is a (3,
4) matrix applied to homogeneous coordinates. Nothing of the product's closed forms, series or Jacobians is
used.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]

CUBE = np.array(
    [
        [0.55, 0, 0.25],
        [-0.55, 0, 0.25],
        [0, 0.55, 0.25],
        [0, -0.55, 0.25],
        [0.15, 0.13, -0.33],
        [-0.15, -0.13, -0.33],
    ]
)
"""Six antenna tips of a microsatellite, m; symmetric by half a turn about z."""
PLATE = np.array(
    [[0.55, 0, 0], [-0.55, 0.1, 0], [0, 0.55, 0], [0.1, -0.55, 0], [0.25, 0.2, 0], [-0.3, 0.3, 0]]
)
INERTIA = np.array([1.60, 1.16, 1.86])
F_PX, CX, CY, WIDTH, HEIGHT = 750.0, 319.5, 239.5, 640, 480


@dataclass(frozen=True)
class Motion:
    """Truth: X_camera = rotation X_body + position."""

    times_s: Floats
    rotations: Rotation
    positions_m: Floats
    rates_rad_s: Floats


@dataclass(frozen=True)
class Scene:
    """What stands still: camera and points."""

    points_m: Floats = field(default_factory=lambda: CUBE)
    inertia: Floats = field(default_factory=lambda: INERTIA)
    sigma_px: float = 0.3
    f_px: float = F_PX

    @property
    def matrix(self):
        return np.array([[self.f_px, 0, CX, 0], [0, self.f_px, CY, 0], [0, 0, 1.0, 0]])

    def pixels(self, rotation, position):
        """Exact pixels (n, 2) of all points."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation.as_matrix(), position
        seen = self.matrix @ pose @ np.c_[self.points_m, np.ones(len(self.points_m))].T
        return (seen[:2] / seen[2]).T

    def case(self, **more):
        """The keys of a CASE.json."""
        return {
            "camera": {"f_px": self.f_px, "cx": CX, "cy": CY, "width": WIDTH, "height": HEIGHT},
            "points_m": self.points_m.tolist(),
            "sigma_px": self.sigma_px,
            "labelled": True,
            "inertia": self.inertia.tolist(),
        } | more


def spin(times_s, start, rate_body, inertia, torque=None):
    """Attitude and absolute body rates: ``J w' + w x J w = torque(t, inertial from body)``."""

    def slope(t, y):
        q, w = y[:4], y[4:]
        push = 0.0 if torque is None else torque(t, Rotation.from_quat(q))
        vector = 0.5 * np.array(
            [
                q[3] * w[0] + q[1] * w[2] - q[2] * w[1],
                q[3] * w[1] + q[2] * w[0] - q[0] * w[2],
                q[3] * w[2] + q[0] * w[1] - q[1] * w[0],
                -(q[:3] @ w),
            ]
        )
        return np.r_[vector, (push - np.cross(w, inertia * w)) / inertia]

    found = solve_ivp(
        slope,
        (times_s[0], times_s[-1]),
        np.r_[start.as_quat(), rate_body],
        "DOP853",
        times_s,
        rtol=1e-11,
        atol=1e-13,
    )
    return Rotation.from_quat(found.y[:4].T), found.y[4:].T


def orbit(times_s, position, velocity, rate):
    """Hill's equations (x up, y along-track, z normal), integrated."""

    def slope(_t, y):
        return [y[3], y[4], y[5], 2 * rate * y[4] + 3 * rate**2 * y[0], -2 * rate * y[3], -(rate**2) * y[2]]

    found = solve_ivp(
        slope, (times_s[0], times_s[-1]), np.r_[position, velocity], "DOP853", times_s, rtol=1e-11, atol=1e-13
    )
    return found.y[:3].T, found.y[3:].T


def leaving(
    seed, times_s=None, nearest=3.0, speed=0.01, rate=1.1068e-3, wobble=(0.05, 0.04), inertia=INERTIA
):
    """A craft that leaves upwards, turning freely; a camera that keeps its attitude in space looks after it.

    The camera's axis wanders about the target by the wobble, rad, slowly; the distance is that of the orbit.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 764.1, 4.0) if times_s is None else times_s
    places, _ = orbit(times, [nearest, 0, 0], [speed, 0, 0], rate)
    distance = np.linalg.norm(places, axis=1)
    phase, pace = rng.uniform(0, 6.28, 2), rng.uniform(60.0, 120.0, 2)
    sides = np.array(wobble) * np.sin(times[:, None] / pace + phase)
    forward = np.sqrt(1.0 - np.sum(sides**2, axis=1))
    start = Rotation.from_rotvec(rng.uniform(-0.25, 0.25, 3)) * Rotation.from_euler("x", 180.0, degrees=True)
    rotations, rates = spin(times, start, rng.normal(0.0, 0.006, 3), inertia)
    return Motion(times, rotations, distance[:, None] * np.c_[sides, forward], rates)


def seen(scene, motion, rng, clutter=0.0, missing=0.0, labelled=True):
    """Rows ``frame, t, marker, u, v`` of a motion as a camera finds its points."""
    rows = []
    for frame, (t, rotation, position) in enumerate(
        zip(motion.times_s, motion.rotations, motion.positions_m, strict=True)
    ):
        pixels = scene.pixels(rotation, position) + rng.normal(0.0, scene.sigma_px, (len(scene.points_m), 2))
        kept = np.flatnonzero(rng.random(len(pixels)) >= missing)
        found = [(i if labelled else -1, *pixels[i]) for i in kept]
        found += [
            (-1, rng.uniform(0, WIDTH - 1), rng.uniform(0, HEIGHT - 1)) for _ in range(rng.poisson(clutter))
        ]
        order = range(len(found)) if labelled else rng.permutation(len(found))
        rows += [(frame, t, *found[i]) for i in order]
    return rows


def guess(motion, rng, angle=0.1, share=0.02):
    """A rough ``guess_frame0``."""
    off = rng.normal(size=3)
    rotation = Rotation.from_rotvec(angle * off / np.linalg.norm(off)) * motion.rotations[0]
    x, y, z, w = rotation.as_quat()
    position = motion.positions_m[0] * (1.0 + share * rng.choice((-1, 1)))
    return {"q": [w, x, y, z], "t": position.tolist()}


def bound(scene, rotation, position):
    """Cramer-Rao covariance (6, 6) of position and turn in front, by differences of pixels."""
    step, columns = 1e-6, []
    for k in range(6):
        both = []
        for sign in (1.0, -1.0):
            d = np.zeros(6)
            d[k] = sign * step
            both.append(scene.pixels(Rotation.from_rotvec(d[3:]) * rotation, position + d[:3]).ravel())
        columns.append((both[0] - both[1]) / (2.0 * step))
    rows = np.array(columns).T / scene.sigma_px
    return np.linalg.inv(rows.T @ rows)


def in_orbit(
    seed,
    times,
    rate=1.1068e-3,
    nearest=3.0,
    inertia=INERTIA,
    offset_m=(0.1, 0.05, -0.2),
    mass_body_m=(0.02, -0.03, 0.05),
):
    """A craft flying by Hill's equations, turned by gravity; the camera's craft keeps its attitude in orbit.

    Its camera looks up. Inertial axes are the orbital ones at time 0.

    Returns the motion of the body's origin and the keys of ``orbit`` and ``centre_of_mass_m``.
    """
    rng = np.random.default_rng(seed)
    places, _ = orbit(times, [nearest, 0, 0], [0.01, 0.0, 0.002], rate)
    camera_from_orbital = Rotation.from_matrix([[0, 1.0, 0], [0, 0, 1.0], [1.0, 0, 0]])  # z forward is up

    def torque(t, inertial_from_body):
        up = inertial_from_body.inv().apply([np.cos(rate * t), np.sin(rate * t), 0.0])
        return 3 * rate**2 * np.cross(up, inertia * up)

    start = Rotation.from_rotvec(rng.normal(0.0, 0.2, 3)) * Rotation.from_euler("y", 90, degrees=True)
    inertial, rates = spin(times, start, rng.normal(0.0, 0.004, 3), inertia, torque)
    orbital_from_inertial = Rotation.from_rotvec(np.c_[np.zeros((len(times), 2)), -rate * times])
    rotations = camera_from_orbital * orbital_from_inertial * inertial
    mass = camera_from_orbital.apply(places) - np.array(offset_m)
    x, y, z, w = camera_from_orbital.as_quat()
    keys = {
        "orbit": {
            "rate_rad_s": rate,
            "camera_from_orbital_q": [w, x, y, z],
            "camera_offset_m": list(offset_m),
        },
        "centre_of_mass_m": list(mass_body_m),
    }
    return Motion(times, rotations, mass - rotations.apply(mass_body_m), rates), keys
