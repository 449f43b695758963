"""The calibrations as functions: progress is told, figures are drawn, wrong lenses are noticed."""

import dataclasses
import tomllib
from datetime import UTC, datetime

import numpy as np
import pytest

from calibration.outcome import CalibrationRefusedError
from calibration.result import Provenance
from calibration.sky.board import Board
from calibration.sky.delay import delay_from_headings
from calibration.sky.lens import lens_from_board, lens_from_stars, mount_from_turn
from calibration.sky.residual_structure import find_structure
from calibration.sky.survey.surveyed_sky import Anchor
from calibration.sky.survey.sweep import survey_sweep
from calibration.sky.survey.verification import verify
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.stamp_delay import read_delay

FROM = Provenance("a test", "0" * 64, datetime(2030, 1, 1, tzinfo=UTC))
SIGMA_PX = 0.03


def picture(painter, rng, pose):
    seen = rng.permutation(painter.visible(pose))
    uv = painter.project(*pose)[seen] + rng.normal(0.0, SIGMA_PX, (len(seen), 2))
    n = len(uv)
    covariance = np.tile([SIGMA_PX**2, 0.0, SIGMA_PX**2], (n, 1))
    spots = Spots(
        uv[:, 0], uv[:, 1], np.linspace(9, 3, n), covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0
    )
    return spots, seen


@pytest.fixture(scope="module")
def sweep(painter):
    """Pictures of three lines, and two anchors."""
    rng = np.random.default_rng(71)
    pictures, anchors = [], []
    for line, y in enumerate((1.3, 1.9, 2.5)):
        for x in np.linspace(1.2, 3.8, 7)[:: 1 if line % 2 == 0 else -1]:
            spots, seen = picture(painter, rng, (x, y, 0.3 * len(pictures)))
            if len(pictures) in (1, 19):
                middle = int(np.argmin(np.hypot(spots.u_px - 320, spots.v_px - 240)))
                at = painter.stars_m[seen[middle]]
                click = (spots.u_px[middle] + 1.0, spots.v_px[middle])
                anchors.append(Anchor(f"a{len(pictures)}", *at, len(pictures), *click))
            pictures.append(spots)
    return pictures, anchors, [f"{i:05d}" for i in range(len(pictures))]


@pytest.fixture(scope="module")
def surveyed(sweep, camera):
    """The survey of that sweep, and what it told meanwhile."""
    told = []
    found = survey_sweep(
        *sweep[:2], camera, sweep[2], progress=lambda what, share: told.append((what, share))
    )
    return found, told


@pytest.fixture
def told():
    return []


@pytest.fixture
def progress(told):
    return lambda what, share: told.append((what, share))


def test_a_survey_says_how_other_pictures_fit_and_draws_itself(surveyed, camera):
    found, told = surveyed
    assert found.outcome.warnings == ()
    check = found.verification
    assert (check.pictures, check.solved) == (3, 3)
    noise_m = SIGMA_PX * camera.ceiling_height_above_camera_m / camera.fx
    assert 0.8 * noise_m < check.rms_m < 2.0 * noise_m
    assert check.worst_star in found.sky.ids
    assert check.matched_ratio > 0.95  # a star that hangs at the border of the sweep may be in no list
    assert check.clipped == 0
    assert any("adjusting, step" in what for what, _ in told)
    assert len(found.outcome.draw().axes) == 5  # four and the scale of the colours
    written = tomllib.loads(found.outcome.to_toml(FROM))
    assert written["residual"]["verification_rms"]["value"] == pytest.approx(check.rms_m, rel=1e-6)
    assert written["pictures_held_out"] == 3
    assert found.catalogue_csv().count("\n") == len(found.sky.ids) + 1


def test_pictures_held_out_take_no_part_in_the_list_that_they_verify(sweep, surveyed, camera):
    pictures, anchors, names = sweep
    spoilt = list(pictures)
    off_px = np.random.default_rng(74).normal(0.0, 0.3, (3, 200))
    for number, off in zip((5, 11, 17), off_px, strict=True):  # every sixth picture is held out
        u_px = spoilt[number].u_px + off[: len(spoilt[number])]
        spoilt[number] = dataclasses.replace(spoilt[number], u_px=u_px)
    wrong = survey_sweep(spoilt, anchors, camera, names).verification
    assert wrong.rms_m > 3.0 * surveyed[0].verification.rms_m


def test_spots_that_the_poses_leave_out_are_counted(sweep, surveyed):
    spoilt = []
    for spots in (sweep[0][5], sweep[0][11], sweep[0][17]):
        u_px = spots.u_px.copy()
        u_px[::4] += 3.0  # 11 mm on the ceiling
        spoilt.append(dataclasses.replace(spots, u_px=u_px))
    check = verify(surveyed[0].sky, spoilt)
    assert check.solved == 3
    assert check.rms_m < 3e-4  # which flatters
    assert check.clipped_ratio == pytest.approx(0.25, abs=0.05)
    assert check.matched_ratio == pytest.approx(0.75, abs=0.05)


def test_a_picture_that_contradicts_itself_does_not_end_the_survey(sweep, camera):
    pictures, anchors, names = sweep
    spoilt = list(pictures)
    u_px = spoilt[5].u_px.copy()
    u_px[::2] += 1.5
    spoilt[5] = dataclasses.replace(spoilt[5], u_px=u_px)
    found = survey_sweep(spoilt, anchors, camera, names, verify_every=0)
    assert found.sky.adjusted.rms_px < 2.0 * SIGMA_PX


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"distortion": (-0.08, 0.05, 0.0008, -0.0007, 0.0)}, id="k1"),
        pytest.param({"mount_tilt_x_rad": 0.004 + 0.005}, id="tilt", marks=pytest.mark.slow),
        pytest.param({"fy": 600.5 * 1.01}, id="fy", marks=pytest.mark.slow),
    ],
)
def test_a_survey_with_a_wrong_lens_says_so(sweep, camera, change):
    wrong = dataclasses.replace(camera, **change)
    (warning,) = survey_sweep(*sweep[:2], wrong, sweep[2], verify_every=0).outcome.warnings
    assert "--lens" in warning
    assert "\n" not in warning


@pytest.mark.slow
def test_a_wrong_lens_is_cured_by_freeing_it(sweep, camera):
    wrong = dataclasses.replace(camera, distortion=(-0.08, 0.05, 0.0008, -0.0007, 0.0), cx=318.5)
    freed = survey_sweep(*sweep[:2], wrong, sweep[2], verify_every=0, is_lens_free=True)
    assert freed.outcome.warnings == ()
    assert freed.verification is None
    assert {"k1", "cx", "fy", "mount_tilt_x_rad"} <= set(freed.outcome.quantities)


def test_structure_is_told_from_noise():
    rng = np.random.default_rng(72)
    pixel = rng.uniform(0, (640, 480), (2000, 2))
    noise = rng.normal(0.0, 0.05, (2000, 2))
    chances = [find_structure(pixel, rng.normal(0, 0.05, (2000, 2)), 640, 480).chance for _ in range(40)]
    assert 0.2 < np.mean(chances) < 0.8
    assert not find_structure(pixel, noise, 640, 480).is_wrong
    outward = (pixel - (320, 240)) / 320
    found = find_structure(pixel, noise + 0.1 * outward * (outward**2).sum(axis=1, keepdims=True), 640, 480)
    assert found.is_wrong
    assert found.noise_px == pytest.approx(0.05, rel=0.2)
    slight = find_structure(pixel, noise + 0.01 * np.sign(outward), 640, 480)
    assert slight.chance < 1e-6
    assert not slight.is_wrong  # sure, but harmless


def test_lens_and_mount_come_with_a_camera_a_figure_and_their_provenance(
    painter, catalogue, camera, told, progress
):
    rng = np.random.default_rng(73)
    turn = [(2.45, 1.95, angle) for angle in np.linspace(0.4, 6.4, 8)]
    pictures = [picture(painter, rng, pose)[0] for pose in turn]
    lens = lens_from_stars(pictures, catalogue, camera, progress=progress)
    mount = mount_from_turn(pictures, catalogue, camera, wobble_m=5e-5, first_heading_rad=0.4)
    for found, name in ((lens, "k1"), (mount, "mount_offset_x_m")):
        assert found.warnings == ()
        assert found.camera is not None
        assert len(found.draw().axes) == 3
        assert tomllib.loads(found.to_toml(FROM))[name]["std"] > 0.0
    assert told
    with pytest.raises(CalibrationRefusedError, match="could be solved"):
        lens_from_stars(pictures[:2], catalogue, camera)


def test_what_gives_no_calibration_is_refused_in_one_sentence(camera):
    t, arrival = np.arange(0.0, 20.0, 0.01), np.arange(2.0, 18.0, 0.5)
    still = np.random.default_rng(1).normal(0.0, 1e-4, len(t))
    for rate, words in (
        (still, "changes too little|do not turn with the gyro"),
        (np.zeros(len(t)), "omega reads 0 in 100 %"),
    ):
        with pytest.raises(CalibrationRefusedError, match=words):
            delay_from_headings(t, rate, arrival, np.zeros(len(arrival)))
    grey = np.full((48, 64), 128, np.uint8)
    with pytest.raises(CalibrationRefusedError, match="seen in 0 pictures, 5 are needed"):
        lens_from_board([grey] * 3, Board(9, 6, 0.03))
    with pytest.raises(CalibrationRefusedError, match="picture 2 is 32 x 48 px"):
        lens_from_board([grey, grey[:, ::2]], Board(9, 6, 0.03))
    with pytest.raises(CalibrationRefusedError, match="there is no picture"):
        lens_from_board([], Board(9, 6, 0.03), camera=camera)


def test_the_delay_command_writes_what_the_rig_reads(tmp_path, groundstation):
    t = np.arange(0.0, 30.0, 0.01)
    rate = np.sin(0.9 * t)
    arrival = np.arange(3.0, 27.0, 0.25)
    heading = (1.0 - np.cos(0.9 * (arrival - 0.06))) / 0.9
    rows = [f"{a:.6f},{b:.9f}" for a, b in zip(t, rate, strict=True)]
    (tmp_path / "imu.csv").write_text("\n".join(["t_s,omega_rad_s", *rows]) + "\n")
    rows = [f"{a:.6f},{b:.9f}" for a, b in zip(arrival, heading, strict=True)]
    (tmp_path / "stars.csv").write_text("\n".join(["t_arrival_s,heading_rad", *rows]) + "\n")
    out, plot = tmp_path / "delay.toml", tmp_path / "delay.png"
    result = groundstation("star-tracker", "delay", tmp_path, "--out", out, "--plot", plot)
    assert "one sigma" in result.stdout
    assert read_delay(out).delay_s == pytest.approx(0.06, abs=6e-3)  # half a gyro window is part of it
    assert plot.read_bytes().startswith(b"\x89PNG")
