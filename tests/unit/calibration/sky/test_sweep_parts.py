"""Surveys of sweeps with gaps, strangers and wrong anchors."""

import dataclasses

import numpy as np
import pytest

from calibration.sky.survey.surveyed_sky import LENS, Anchor, SurveyError, survey
from groundstation.star_tracking.detection import Spots


def spots_at(uv, sigma_px=0.03):
    n = len(uv)
    covariance = np.tile([sigma_px**2, 0.0, sigma_px**2], (n, 1))
    return Spots(
        uv[:, 0], uv[:, 1], np.linspace(900, 300, n), covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0
    )


def look(painter, rng, pose, stars=None):
    """Spots of one picture and the star that each is."""
    painter = painter if stars is None else dataclasses.replace(painter, stars_m=stars)
    seen = rng.permutation(painter.visible(pose))
    return spots_at(painter.project(*pose)[seen] + rng.normal(0.0, 0.03, (len(seen), 2))), seen


def lawn(rng, x_m, y_m):
    poses, heading = [], 0.3
    for line, y in enumerate(y_m):
        for x in x_m if line % 2 == 0 else x_m[::-1]:
            heading += 0.15
            poses.append((x + rng.normal(0, 0.02), y + rng.normal(0, 0.02), heading))
    return np.array(poses)


def anchor(painter, pictures, names, frame, name):
    spots = pictures[frame]
    spot = int(np.hypot(spots.u_px - 320, spots.v_px - 240).argmin())
    x, y = painter.stars_m[int(names[frame][spot])]
    return Anchor(name, x, y, frame, spots.u_px[spot] + 1.5, spots.v_px[spot] - 1.0)


@pytest.fixture(scope="module")
def torn(painter):
    """A sweep of two stretches that see nothing in common: a wide ceiling, its middle left out."""
    rng = np.random.default_rng(51)
    wide = np.concatenate((painter.stars_m, painter.stars_m[:, ::-1] * [0.9, 1.1] + [7.0, 0.0]))
    painter = dataclasses.replace(painter, stars_m=wide, flux_e=np.ones(len(wide)))
    poses = np.concatenate(
        (
            lawn(rng, np.linspace(8.2, 9.6, 4), (1.5, 2.4)),
            lawn(rng, np.linspace(0.9, 4.0, 8), (0.9, 1.7, 2.4, 3.1)),
        )
    )
    seen = [look(painter, rng, pose) for pose in poses]
    return painter, [s for s, _ in seen], [n for _, n in seen]


def test_the_part_that_holds_the_anchors_is_surveyed_whichever_came_first(torn, camera):
    painter, pictures, names = torn
    for frames, size in (((12, 25, 36), 32), ((1, 6), 8), ((1, 12, 30), 32)):
        chosen = [anchor(painter, pictures, names, frame, f"a{frame}") for frame in frames]
        sky = survey(pictures, chosen, camera)
        assert len(sky.placed) == size
        assert sorted(sky.part_sizes) == [8, 32]
        assert set(sky.anchors) == {f"a{f}" for f in frames if (f < 8) == (size == 8)}
        distance = np.abs((sky.star_m @ [1, 1j])[:, None] - painter.stars_m @ [1, 1j]).min(axis=1)
        assert distance.max() < 5e-3  # no tape error here, and no star that is none


def test_anchors_in_two_parts_fix_neither(torn, camera):
    painter, pictures, names = torn
    across = [anchor(painter, pictures, names, frame, f"a{frame}") for frame in (2, 20)]
    with pytest.raises(SurveyError, match="parts of 32, 8, and none of them holds two anchors"):
        survey(pictures, across, camera)


def test_pictures_of_another_ceiling_add_no_stars(painter, camera):
    rng = np.random.default_rng(52)
    other = painter.stars_m[:, ::-1] * [1.2, 0.8]
    poses = lawn(rng, np.linspace(0.9, 4.0, 8), (0.9, 1.7, 2.4, 3.1))
    seen = [look(painter, rng, pose, other if i % 6 == 5 else None) for i, pose in enumerate(poses)]
    pictures, names = [s for s, _ in seen], [n for _, n in seen]
    sky = survey(
        pictures, [anchor(painter, pictures, names, frame, f"a{frame}") for frame in (3, 14, 27)], camera
    )
    assert not {int(i) for i in sky.placed if i % 6 == 5}
    distance = np.abs((sky.star_m @ [1, 1j])[:, None] - painter.stars_m @ [1, 1j]).min(axis=1)
    assert distance.max() < 5e-3


def test_an_anchor_measured_wrong_is_named_before_anything_is_adjusted(painter, camera):
    rng = np.random.default_rng(53)
    poses = lawn(rng, np.linspace(0.9, 4.0, 8), (0.9, 1.7, 2.4, 3.1))
    seen = [look(painter, rng, pose) for pose in poses]
    pictures, names = [s for s, _ in seen], [n for _, n in seen]
    good = [anchor(painter, pictures, names, frame, f"a{frame}") for frame in (3, 12, 20, 28)]
    wrong = [dataclasses.replace(good[0], x_m=good[0].x_m + 0.3), *good[1:]]
    with pytest.raises(SurveyError, match=r"anchor 'a3' lies 0\.[23]\d* m"):
        survey(pictures, wrong, camera)
    in_mm = [dataclasses.replace(one, x_m=1e3 * one.x_m, y_m=1e3 * one.y_m) for one in good]
    with pytest.raises(SurveyError, match="not metre"):
        survey(pictures, in_mm, camera)


def test_a_wrong_tilt_of_the_mount_is_found_with_the_lens(painter, camera):
    rng = np.random.default_rng(54)
    poses = lawn(rng, np.linspace(0.9, 4.0, 8), (0.9, 1.7, 2.4, 3.1))
    seen = [look(painter, rng, pose) for pose in poses]
    pictures, names = [s for s, _ in seen], [n for _, n in seen]
    chosen = [anchor(painter, pictures, names, frame, f"a{frame}") for frame in (3, 14, 27)]
    wrong = dataclasses.replace(
        camera, mount_tilt_x_rad=camera.mount_tilt_x_rad + 0.005, distortion=(-0.07, 0.05, 0.0, 0.0, 0.0)
    )
    sky = survey(pictures, chosen, wrong, free=LENS)
    assert sky.adjusted.rms_px < 0.035  # the spots' own 0.03
    assert sky.camera.mount_tilt_x_rad == pytest.approx(camera.mount_tilt_x_rad, abs=1e-3)
    assert sky.camera.distortion[0] == pytest.approx(camera.distortion[0], abs=2e-3)
