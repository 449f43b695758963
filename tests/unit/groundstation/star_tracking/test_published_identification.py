"""The published identification, each step against values worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.close_run import longest_run
from groundstation.star_tracking.delaunay import triangles_of
from groundstation.star_tracking.detection import PictureError, Spots
from groundstation.star_tracking.fixes import Mode, NoFix, PictureFix, Refusal
from groundstation.star_tracking.published import PublishedTracker, affine_maps, alike, is_similarity
from groundstation.star_tracking.published_image import MOST_SPOTS, published_spots
from groundstation.star_tracking.published_settings import PublishedSettings
from groundstation.star_tracking.star_catalogue import StarCatalogue

STARS_M = np.array([(0.0, 0.0), (1.0, 0.1), (0.3, 0.9), (1.4, 1.2), (0.8, 0.5), (-0.8, 0.3)])
SCALE_PX = 200.0
CAMERA = CameraCalibration(
    width=641,
    height=481,
    fx=600.0,
    fy=600.0,
    cx=320.0,
    cy=240.0,
    distortion=(0.0,) * 5,
    ceiling_height_above_camera_m=3.0,
    mount_offset_body_m=(0.0, 0.0, 0.0),
    mount_yaw_rad=0.0,
    mount_tilt_x_rad=0.0,
    mount_tilt_y_rad=0.0,
)
EXACT = PublishedSettings(angle_limit_deg=6e-5, closeness_m=1e-3)


def spots_at(points_px):
    n = len(points_px)
    flux = np.arange(n, 0.0, -1.0)
    return Spots(
        points_px[:, 0].copy(),
        points_px[:, 1].copy(),
        flux,
        np.ones((n, 3)),
        np.ones(n),
        np.zeros((n, 2)),
        0.0,
        0.0,
    )


def seen_from(x_m, y_m, heading_rad, stars_m=STARS_M):
    """Pixels of stars for a camera that looks straight up: (u right, v down) is (x, y) looking up."""
    turn = np.array([[np.cos(heading_rad), np.sin(heading_rad)], [-np.sin(heading_rad), np.cos(heading_rad)]])
    return (stars_m - (x_m, y_m)) @ turn.T * SCALE_PX + (320.0, 240.0)


def tracker(settings=EXACT, stars_m=STARS_M):
    return PublishedTracker(StarCatalogue.from_positions(stars_m), CAMERA, settings)


def test_a_picture_is_normalised_cut_off_and_centred_by_its_light():
    image = np.full((32, 40), 10, np.uint8)  # least 10, largest 110: 40 is 0.3 of the way
    image[3, 5], image[3, 6], image[4, 7] = 110, 60, 60  # 1, 0.5 and, over the corner, 0.5
    image[20, 30], image[20, 31], image[21, 31] = 40, 39, 70  # 0.3 stays, 0.29 goes, 0.6
    found = published_spots(image, 0.3)
    assert found.u_px == pytest.approx([(5 * 1.0 + 6 * 0.5 + 7 * 0.5) / 2.0, (30 * 0.3 + 31 * 0.6) / 0.9])
    assert found.v_px == pytest.approx([(3 * 1.0 + 3 * 0.5 + 4 * 0.5) / 2.0, (20 * 0.3 + 21 * 0.6) / 0.9])
    assert found.flux_dn == pytest.approx([200.0, 90.0])


def test_one_bright_pixel_is_a_star_and_an_even_picture_has_none():
    image = np.full((32, 40), 7, np.uint8)
    assert len(published_spots(image)) == 0
    image[9, 4] = 8
    found = published_spots(image)
    assert (found.u_px.tolist(), found.v_px.tolist()) == ([4.0], [9.0])


def test_a_picture_of_noise_does_not_flood_the_bus():
    image = np.zeros((200, 200), np.uint8)
    image[::2, ::2] = 200
    assert len(published_spots(image)) == MOST_SPOTS


@pytest.mark.parametrize("level", [0.0, 1.0, -0.1, float("nan")])
def test_a_level_that_is_none_is_refused(level):
    with pytest.raises(ValueError, match="level_ratio"):
        published_spots(np.zeros((32, 32), np.uint8), level)


def test_a_picture_in_colour_is_refused():
    with pytest.raises(PictureError, match="grey"):
        published_spots(np.zeros((32, 32, 3), np.uint8))


def test_the_angles_of_a_three_four_five_triangle():
    triangles, angles = triangles_of(np.array([(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)]))
    assert np.rad2deg(angles[0]) == pytest.approx([36.8698976, 90.0])
    assert triangles[0].tolist() == [1, 2, 0]  # smallest at (4, 0), largest at the right angle


def test_every_triangle_counts_thin_ones_too():
    thin = np.array([(0.0, 0.0), (1.0, 0.0), (2.0, 0.05)])  # 177 deg in the middle
    assert len(triangles_of(thin)[0]) == 1
    fat = np.concatenate((thin, [(1.0, -3.0)]))
    assert (
        tracker(stars_m=fat).triangles
        == tracker(EXACT.model_copy(update={"drops_thin": True}), fat).triangles + 1
    )


def test_three_vertices_give_the_affine_map_through_them():
    spot = np.array([[(0.0, 0.0), (2.0, 0.0), (0.0, 4.0)]])
    star = np.array([[(1.0, 2.0), (2.0, 2.0), (1.0, 0.0)]])  # half along u, mirrored half along v
    matrix, shift = affine_maps(spot, star)
    assert matrix[0] == pytest.approx(np.array([[0.5, 0.0], [0.0, -0.5]]))
    assert shift[0] == pytest.approx([1.0, 2.0])


def test_more_vertices_are_fitted_by_least_squares():
    spot = np.array([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]])
    star = np.array([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (2.0, 1.0)]])  # x = 3/2 u + 1/2 v - 1/4 at best
    matrix, shift = affine_maps(spot, star)
    assert matrix[0] == pytest.approx(np.array([[1.5, 0.5], [0.0, 1.0]]), abs=1e-12)
    assert shift[0] == pytest.approx([-0.25, 0.0], abs=1e-12)


def test_the_longest_run_is_close_along_both_axes_for_every_pair():
    places = np.array(
        [
            (0.00, 0.00),
            (0.04, 5.00),  # close along x only
            (0.05, 0.05),
            (0.03, 0.02),
            (0.06, 0.01),  # 0.06 from the first
            (3.00, 3.00),
            (3.01, 3.01),
            (0.01, 0.09),  # 0.04 from one of the run along y, 0.09 from another
        ]
    )
    assert longest_run(places, 0.05).tolist() == [0, 2, 3]
    assert longest_run(places, 0.06).tolist() == [0, 2, 3, 4]
    assert longest_run(places, 0.001).tolist() == [0]
    assert longest_run(np.zeros((0, 2)), 0.05).tolist() == []


def test_the_mean_of_the_run_and_not_its_median_is_the_answer():
    pose, moved = (0.55, 0.45, 0.4), np.zeros((6, 2))
    moved[4] = 0.3, -0.2  # one centre is off: the maps of its triangles differ
    settings = PublishedSettings(angle_limit_deg=0.5, closeness_m=0.05)
    spot_px = seen_from(*pose) + moved
    fix = tracker(settings).solve(spots_at(spot_px))
    triangles, _ = triangles_of(spot_px)
    places, turns = [], []
    for triangle in triangles:  # the true star of each: the solve must have found them all
        design = np.column_stack([spot_px[triangle], np.ones(3)])
        map_x, map_y = (np.linalg.solve(design, STARS_M[triangle, k]) for k in (0, 1))
        places.append(([320.0, 240.0, 1.0] @ map_x, [320.0, 240.0, 1.0] @ map_y))
        turn = complex(map_x[0] + map_y[1], map_y[0] - map_x[1])
        turns.append(turn / abs(turn))
    assert isinstance(fix, PictureFix)
    assert fix.mode is Mode.PUBLISHED
    assert (fix.x_m, fix.y_m) == pytest.approx(np.mean(places, axis=0), abs=1e-9)
    assert fix.heading_rad == pytest.approx(np.angle(np.sum(turns)), abs=1e-9)
    median = tracker(settings.model_copy(update={"takes_median": True})).solve(spots_at(spot_px))
    assert (median.x_m, median.y_m) == pytest.approx(np.median(places, axis=0), abs=1e-9)
    assert abs(median.x_m - fix.x_m) > 1e-5


def test_the_mount_carries_the_centre_of_the_picture_to_the_body():
    offset = (0.03, -0.02)
    camera = replace(CAMERA, mount_offset_body_m=(*offset, 0.0), mount_yaw_rad=0.3)
    x_m, y_m, heading = 0.5, 0.4, 1.1
    c, s = np.cos(heading), np.sin(heading)
    lens = (x_m + c * offset[0] - s * offset[1], y_m + s * offset[0] + c * offset[1])
    solver = PublishedTracker(StarCatalogue.from_positions(STARS_M), camera, EXACT)
    fix = solver.solve(spots_at(seen_from(*lens, heading + 0.3)))
    assert (fix.x_m, fix.y_m, fix.heading_rad) == pytest.approx((x_m, y_m, heading), abs=1e-9)


def test_both_angles_must_differ_by_less_than_the_limit():
    seen = np.deg2rad([(30.0, 90.0), (41.0, 80.0)])
    known = np.deg2rad([(31.1, 90.0), (30.0, 88.9), (31.3, 90.0), (30.0, 91.3), (31.1, 91.1)])
    pairs = alike(seen, known, np.deg2rad(1.2))
    assert [each.tolist() for each in pairs] == [[0, 0, 0], [0, 1, 4]]
    assert len(alike(np.array([(0.5, 1.0)]), np.array([(0.75, 1.0)]), 0.25)[0]) == 0  # at the limit: no


def test_two_close_places_are_needed_and_are_enough():
    two = STARS_M[[0, 1, 2, 3]]  # four stars: two triangles
    assert tracker(stars_m=two).triangles == 2
    fix = tracker(stars_m=two).solve(spots_at(seen_from(0.2, 0.3, -2.0, two)))
    assert (fix.x_m, fix.y_m, fix.heading_rad) == pytest.approx((0.2, 0.3, -2.0), abs=1e-9)
    refused = tracker(stars_m=two).solve(spots_at(seen_from(0.2, 0.3, -2.0, two[[0, 1, 2]])))
    assert isinstance(refused, NoFix)
    assert (refused.reason, refused.detail) == (
        Refusal.NO_CONSENSUS,
        "No two of 1 places are close to each other.",
    )


@pytest.mark.parametrize("points", [np.zeros((0, 2)), np.eye(2), np.array([(0, 0), (1, 1), (2, 2.0)])])
def test_spots_without_a_triangle_are_too_few(points):
    refused = tracker().solve(spots_at(100.0 * points))
    assert refused.reason is Refusal.TOO_FEW_STARS


def test_a_catalogue_without_a_triangle_is_refused():
    with pytest.raises(ValueError, match="three stars off one line"):
        tracker(stars_m=np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]))


def test_the_tree_finds_what_the_scan_finds():
    rng = np.random.default_rng(3)
    stars = rng.uniform(-2.0, 2.0, (60, 2))
    settings = PublishedSettings(angle_limit_deg=4.0)
    for pose in rng.uniform(-0.5, 0.5, (5, 3)):
        inside = np.linalg.norm(stars - pose[:2], axis=1) < 1.1
        spots = spots_at(seen_from(*pose, stars[inside]) + rng.normal(0.0, 0.3, (inside.sum(), 2)))
        one = tracker(settings, stars).solve(spots)
        other = tracker(settings.model_copy(update={"uses_tree": True}), stars).solve(spots)
        assert (one.x_m, one.y_m, one.heading_rad) == (other.x_m, other.y_m, other.heading_rad)


def test_mirrored_and_stretched_maps_count_unless_only_similar_ones_shall():
    maps = np.array([[[1.0, 0.0], [0.0, -1.0]], [[1.0, 0.0], [0.0, 1.2]], [[0.0, -2.0], [2.0, 0.0]]])
    assert is_similarity(maps).tolist() == [False, False, True]
    mirrored = spots_at(seen_from(0.5, 0.4, 0.0) * (1.0, -1.0) + (0.0, 480.0))
    fix = tracker().solve(mirrored)
    assert (fix.x_m, fix.y_m) == pytest.approx((0.5, 0.4), abs=1e-9)
    assert isinstance(tracker(EXACT.model_copy(update={"only_similar": True})).solve(mirrored), NoFix)


@pytest.mark.parametrize("changes", [{"angle_limit_deg": 0.0}, {"closeness_m": float("inf")}])
def test_limits_that_are_none_are_refused(changes):
    with pytest.raises(ValueError, match=next(iter(changes))):
        PublishedSettings(**changes)
