"""Nodes and rig keys of relative navigation: pictures in, poses and a leader's motion out; refusals."""

import math
from pathlib import Path

import numpy as np
import pytest

from drivers.star_camera.exposure import ExposureDelay
from firmware_emulator.side_view.scene import read_hulls, read_side_camera
from firmware_emulator.side_view.side_view import SideView, SunLamp
from groundstation.declarations.errors import RigError
from groundstation.declarations.rig_file import RigFile
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.relative_navigation.leader_filter import LeaderFilter
from groundstation.parts.relative_navigation.messages import LeaderState, RelativePose, SideImage
from groundstation.parts.relative_navigation.side_finder import SideFinder
from groundstation.relative_navigation.side_bodies import parse_side_bodies
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.rig.plan import make_node, nodes_of
from groundstation.rig.read import parse_rig

ROOT = Path(__file__).parents[5]
FILES = ROOT / "calibration" / "rigs" / "emulated"
RIG = ROOT / "examples" / "rigs" / "side_camera.toml"
BODIES = 'emulated/side_bodies.toml"\ndelay_s'
HERE, POSE = (0.0, 0.0, 0.0), (1.2, 0.1, 0.8)
MS = 1_000_000


@pytest.fixture
def finder():
    files = [
        RigFile(path, path.read_bytes()) for path in (FILES / "side_camera.json", FILES / "side_bodies.toml")
    ]
    bodies = {body.vehicle: body for body in files[1].value(parse_side_bodies)}

    def make(target="alpha", by="markers"):
        return SideFinder(
            "beta",
            files[0].value(SideCamera.parse),
            bodies[target],
            by,
            tuple(files),
            ExposureDelay(0.02, 0.001),
            (0.0005, 0.001),
        )

    return make


def image_of(pixels, stamp_ns=1000 * MS, encoding="mono8"):
    height, width = pixels.shape
    return SideImage(stamp_ns, "beta", 0, height, width, encoding, width, pixels.tobytes())


def drawn(number=1, lamp_deg=100.0, **poses):
    view = SideView(
        read_side_camera(FILES / "side_camera.json"),
        read_hulls(FILES / "side_bodies.toml"),
        SunLamp(math.radians(lamp_deg), 0.25),
        np.random.SeedSequence(1),
    )
    return view.render((HERE, HERE), {name: (pose, pose) for name, pose in poses.items()}, number)


def test_a_picture_becomes_distance_bearing_and_attitude_at_its_exposure(finder):
    (pose,) = finder().receive(image_of(drawn(alpha=POSE)), 0)
    assert pose.status == "solved"
    assert pose.stamp_ns == 980 * MS
    assert pose.range_m == pytest.approx(math.hypot(1.2, 0.1), abs=1e-3)
    assert pose.bearing_body_rad == pytest.approx(math.atan2(0.1, 1.2), abs=2e-3)
    assert pose.relative_heading_rad == pytest.approx(0.8, abs=5e-3)
    covariance = np.array(pose.covariance).reshape(3, 3)
    assert np.linalg.eigvalsh(covariance).min() > 0.0005**2 * 0.99  # the floor is in it


def test_a_lit_part_gives_no_heading_and_says_so(finder):
    (pose,) = finder("gamma", "lit_part").receive(image_of(drawn(gamma=POSE)), 0)
    assert pose.status == "solved"
    assert pose.range_m == pytest.approx(math.hypot(1.2, 0.1), abs=5e-3)
    assert math.isnan(pose.relative_heading_rad)
    assert pose.covariance[8] == math.inf


def test_what_is_not_seen_has_no_numbers_and_a_reason(finder):
    node = finder()
    dark = drawn()
    for picture, reason in (
        (image_of(dark), "no light spots"),
        (image_of(dark[:100]), "its file states 640 x 480"),
        (image_of(dark, encoding="bgr8"), "expected grey"),
    ):
        (pose,) = node.receive(picture, 0)
        assert pose.status == "lost"
        assert reason in pose.reason
        assert math.isnan(pose.range_m)
        assert all(map(math.isnan, pose.covariance))


def test_a_picture_that_comes_twice_is_no_sighting(finder):
    node, picture = finder(), drawn(alpha=POSE)
    (first,) = node.receive(image_of(picture), 0)
    (second,) = node.receive(image_of(picture, 1066 * MS), 0)
    assert first.status == "solved"
    assert second.status == "lost"
    assert second.reason.startswith("frozen picture")


def test_the_files_are_stated_at_the_start(finder):
    (found,) = finder().start(5)
    assert isinstance(found, CalibrationInUse)
    assert "side_camera.json" in found.name


def state(stamp_ns, x_m=0.0, speed_m_s=0.0, heading_rad=0.0):
    return VehicleState(
        stamp_ns, "beta", (x_m, 0.5), heading_rad, (speed_m_s, 0.0), 0.0, (1e-3,) * 3, "flying", 0
    )


def sighting(stamp_ns, x_m, turn_rad=0.3, status="solved"):
    covariance = tuple(np.diag((1e-6, 1e-6, 1e-5)).ravel().tolist())
    return RelativePose(
        stamp_ns, "beta", "alpha", status, x_m, 0.0, (x_m, 0.0), turn_rad, covariance, 1e-3, 6, 1.0, ""
    )


def test_sightings_and_the_own_state_become_the_leaders_motion():
    """The own mock-up drives at 0.1 m/s towards a leader that drives away at 0.04 m/s."""
    node, found = LeaderFilter("beta", "alpha"), []
    for step in range(200):
        t_s = 0.01 * step
        list(node.receive(state(step * 10 * MS, 0.1 * t_s, 0.1), 0))
        if step % 7 == 5:
            seen_s = t_s - 0.02
            found += node.receive(sighting(round(seen_s * 1e9), 1.5 + (0.04 - 0.1) * seen_s), 0)
    leader = found[-1]
    assert isinstance(leader, LeaderState)
    assert leader.position_table_m == pytest.approx((1.5 + 0.04 * leader.stamp_ns * 1e-9, 0.5), abs=1e-3)
    assert leader.velocity_table_m_s == pytest.approx((0.04, 0.0), abs=3e-3)
    assert leader.heading_rad == pytest.approx(0.3, abs=0.01)
    assert max(leader.apart_sigma) < 0.05


def test_a_jump_of_the_own_estimate_moves_the_leader_along_and_changes_no_distance():
    node = LeaderFilter("beta", "alpha")
    for step in range(100):
        list(node.receive(state(step * 10 * MS), 0))
        if step % 7 == 5:
            (leader,) = node.receive(sighting((step - 2) * 10 * MS, 1.5), 0)
    assert leader.position_table_m == pytest.approx((1.5, 0.5), abs=1e-3)
    for step in range(100, 110):
        list(node.receive(state(step * 10 * MS, 0.05), 0))  # a fix has moved it by 50 mm
    (leader,) = node.receive(sighting(1080 * MS, 1.5), 0)
    assert leader.position_table_m == pytest.approx((1.55, 0.5), abs=1e-3)


def test_it_is_silent_without_sightings_and_while_the_own_place_is_unknown():
    node = LeaderFilter("beta", "alpha")
    assert list(node.receive(sighting(0, 1.5), 0)) == []
    list(node.receive(state(10 * MS), 0))
    assert list(node.receive(sighting(5 * MS, math.nan, status="lost"), 0)) == []


def test_the_rig_of_the_example_has_the_nodes_where_they_belong():
    rig = parse_rig(RIG.read_text(), RIG)
    homes = {placed.key: placed.process for placed in nodes_of(rig)}
    assert homes["beta/side_finder"] == "beta_side"
    assert homes["beta/leader_filter"] == "beta_flight"
    assert "alpha/side_finder" not in homes
    assert LeaderState in make_node(rig, "beta/controller").inputs
    assert LeaderState not in make_node(rig, "alpha/controller").inputs


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('looks_for = "alpha"', 'looks_for = "gamma"', "'gamma' is no other vehicle"),
        ('looks_for = "alpha"', 'looks_for = "beta"', "'beta' is no other vehicle"),
        (BODIES, BODIES.replace("bodies.toml", "bodies_plain.toml"), "has no markers"),
        ('side_camera = { address', '# side_camera = { address', "no side_camera to know its leader by"),
        ('bearing = "free"', 'bearing = "leader", bearing_deg = 0.0', None),
    ],
)  # fmt: skip
def test_keys_that_do_not_fit_are_refused(old, new, said):
    text = RIG.read_text()
    assert text.count(old) == 1
    if said is None:  # markers tell how the leader is turned, the lit part does not
        text = text.replace('by = "markers"', 'by = "lit_part"')
        said = "does not tell how it is turned"
    with pytest.raises(RigError, match=said):
        parse_rig(text.replace(old, new), RIG)


def test_whom_the_controller_does_not_follow_is_no_leader():
    text = RIG.read_text()
    follows = text[text.index('controller = "follow"') : text.index("\n[laboratory]\n")]
    text = text.replace(follows, 'controller = "station"\n\n')
    with pytest.raises(RigError, match="looks for alpha, whom its controller does not follow"):
        parse_rig(text, RIG)
