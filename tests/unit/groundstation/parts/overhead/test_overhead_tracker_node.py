"""The node and the rig keys of the camera over the table."""

from pathlib import Path

import numpy as np
import pytest

from drivers.star_camera.exposure import ExposureDelay
from firmware_emulator.overhead.scene import read_markings, read_overhead_camera
from firmware_emulator.overhead.table_view import Body, Light, TableView
from groundstation.declarations.errors import RigError
from groundstation.declarations.rig_file import RigFile
from groundstation.parts.fusion.estimation import floors_of
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.overhead.messages import OverheadFix, OverheadImage
from groundstation.parts.overhead.overhead_tracker import OverheadTracker
from groundstation.rig.plan import make_node, nodes_of
from groundstation.rig.read import parse_rig

ROOT = Path(__file__).parents[5]
FILES = ROOT / "calibration" / "rigs" / "emulated"
RIG = ROOT / "examples" / "rigs" / "overhead.toml"
POSES = {"alpha": (-0.8, 0.1, 0.3), "beta": (0.9, 0.7, 2.0)}


DELAY = ExposureDelay(0.02, 0.001)
DELAY_NS = 20_000_000
ARRIVAL_NS = DELAY_NS + 7


def tracker_of(*vehicles):
    camera, circles = (FILES / name for name in ("overhead_camera.json", "circles.toml"))
    files = [RigFile(path, path.read_bytes()) for path in (camera, circles)]
    return OverheadTracker(vehicles, *files, DELAY)


def image_of(pixels, stamp_ns=ARRIVAL_NS, device_stamp_ns=0):
    height, width, _ = pixels.shape
    return OverheadImage(stamp_ns, "", device_stamp_ns, height, width, "bgr8", 3 * width, pixels.tobytes())


def test_each_mock_up_of_the_rig_gets_an_answer_to_each_picture():
    optics = read_overhead_camera(FILES / "overhead_camera.json")
    bodies = {name: Body(marks, 0.2) for name, marks in read_markings(FILES / "circles.toml").items()}
    view = TableView(optics, (-2.0, 2.0, -1.5, 1.5), bodies, Light(), np.random.SeedSequence(1))
    pixels = view.render({name: (pose, pose) for name, pose in POSES.items()}, 0, {"beta": 3})
    node = tracker_of("alpha", "beta")
    (calibration,) = node.start(0)
    assert isinstance(calibration, CalibrationInUse)
    alpha, beta = node.receive(image_of(pixels), 8)
    assert isinstance(alpha, OverheadFix)
    assert (alpha.stamp_ns, alpha.vehicle, alpha.fix, alpha.circles, alpha.reason) == (
        7,
        "alpha",
        True,
        3,
        "",
    )
    assert alpha.stamp_sigma_s == 0.001
    assert abs(alpha.x_m - POSES["alpha"][0]) < 0.001
    assert (beta.vehicle, beta.fix) == ("beta", False)
    assert "circle" in beta.reason
    fresh = pixels.copy()
    fresh[:, 0] ^= 1  # another picture, the same circles
    again = list(node.receive(image_of(fresh), 9))
    assert again[0].covariance == alpha.covariance  # each picture on its own
    frozen = list(node.receive(image_of(fresh, ARRIVAL_NS + 500_000_000), 10))
    assert [fix.fix for fix in frozen] == [False, False]
    frozen_word = "frozen picture: it repeats the one of 0.50 s before byte for byte"
    assert {fix.reason for fix in frozen} == {frozen_word}

    only = tracker_of("beta")
    assert [fix.vehicle for fix in only.receive(image_of(pixels), 8)] == ["beta"]


def test_the_exposure_lies_before_the_drivers_stamp_where_there_is_one():
    dark = np.zeros((48, 64, 3), np.uint8)
    (arrived,) = tracker_of("beta").receive(image_of(dark), 8)
    (stamped,) = tracker_of("beta").receive(image_of(dark, device_stamp_ns=ARRIVAL_NS - 5), 8)
    assert (arrived.stamp_ns, stamped.stamp_ns) == (7, 2)


def test_a_picture_of_another_camera_is_refused_for_each_mock_up():
    node = tracker_of("alpha", "beta")
    fixes = list(node.receive(image_of(np.zeros((48, 64, 3), np.uint8)), 8))
    assert [fix.fix for fix in fixes] == [False, False]
    assert "64 x 48 px" in fixes[0].reason


def test_a_node_of_the_rig_has_a_key_without_a_vehicle():
    rig = parse_rig(RIG.read_text(), RIG)
    row = rig.tables.nodes["overhead_tracker"]
    assert row.is_of_rig
    assert row.vehicles(rig) == [""]
    (placed,) = [placed for placed in nodes_of(rig) if placed.row is row]
    assert row.key("") == placed.key == "overhead_tracker"
    assert isinstance(make_node(rig, "overhead_tracker"), OverheadTracker)


def test_each_vehicle_takes_the_sources_that_the_rig_names_with_their_own_floors():
    rig = parse_rig(RIG.read_text(), RIG)
    assert floors_of(rig, "alpha") == {"stars": (0.0002, 0.0002), "overhead": (0.0002, 0.0003)}
    assert floors_of(rig, "beta") == {"overhead": (0.0002, 0.0003)}


SECTION = RIG.read_text()[RIG.read_text().index("[overhead_camera]") : RIG.read_text().index("[mock_ups")]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (SECTION, "", "vehicles.alpha: fix_sources 'overhead' needs an [overhead_camera] section"),
        ('["stars", "overhead"]', '["stars", "stars"]', "names a source twice"),
        (
            '["stars", "overhead"]',
            '["ceiling"]',
            "vehicles.alpha.fix_sources: 'ceiling' is no source of fixes (there are stars, overhead, ",
        ),
        ('star_camera = "laboratory:alpha/star_camera"\n', "", "'stars' needs 'star_camera' or 'fixes'"),
        (
            "delay_sigma_s = 0.001\nsigma_xy",
            "sigma_s = 0.1\nsigma_xy",
            "'overhead_camera.sigma_s' is no",
        ),
        ("sigma_heading_rad = 0.0003", "sigma_heading_rad = 0.0", "overhead_camera.sigma_heading_rad"),
        ('address = "laboratory:overhead_camera"\n', "", "'overhead_camera.address' is missing"),
        (
            "[vehicles.alpha]",
            '[mock_ups.standard.fusion]\nmethod = "reintegration"\n[vehicles.alpha]',
            "takes one source",
        ),
    ],
)
def test_a_wrong_rig_is_refused_by_its_key(old, new, sentence):
    text = RIG.read_text()
    assert old in text
    with pytest.raises(RigError) as caught:
        parse_rig(text.replace(old, new, 1), RIG)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_vehicle_that_wears_no_circles_is_refused(tmp_path):
    circles = tmp_path / "circles.toml"
    text = (FILES / "circles.toml").read_text()
    circles.write_text(text[: text.index("[beta]")])
    old = "[overhead_camera]\n"
    rig_text = RIG.read_text().replace(
        'circles = "../../calibration/rigs/emulated/circles.toml"', f'circles = "{circles}"', 1
    )
    assert old in rig_text
    with pytest.raises(RigError, match=r"overhead_camera.circles: .* has no table \[beta\]"):
        parse_rig(rig_text, RIG)
