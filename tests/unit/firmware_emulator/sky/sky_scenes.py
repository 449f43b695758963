"""What the sky's tests share: a camera, a projection by OpenCV alone, and a noiseless chip."""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from firmware_emulator.sky.optics import CameraOptics
from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky import Sky
from firmware_emulator.sky.sky_camera import Shutter, SkyCamera

OPTICS = CameraOptics(
    width_px=640,
    height_px=480,
    focal_px=(598.3, 599.6),
    centre_px=(316.8, 243.9),
    distortion=(-0.092, 0.048, -0.0007, 0.0011, 0.0),
    ceiling_height_m=2.2,
    offset_body_m=(-0.024, 0.022),
    yaw_rad=-0.028,
    tilt_x_rad=-0.0044,
    tilt_y_rad=0.0061,
)
QUIET = SensorSettings(
    read_noise_e=0.0, gain_e_dn=1e9, black_dn=0.0, ambient_dn=0.0, led_flux_dn=1800.0, hot_pixels=0
)


def opencv_pixels(points_m, pose, optics=OPTICS):
    """Pixels (n, 2) of ceiling points, from OpenCV's projection and SciPy's rotations."""
    x, y, heading = pose
    table_from_body = Rotation.from_euler("z", heading)
    body_from_camera = Rotation.from_euler("ZXY", [optics.yaw_rad, optics.tilt_x_rad, optics.tilt_y_rad])
    centre = np.array([x, y, 0.0]) + table_from_body.apply([*optics.offset_body_m, 0.0])
    camera_from_table = (table_from_body * body_from_camera).inv()
    points = np.column_stack([points_m, np.full(len(points_m), optics.ceiling_height_m)])
    (fx, fy), (cx, cy) = optics.focal_px, optics.centre_px
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    rotation = camera_from_table.as_rotvec()
    translation = -camera_from_table.apply(centre)
    pixels, _ = cv2.projectPoints(points, rotation, translation, matrix, np.array(optics.distortion))
    return pixels[:, 0]


def grid_sky(pitch_m=0.3, **kwargs):
    """LEDs on a square grid: all spots far from each other."""
    places = np.stack(np.meshgrid(np.arange(-2.4, 2.41, pitch_m), np.arange(-1.8, 1.81, pitch_m)), axis=-1)
    places = places.reshape(-1, 2)
    return Sky(places, np.ones(len(places)), np.random.default_rng(1), **kwargs)


def camera(sky, settings=QUIET, shutter=None, seed=3):
    return SkyCamera(OPTICS, sky, shutter or Shutter(0.01), settings, np.random.SeedSequence(seed))


def spot(image, near_px, half_px=9):
    """Flux, centroid (2,) and second moments (2, 2) of the light in a window round a pixel."""
    u, v = np.rint(near_px).astype(int)
    rows, columns = slice(v - half_px, v + half_px + 1), slice(u - half_px, u + half_px + 1)
    window = image[rows, columns].astype(float)
    at_v, at_u = np.mgrid[rows, columns]
    at = np.stack([at_u.ravel(), at_v.ravel()])
    weight = window.ravel() / window.sum()
    centroid = at @ weight
    off = at - centroid[:, None]
    return window.sum(), centroid, (off * weight) @ off.T


def well_inside(pixels, margin_px=30.0):
    return np.all((pixels > margin_px) & (pixels < np.array([639.0, 479.0]) - margin_px), axis=1)
