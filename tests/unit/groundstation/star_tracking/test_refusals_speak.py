"""A frame without a fix: the reason, the picture and the stars that it should show."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.request import Ack, Request
from groundstation.declarations.rig_file import RigFile
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.stars.messages import StarFix, StarImage, StarMatches, StarPicture, StarSpots
from groundstation.parts.stars.picture_check import PictureCheck
from groundstation.parts.stars.picture_keeper import PictureKeeper
from groundstation.parts.stars.spot_finder import SpotFinder
from groundstation.parts.stars.star_answers import notes_of
from groundstation.parts.stars.star_tracker import StarTracker
from groundstation.star_tracking.identifications import SkySettings
from groundstation.star_tracking.picture_drawing import draw_notes
from groundstation.star_tracking.picture_notes import NO_SPOT, SpotKind
from groundstation.star_tracking.tracker import TrackerSettings

PERIOD_NS = 1_000_000_000 // 15
DELAY = ExposureDelay(0.004, 1e-3)
DELAY_NS = 4_000_000
POSE = (2.4, 1.9, 0.7)


class Sky:
    """The four nodes of a vehicle's sky, fed by hand."""

    def __init__(self, folder, painter, exposure_s=0.01):
        camera, ceiling = folder / "camera.json", folder / "ceiling.csv"
        camera.write_text(json.dumps(painter.camera.to_mapping()))
        rows = [f"s{i},{x:.6f},{y:.6f}" for i, (x, y) in enumerate(painter.stars_m)]
        ceiling.write_text("\n".join(["id,x_m,y_m", *rows]) + "\n")
        settings = SkySettings(TrackerSettings(exposure_s=exposure_s))
        self.nodes = [
            PictureCheck("alpha"),
            SpotFinder("alpha", (painter.camera.width, painter.camera.height)),
            StarTracker(
                "alpha", *(RigFile(path, path.read_bytes()) for path in (camera, ceiling)), DELAY, settings
            ),
            PictureKeeper("alpha"),
        ]
        self.stamp_ns = 5_000_000_000

    def tell(self, message):
        """All that is said because of a message, by class."""
        reported, waiting = {}, [message]
        while waiting:
            received = waiting.pop(0)
            for node in self.nodes:
                if isinstance(received, node.inputs):
                    waiting += node.receive(received, received.stamp_ns)
            reported.setdefault(type(received), []).append(received)
        return reported

    def show(self, image):
        """All that is said of the next picture."""
        self.stamp_ns += PERIOD_NS
        height, width = image.shape
        return self.tell(StarImage(self.stamp_ns, "alpha", 0, height, width, "mono8", width, image.tobytes()))

    def believe(self, pose, velocity=(0.0, 0.0), rate_rad_s=0.0):
        """The filter's state at the exposure that comes next."""
        stamp_ns = self.stamp_ns + PERIOD_NS - DELAY_NS
        state = VehicleState(
            stamp_ns, "alpha", pose[:2], pose[2], velocity, rate_rad_s, (1e-3,) * 3, "flying", 0
        )
        self.tell(state)


@pytest.fixture
def sky(tmp_path, painter):
    return Sky(tmp_path, painter)


def reason_of(reported):
    (fix,) = reported[StarFix]
    assert fix.fix == (fix.reason == "")
    (image,) = reported[StarImage]
    assert fix.stamp_ns == image.stamp_ns - DELAY_NS  # the middle of the exposure, not the arrival
    assert fix.stamp_sigma_s == DELAY.delay_sigma_s
    return fix.reason.partition(":")[0]


def test_a_refused_picture_comes_without_loss_and_its_stars_lie_where_the_filter_believes(sky, painter):
    rng = np.random.default_rng(1)
    seen = painter.visible(POSE)
    lit = np.zeros(len(painter.stars_m), bool)
    lit[seen[:2]] = True  # of all the stars only two shine
    image = painter.paint(rng, POSE, lit=lit)
    sky.believe(POSE)
    reported = sky.show(image)
    assert reason_of(reported) == "too few stars"
    (picture,), (matches,) = reported[StarPicture], reported[StarMatches]
    assert picture.stamp_ns == matches.stamp_ns == sky.stamp_ns
    assert picture.format == "png"
    back = cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert (back == image).all()
    notes = notes_of(matches)
    assert notes.basis == "state"
    place = painter.project(*POSE)
    assert {f"s{i}" for i in seen} <= set(notes.stars)
    for name, at, spot in zip(notes.stars, notes.star_px, notes.spot_of_star, strict=True):
        star = int(name[1:])
        assert at == pytest.approx(place[star], abs=1e-3)
        assert (spot != NO_SPOT) == lit[star]
    assert notes.kind.tolist() == [SpotKind.STAR] * 2
    assert "too few stars" in matches.reason


def test_without_any_belief_the_lights_are_shown_and_no_star(sky):
    rng = np.random.default_rng(2)
    image = np.clip(rng.normal(10, 1, (480, 640)), 0, 255).astype(np.uint8)
    cv2.circle(image, (200, 100), 2, 200, -1)
    reported = sky.show(image)
    notes = notes_of(reported[StarMatches][0])
    assert (notes.basis, notes.stars, notes.kind.tolist()) == ("", (), [SpotKind.LIGHT])


def test_another_ceiling_is_no_ceiling_of_ours(sky, painter):
    rng = np.random.default_rng(3)
    other = rng.uniform((0, 0), (5, 4), (180, 2))
    lights = [(*uv, 3e4) for uv in painter.project(*POSE, other) if np.isfinite(uv).all()]
    image = painter.paint(rng, POSE, lit=np.zeros(len(painter.stars_m), bool), lights=lights)
    assert reason_of(sky.show(image)) in ("not our ceiling", "no consensus")


def test_streaks_are_called_blurred_with_and_without_a_known_motion(tmp_path, painter):
    rng = np.random.default_rng(4)
    sky = Sky(tmp_path, painter, exposure_s=0.1)
    velocity = (0.9, 0.5, 0.0)
    lit = np.zeros(len(painter.stars_m), bool)
    lit[painter.visible(POSE, margin_px=60)[:3]] = True
    streaks = painter.paint(rng, POSE, velocity=velocity, exposure_s=0.1, lit=lit)
    assert reason_of(sky.show(streaks)) == "too blurred"
    sky.believe(POSE, velocity[:2])
    too_thin = painter.paint(rng, POSE, lit=np.zeros(len(lit), bool))  # drawn out below the noise
    assert reason_of(sky.show(too_thin)) == "too blurred"
    sky.believe(POSE)
    assert reason_of(sky.show(too_thin)) == "no light spots"


def test_a_fix_is_shown_on_request_with_every_matched_star(sky, painter):
    images = [painter.paint(np.random.default_rng(seed), POSE) for seed in (5, 6, 7)]
    assert StarMatches not in sky.show(images[0])
    (ack,) = sky.tell(Request(sky.stamp_ns, "alpha", 7, "me", "picture", ""))[Ack]
    assert ack.accepted
    reported = sky.show(images[1])
    (fix,), (matches,) = reported[StarFix], reported[StarMatches]
    notes = notes_of(matches)
    assert notes.basis == "fix"
    assert int((notes.kind == SpotKind.STAR).sum()) == fix.stars
    seen = notes.spot_of_star != NO_SPOT
    assert int(seen.sum()) == fix.stars
    gap = np.hypot(*(notes.star_px[seen] - notes.spot_px[notes.spot_of_star[seen]]).T)
    assert gap.max() < 0.5
    assert StarPicture in reported
    assert StarMatches not in sky.show(images[2])


def test_a_picture_that_is_no_longer_held_is_not_said(sky, painter):
    keeper = PictureKeeper("alpha")
    dark = np.zeros((480, 640), np.uint8)
    reported = sky.show(dark)
    (image,), (matches,) = reported[StarImage], reported[StarMatches]
    assert list(keeper.receive(image, 0)) == []
    assert len(list(keeper.receive(matches, 0))) == 1
    late = StarImage(image.stamp_ns + 4_000_000_000, "alpha", 0, 480, 640, "mono8", 640, dark.tobytes())
    assert list(keeper.receive(late, 0)) == []
    assert list(keeper.receive(matches, 0)) == []


def test_the_drawing_rings_stars_green_and_crosses_missing_ones_red(sky, painter):
    lit = np.ones(len(painter.stars_m), bool)
    missing = painter.visible(POSE, margin_px=60)[0]
    lit[missing] = False
    image = painter.paint(np.random.default_rng(6), POSE, lit=lit)
    sky.tell(Request(sky.stamp_ns, "alpha", 8, "me", "picture", ""))
    notes = notes_of(sky.show(image)[StarMatches][0])
    drawn = draw_notes(image, notes, "a fix").astype(int)
    assert drawn.shape[0] > 2 * 480
    assert drawn.shape[1:] == (2 * 640, 3)
    u, v = (round(2 * value + 0.5) for value in painter.project(*POSE)[missing])
    _, green, red = drawn[v, u]
    assert red > 200 > green
    star = painter.visible(POSE, margin_px=60)[1]
    u, v = (round(2 * value + 0.5) for value in painter.project(*POSE)[star])
    ring = drawn[v, u - 13 : u - 8].max(axis=0)
    assert ring[1] > 180 > ring[2]


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (StarImage(1, "alpha", 0, 240, 320, "mono8", 320, bytes(240 * 320)), "320 x 240 px"),
        (StarImage(1, "alpha", 0, 480, 640, "mono8", 640, bytes(480 * 640 - 1)), "cut short"),
        (StarImage(1, "alpha", 0, 480, 640, "bgr8", 1920, bytes(3 * 480 * 640)), "bgr8"),
        (StarImage(1, "alpha", 0, 480, 640, "mono8", 640, bytes(480 * 640)), "no light spots"),
        (StarImage(1, "alpha", 0, 480, 640, "mono8", 640, b"\xff" * (480 * 640)), "flooded"),
    ],
    ids=["wrong size", "torn", "colour", "black", "saturated"],
)
def test_a_frame_that_cannot_be_used_is_refused_in_words(sky, image, words):
    (fix,) = sky.tell(image)[StarFix]
    assert not fix.fix
    assert words in fix.reason
    assert "\n" not in fix.reason


def test_a_picture_that_comes_again_is_no_fix_and_its_spots_are_none_either(sky, painter):
    image = painter.paint(np.random.default_rng(5), POSE)
    first = sky.show(image)
    assert first[StarFix][0].fix
    again = sky.show(image)
    (refused,) = again[StarFix]
    assert not refused.fix
    assert refused.reason == "frozen picture: it repeats the one of 0.07 s before byte for byte"
    (spots,) = first[StarSpots]
    repeated = sky.tell(replace(spots, stamp_ns=sky.stamp_ns + PERIOD_NS))
    (refused,) = repeated[StarFix]
    assert not refused.fix
    assert refused.reason.startswith("the spots repeat:")
    moved = replace(spots, stamp_ns=sky.stamp_ns + 2 * PERIOD_NS, u_px=spots.u_px + np.float32(1e-3))
    assert sky.tell(moved)[StarFix][0].fix
