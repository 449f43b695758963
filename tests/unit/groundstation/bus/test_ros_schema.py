"""The definition texts against rosbags' own copies of the ROS 2 packages."""

import pytest
from rosbags.typesys import Stores, get_typestore

from groundstation.bus.ros_schema import is_standard, message_text, register, schema_text
from groundstation.declarations.message import PACKAGE
from groundstation.parts.control.messages import Wrench
from groundstation.parts.stars.messages import StarFix, StarPicture
from groundstation.parts.table import installed_tables

CLASSES = list(installed_tables().payloads.values())


@pytest.mark.parametrize("cls", [StarPicture, Wrench])
@pytest.mark.parametrize("store", [Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY, Stores.LATEST])
def test_standard_types_are_worded_as_ros_words_them(cls, store):
    # ros_version: rosbags writes ROS 1 text by default
    expected, _ = get_typestore(store).generate_msgdef(cls.ROS_TYPE, ros_version=2)
    assert is_standard(cls)
    assert schema_text(cls) == expected


@pytest.fixture(scope="module")
def store():
    """A store of rosbags in which every class of ours is registered."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    register(store, CLASSES)
    return store


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
def test_generated_text_is_what_rosbags_makes_of_the_registered_type(store, cls):
    expected, _ = store.generate_msgdef(cls.ROS_TYPE, ros_version=2)
    assert schema_text(cls) == expected


def test_the_header_stands_first_and_carries_the_vehicle():
    assert message_text(StarFix).splitlines()[:3] == [
        "std_msgs/Header header",
        "bool fix",
        "float64 x_m",
    ]
    assert "string frame_id" in schema_text(StarFix)


def test_every_payload_class_has_a_type_name_of_its_own():
    names = [cls.ROS_TYPE for cls in CLASSES]
    own = [name for name in names if name.startswith(f"{PACKAGE}/")]  # ROS 2's own may serve several topics
    assert len(set(own)) > 20
    assert all(name.count("/msg/") == 1 for name in names)
    twice = {name for name in own if own.count(name) > 1}
    assert twice == {f"{PACKAGE}/msg/CameraImage"}  # of the star cameras and of the camera over the table


def test_classes_of_one_type_have_one_layout():
    texts = {}
    for cls in CLASSES:
        texts.setdefault(cls.ROS_TYPE, set()).add(message_text(cls))
    assert {name for name, found in texts.items() if len(found) > 1} == set()
