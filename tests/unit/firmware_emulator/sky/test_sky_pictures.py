from dataclasses import replace

import numpy as np
import pytest

from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky import Glow, Sky
from firmware_emulator.sky.sky_camera import Shutter

from .sky_scenes import QUIET, camera, grid_sky, opencv_pixels, spot, well_inside

STILL = (0.31, -0.22, 0.7)
NOISE_FREE_TOLERANCE_PX = 0.02  # grey levels are whole numbers
BUDGET_PX = 0.05


def moved(pose, step):
    return tuple(np.add(pose, step).tolist())


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.31, -0.22, 0.7), (-0.9, 0.5, -2.8), (0.2, 0.1, 9.0)])
def test_a_spot_lies_where_an_independent_projection_puts_it(pose):
    sky = grid_sky()
    image = camera(sky).render(pose, pose, sequence=0)
    expected = opencv_pixels(sky.leds_xy_m, pose)
    expected = expected[well_inside(expected)]
    assert len(expected) > 20
    found = np.array([spot(image, px)[1] for px in expected])
    assert np.max(np.abs(found - expected)) < NOISE_FREE_TOLERANCE_PX


def test_with_noise_the_centroids_scatter_as_photons_and_readout_say_and_stay_unbiased():
    sky = grid_sky()
    settings = SensorSettings(hot_pixels=0)
    lens = camera(sky, settings)
    expected = opencv_pixels(sky.leds_xy_m, STILL)
    expected = expected[well_inside(expected)]
    errors = []
    for sequence in range(20):
        image = lens.render(STILL, STILL, sequence=sequence).astype(float) - np.median(
            lens.render(STILL, STILL, sequence=sequence, is_sky_dead=True).astype(float)
        )
        errors += [spot(image, px, half_px=4)[1] - px for px in expected]
    rms_px = np.sqrt(np.mean(np.square(errors)))
    assert np.max(np.abs(np.mean(errors, axis=0))) < 0.01
    assert 0.01 < rms_px < 2 * BUDGET_PX  # a plain moment is three times the bound of a fit, 0.02 px


def test_the_spot_is_as_wide_and_bright_as_the_lens_and_led_say():
    sky = Sky([[0.0, 0.0]], [1.0], np.random.default_rng(0))
    sharp = replace(QUIET, led_flux_dn=1500.0)
    image = camera(sky, sharp).render((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), sequence=0)
    flux, _, variance = spot(image, opencv_pixels(sky.leds_xy_m, (0.0, 0.0, 0.0))[0])
    assert flux == pytest.approx(1500.0, rel=0.01)
    np.testing.assert_allclose(variance, np.eye(2) * (1.2**2 + 1 / 12), atol=0.05)


@pytest.mark.parametrize("streak_px", [4.0, 12.0, 40.0])
def test_a_streak_is_as_long_as_the_way_of_its_light_and_keeps_its_flux(streak_px):
    sky = Sky([[0.1, 0.05]], [1.0], np.random.default_rng(0))
    way_m = streak_px * 2.2 / 599.0
    start, end = (-way_m / 2, 0.0, 0.0), (way_m / 2, 0.0, 0.0)
    bright = replace(QUIET, led_flux_dn=1500.0 * (1 + streak_px / 4))
    image = camera(sky, bright).render(start, end, sequence=0)
    ends = [opencv_pixels(sky.leds_xy_m, pose)[0] for pose in (start, end)]
    length_px = np.linalg.norm(ends[1] - ends[0])
    assert length_px == pytest.approx(streak_px, rel=0.02)
    middle = opencv_pixels(sky.leds_xy_m, (0.0, 0.0, 0.0))[0]
    flux, centroid, variance = spot(image, middle, half_px=30)
    assert flux == pytest.approx(bright.led_flux_dn, rel=0.02)
    assert np.linalg.norm(centroid - middle) < NOISE_FREE_TOLERANCE_PX
    along = np.max(np.linalg.eigvalsh(variance))
    # Light of less than half a grey level is lost to rounding, so the tails look a little shorter.
    assert along == pytest.approx(length_px**2 / 12 + 1.2**2 + 1 / 12, rel=0.05)


def test_a_turn_across_the_half_circle_is_a_short_one():
    sky = grid_sky()
    before, after = (0.0, 0.0, np.pi - 0.01), (0.0, 0.0, -np.pi + 0.01)
    across = camera(sky).render(before, after, sequence=0)
    unwrapped = camera(sky).render(before, (0.0, 0.0, np.pi + 0.01), sequence=0)
    np.testing.assert_array_equal(across, unwrapped)
    assert np.count_nonzero(across) < 20_000


def test_a_fast_turn_leaves_every_middle_at_the_pose_of_the_middle():
    sky = grid_sky()
    image = camera(sky).render(
        moved(STILL, (-0.004, 0.002, -0.02)), moved(STILL, (0.004, -0.002, 0.02)), sequence=0
    )
    expected = opencv_pixels(sky.leds_xy_m, STILL)
    expected = expected[well_inside(expected)]
    found = np.array([spot(image, px, half_px=16)[1] for px in expected])
    assert np.max(np.abs(found - expected)) < BUDGET_PX


def test_a_rolling_shutter_shows_each_row_at_its_own_moment():
    sky = grid_sky()
    shutter = Shutter(exposure_s=0.005, readout_s=0.025)
    velocity = np.array([0.5, -0.3, 0.4])
    middle_s = (shutter.exposure_s + shutter.readout_s) / 2
    start, end = moved(STILL, -velocity * middle_s), moved(STILL, velocity * middle_s)
    image = camera(sky, shutter=shutter).render(start, end, sequence=0)
    rough = opencv_pixels(sky.leds_xy_m, STILL)
    shifts = []
    for place, px in zip(sky.leds_xy_m, rough, strict=True):
        if not well_inside(px[None])[0]:
            continue
        expected = px
        for _ in range(5):
            at_s = (expected[1] / 479.0 - 0.5) * shutter.readout_s
            expected = opencv_pixels(place[None], moved(STILL, velocity * at_s))[0]
        assert np.linalg.norm(spot(image, expected)[1] - expected) < BUDGET_PX
        shifts.append(np.linalg.norm(expected - px))
    assert max(shifts) > 1.0


def test_the_same_seed_and_number_give_the_same_picture_in_any_order():
    settings = SensorSettings()
    one, other = camera(grid_sky(), settings), camera(grid_sky(), settings)
    forward = [one.render(STILL, STILL, sequence=k) for k in range(4)]
    backward = [other.render(STILL, STILL, sequence=k) for k in reversed(range(4))]
    for a, b in zip(forward, reversed(backward), strict=True):
        np.testing.assert_array_equal(a, b)
    assert np.any(forward[0] != forward[1])
    assert np.any(camera(grid_sky(), settings, seed=4).render(STILL, STILL, sequence=0) != forward[0])


def test_dead_leds_are_dark_and_a_dead_sky_keeps_only_false_lights():
    sky = grid_sky()
    lens = camera(sky)
    px = opencv_pixels(sky.leds_xy_m, STILL)
    seen = np.flatnonzero(well_inside(px))
    sky.kill(seen[:2])
    image = lens.render(STILL, STILL, sequence=0)
    assert spot_light(image, px[seen[0]]) == 0
    assert spot_light(image, px[seen[1]]) == 0
    assert spot_light(image, px[seen[2]]) > 500
    sky.revive()
    assert spot_light(lens.render(STILL, STILL, sequence=1), px[seen[0]]) > 500
    assert not np.any(lens.render(STILL, STILL, sequence=2, is_sky_dead=True))
    sky.add_false_lights([[0.35, -0.1]], [1.0])
    image = lens.render(STILL, STILL, sequence=3, is_sky_dead=True)
    assert spot_light(image, opencv_pixels(np.array([[0.35, -0.1]]), STILL)[0]) > 500
    sky.clear_false_lights()
    assert not np.any(lens.render(STILL, STILL, sequence=4, is_sky_dead=True))


def spot_light(image, px):
    u, v = np.rint(px).astype(int)
    return int(image[v - 5 : v + 6, u - 5 : u + 6].sum())


def test_stray_lights_hang_on_the_ceiling_as_many_per_view_as_asked():
    sky = grid_sky()
    lens = camera(sky)
    counts = []
    for x in np.linspace(-1.0, 1.0, 9):
        image = lens.render((x, 0.0, 0.0), (x, 0.0, 0.0), sequence=0, is_sky_dead=True, false_lights=12)
        peak = image == np.max(
            [np.roll(image, (a, b), (0, 1)) for a in (-2, -1, 0, 1, 2) for b in (-2, -1, 0, 1, 2)], axis=0
        )
        counts.append(np.count_nonzero(peak & (image > 10)))
    assert 8 < np.mean(counts) < 16


def test_without_lights_there_is_only_the_chip():
    sky = Sky([[50.0, 50.0]], [1.0], np.random.default_rng(0))
    image = camera(sky, SensorSettings(ambient_dn=0.0, hot_pixels=0)).render(STILL, STILL, sequence=0)
    assert np.mean(image) == pytest.approx(5.0, abs=0.05)
    assert np.std(image) == pytest.approx(np.hypot(25.0 / 20.0, 12**-0.5), rel=0.02)


def test_a_glow_stays_on_the_ceiling_when_the_camera_moves():
    sky = Sky([[50.0, 50.0]], [1.0], np.random.default_rng(0), [Glow(0.3, -0.1, 0.3, 10.0)])
    lens = camera(sky, replace(QUIET, ambient_dn=8.0))
    for pose in [(0.0, 0.0, 0.0), (0.2, 0.1, 1.0), (0.1, -0.4, -2.0)]:
        image = lens.render(pose, pose, sequence=0)
        blurred = image.astype(float)
        at_v, at_u = np.nonzero(blurred >= blurred.max() - 2.0)
        expected = opencv_pixels(np.array([[0.3, -0.1]]), pose)[0]
        assert np.linalg.norm([at_u.mean(), at_v.mean()] - expected) < 12.0


def test_bright_lights_saturate_instead_of_wrapping_round():
    sky = grid_sky()
    sky.brightness[:] = 40.0
    image = camera(sky, SensorSettings()).render(STILL, STILL, sequence=0)
    px = opencv_pixels(sky.leds_xy_m, STILL)
    for u, v in np.rint(px[well_inside(px)]).astype(int):
        assert image[v, u] == 255
        assert np.min(image[v - 1 : v + 2, u - 1 : u + 2]) == 255


def test_lights_on_the_rim_and_a_wild_ride_leave_a_picture_of_the_right_kind():
    sky = grid_sky(0.15)
    for step in [(0.0, 0.0, 0.0), (1.5, -1.0, 0.5), (0.0, 0.0, 3.0), (6.0, 0.0, 0.0)]:
        image = camera(sky, SensorSettings()).render(STILL, moved(STILL, step), sequence=0)
        assert image.shape == (480, 640)
        assert image.dtype == np.uint8


def test_a_light_entering_through_the_rim_is_cut_not_lost():
    sky = Sky([[0.0, 0.0]], [1.0], np.random.default_rng(0))
    lens = camera(sky)

    def light_at(column_px):
        places_m = np.linspace(0.9, 1.4, 101)
        columns_px = [opencv_pixels(sky.leds_xy_m, (x, 0.0, 0.0))[0, 0] for x in places_m]
        x = float(np.interp(-column_px, -np.array(columns_px), places_m))
        return float(lens.render((x, 0.0, 0.0), (x, 0.0, 0.0), sequence=0).sum())

    whole = light_at(8.0)
    assert light_at(-0.5) / whole == pytest.approx(0.5, abs=0.04)
    assert light_at(-9.0) == 0.0


@pytest.mark.parametrize("pose", [(np.nan, 0.0, 0.0), (0.0, np.inf, 0.0), (0.0, 0.0)])
def test_a_pose_that_is_none_is_refused(pose):
    with pytest.raises(ValueError, match="three finite numbers"):
        camera(grid_sky()).render(pose, pose, sequence=0)
