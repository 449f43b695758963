"""Pictures of a craft: light where its points are, as much as they cover."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.errors import NotFound
from drivers.laboratory import separations
from drivers.laboratory.separations import SeparationOrder, TargetLooks, fly_separation
from firmware_emulator.orbit.film import Painter

QUIET = TargetLooks(noise=0.0, background=0.0, level=200.0, tip_diameter_m=0.04)
ORIGIN = np.zeros((1, 3))


@pytest.mark.parametrize("place", [(0.0, 0.0, 4.0), (0.31, -0.22, 5.3), (0.5, 0.4, 20.0)])
def test_a_tip_is_a_disk_at_its_pixel(place):
    painter = Painter(QUIET, ORIGIN, 500.0, (200, 150), 0)
    place = np.array(place)
    light = painter.paint(np.eye(3), place, 0.0, 0).astype(float) / 200.0
    assert light.sum() == pytest.approx(np.pi * (0.02 * 500.0 / place[2]) ** 2, rel=0.03)
    v, u = np.indices(light.shape)
    centre = np.array([(light * u).sum(), (light * v).sum()]) / light.sum()
    exact = 500.0 * place[:2] / place[2] + [99.5, 74.5]
    np.testing.assert_allclose(centre, exact, atol=0.03)
    np.testing.assert_allclose(painter.pixels(place), exact)


def test_a_point_behind_the_camera_has_no_pixel_and_no_light():
    painter = Painter(QUIET, ORIGIN, 500.0, (64, 48), 0)
    assert np.isnan(painter.pixels(np.array([0.0, 0.0, -1.0]))).all()
    assert not painter.paint(np.eye(3), np.array([0.0, 0.0, -1.0]), 0.0, 0).any()


def test_an_antenna_reaches_from_the_body_to_its_tip():
    looks = TargetLooks(
        noise=0.0,
        background=0.0,
        body_half_m=np.full(3, 0.1),
        antennas=(0,),
        tip_diameter_m=0.01,
        glare_from_s=2.0,
    )
    painter = Painter(looks, np.array([[0.5, 0.0, 0.0]]), 400.0, (320, 240), 0)
    picture = painter.paint(np.eye(3), np.array([0.0, 0.0, 2.0]), 0.0, 0)
    row = picture[119:121].max(axis=0)
    lit = np.flatnonzero(row > 100)
    assert lit[0] == pytest.approx(159.5 - 0.1 * 400.0 / 1.9, abs=1.0)  # the near face is the wider
    assert lit[-1] == pytest.approx(159.5 + 0.5 * 400.0 / 2.0, abs=2.0)
    assert len(lit) == lit[-1] - lit[0] + 1  # one piece
    assert picture[119, 159] == 240
    assert (painter.paint(np.eye(3), np.array([0.0, 0.0, 2.0]), 2.3, 0) == 255).mean() > 0.5


def test_noise_is_of_its_size_and_the_same_each_time():
    painter = Painter(TargetLooks(noise=4.0, background=50.0), ORIGIN, 500.0, (200, 150), 3)
    one, again = (painter.paint(np.eye(3), np.array([0, 0, 1e6]), 0.0, 7) for _ in range(2))
    assert np.array_equal(one, again)
    assert one.std() == pytest.approx(4.0, rel=0.05)
    assert not np.array_equal(one, painter.paint(np.eye(3), np.array([0, 0, 1e6]), 0.0, 8))


def order(**more):
    return SeparationOrder(
        np.array([0.0, 600.0]),
        7e6,
        np.array([3.0, 0.5, -0.4]),
        np.array([0.01, 0.0, 0.002]),
        np.array([1.0, 1.0, 1.0]),
        Rotation.from_rotvec([0.2, 0.1, -0.3]).as_matrix(),
        np.zeros(3),
        np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
        500.0,
        np.array([[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.1]]),
        **more,
    )


def test_the_first_frame_is_as_ordered():
    found = fly_separation(order())
    np.testing.assert_allclose(found.positions_orbital_m[0], [3.0, 0.5, -0.4], atol=1e-8)
    np.testing.assert_allclose(found.velocities_orbital_m_s[0], [0.01, 0.0, 0.002], atol=1e-10)
    np.testing.assert_allclose(found.positions_camera_m[0], [0.5, -0.4, 3.0], atol=1e-8)
    np.testing.assert_allclose(found.camera_from_body[0], order().camera_from_body, atol=1e-12)
    seen = order().points_body_m @ order().camera_from_body.T + [0.5, -0.4, 3.0]
    np.testing.assert_allclose(found.pixels[0], 500.0 * seen[:, :2] / seen[:, 2:] + [319.5, 239.5], atol=1e-5)
    assert found.picture(1).shape == (480, 640)


def test_a_craft_that_keeps_its_attitude_in_space_sees_no_turn_of_a_body_at_rest():
    turning, still = fly_separation(order()), fly_separation(order(keeps_attitude_in_space=True))
    np.testing.assert_allclose(still.camera_from_body[1], still.camera_from_body[0], atol=1e-6)
    angle = Rotation.from_matrix(turning.camera_from_body[1] @ turning.camera_from_body[0].T).magnitude()
    assert angle == pytest.approx(600.0 * np.sqrt(3.986004418e14 / 7e6**3), rel=1e-6)
    np.testing.assert_allclose(turning.positions_orbital_m, still.positions_orbital_m, atol=1e-9)


@pytest.mark.parametrize(
    ("points", "words"),
    [([], "no installed package"), (["broken"], "separations by broken:fly cannot be loaded: gone")],
)
def test_without_an_emulator_it_is_said(monkeypatch, points, words):
    class Point:
        def __init__(self, name):
            self.name, self.value = name, f"{name}:fly"

        def load(self):
            raise ImportError("gone")

    monkeypatch.setattr(separations, "entry_points", lambda group: [Point(name) for name in points])
    with pytest.raises(NotFound, match=words):
        fly_separation(order())
