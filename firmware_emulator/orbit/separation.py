"""A separation of two craft as it is ordered: flown, and filmed by the one that stays."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from drivers.laboratory.separations import Picture, Separation, SeparationOrder
from firmware_emulator.orbit.film import Painter
from firmware_emulator.orbit.two_bodies import integrate, orbital_axes, place_in_orbit


def fly(order: SeparationOrder) -> Separation:
    """Fly an order."""
    first = place_in_orbit(order.semi_major_axis_m, order.eccentricity, order.true_anomaly_rad)
    (axes,), (rate,) = orbital_axes(first[0][None], first[1][None])
    away = axes.T @ order.position_orbital_m
    spin = np.array((0.0, 0.0, rate))
    pace = axes.T @ (order.velocity_orbital_m_s + np.cross(spin, order.position_orbital_m))
    start = Rotation.from_matrix(axes.T @ order.camera_from_orbital.T @ order.camera_from_body)
    flown = integrate(order.times_s, first, (away, pace), start, order.rate_body_rad_s, order.inertia_kg_m2)
    all_axes, rates = flown.orbital_axes()
    held = np.broadcast_to(axes, all_axes.shape) if order.keeps_attitude_in_space else all_axes
    camera = order.camera_from_orbital @ held
    places = np.einsum("nij,nj->ni", all_axes, flown.away_m)
    turning = np.stack((np.zeros_like(rates), np.zeros_like(rates), rates), axis=1)
    paces = np.einsum("nij,nj->ni", all_axes, flown.away_m_s) - np.cross(turning, places)
    seen = np.einsum("nij,nj->ni", camera, flown.away_m)
    rotations = camera @ flown.inertial_from_body.as_matrix()
    painter = Painter(order.looks, order.points_body_m, order.f_px, order.size_px, order.seed)
    pixels = painter.pixels(order.points_body_m @ rotations.transpose(0, 2, 1) + seen[:, None])

    def picture(number: int) -> Picture:
        return painter.paint(rotations[number], seen[number], float(order.times_s[number]), number)

    return Separation(order.times_s, seen, places, paces, rotations, flown.rates_body_rad_s, pixels, picture)
