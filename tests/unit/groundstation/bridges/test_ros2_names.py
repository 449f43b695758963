"""Names and hashes against what ROS 2's own generator and middleware print."""

import hashlib
import json
import re
import struct
from xml.etree import ElementTree

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from zenoh.ext import Int64, z_serialize

from groundstation.bridges import ros2_names
from groundstation.bridges.ros2_names import (
    QOS,
    RosTopic,
    attachment,
    dds_name,
    gid_of,
    node_token,
    publisher_token,
    type_hashes,
)
from groundstation.bridges.xxh3 import LONGEST, SHORTEST
from groundstation.bus.cdr import ros_fields
from groundstation.bus.ros_schema import _STANDARD, is_standard, schema_text
from groundstation.declarations.errors import UsageError
from groundstation.parts.control.messages import Wrench
from groundstation.parts.stars.messages import StarPicture
from groundstation.parts.table import installed_tables

KINDS = list(installed_tables().payloads.values())

# made by rosidl_generator_type_description: the `*__description.c` of micro-ROS for Kilted (hpm_sdk a52d08d);
# String and Image as rmw_zenoh announces them
PUBLISHED = {
    "builtin_interfaces/msg/Time": "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
    "std_msgs/msg/Header": "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "geometry_msgs/msg/Vector3": "cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d",
    "geometry_msgs/msg/Wrench": "018e8519d57c16adbe97c9fe1460ef21fec7e31bc541de3d653a35895677ce52",
    "geometry_msgs/msg/WrenchStamped": "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
    "sensor_msgs/msg/JointState": "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    "sensor_msgs/msg/CompressedImage": "15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
    "sensor_msgs/msg/Image": "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
}

# type_description_interfaces/msg/FieldType: of the single value; arrays add 48, sequences without bound 144
FIELD_TYPE = {
    "uint8": 3, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9, "float32": 10, "float64": 11,
    "bool": 15, "string": 17,
}  # fmt: skip


def described(name, text):
    """A type as ROS 2 describes it: REP 2016, from the text of its definition alone."""
    fields = []
    for line in text.splitlines():
        ros_type, field = line.split()
        base, bracket, rest = ros_type.partition("[")
        length = int(rest[:-1] or 0) if bracket else 0
        number = 1 if "/" in base else FIELD_TYPE[base]
        number += 48 if length else 144 if bracket else 0
        nested = base.replace("/", "/msg/") if "/" in base else ""
        fields.append(
            {
                "name": field,
                "type": {
                    "type_id": number, "capacity": length, "string_capacity": 0, "nested_type_name": nested,
                },
            }
        )  # fmt: skip
    return {"type_name": name, "fields": fields}


def rihs01(kind):
    """The hash by REP 2016, independent of the library that the bridge uses."""
    first, *others = re.split(r"=+\nMSG: (.*)\n", schema_text(kind))
    referred = [
        described(name.replace("/", "/msg/"), text)
        for name, text in sorted(zip(others[::2], others[1::2], strict=True))
    ]
    described_as = {
        "type_description": described(kind.ROS_TYPE, first), "referenced_type_descriptions": referred,
    }  # fmt: skip
    text = json.dumps(described_as, separators=(", ", ": "))
    return f"RIHS01_{hashlib.sha256(text.encode()).hexdigest()}"


@pytest.mark.parametrize(("name", "digest"), PUBLISHED.items())
def test_the_library_hashes_as_ros_2_does(name, digest):
    store = get_typestore(Stores.ROS2_JAZZY)
    assert store.hash_rihs01(name) == f"RIHS01_{digest}"


def test_standard_types_of_ours_have_the_hashes_of_ros_2():
    found = type_hashes([Wrench, StarPicture])
    assert found == {
        name: f"RIHS01_{PUBLISHED[name]}"
        for name in ("geometry_msgs/msg/WrenchStamped", "sensor_msgs/msg/CompressedImage")
    }


def test_every_type_of_ours_is_hashed_as_the_standard_has_it():
    hashes = type_hashes(KINDS)
    for kind in KINDS:
        assert hashes[kind.ROS_TYPE] == rihs01(kind), kind.ROS_TYPE


def test_names_of_fields_are_those_that_ros_2_allows():
    for kind in KINDS:
        for name, _ in ros_fields(kind) if not is_standard(kind) else ():
            assert re.fullmatch(r"[a-z]([a-z0-9]|_(?=[a-z0-9]))*", name), (kind, name)
    assert set(_STANDARD) >= {kind.ROS_TYPE for kind in KINDS if is_standard(kind)}


TOPIC = RosTopic("/chatter", dds_name("std_msgs/msg/String"), f"RIHS01_{PUBLISHED['std_msgs/msg/String']}")


def test_keys_are_those_of_the_design():
    """The example that implementations of rmw_zenoh's convention share: domain 0, /chatter, String."""
    assert TOPIC.key(0) == (
        "0/chatter/std_msgs::msg::dds_::String_/"
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )
    assert (
        TOPIC._replace(name="/alpha/state").key(7).startswith("7/alpha/state/std_msgs::msg::dds_::String_/")
    )


def test_tokens_have_thirteen_parts_and_none_is_empty():
    token = publisher_token(0, "aac3178e146ba6f1fc6e6a4085e77f21", "talker", 10, TOPIC)
    assert token.split("/") == [
        "@ros2_lv", "0", "aac3178e146ba6f1fc6e6a4085e77f21", "0", "10", "MP", "%", "%", "talker", "%chatter",
        "std_msgs::msg::dds_::String_", TOPIC.type_hash, QOS,
    ]  # fmt: skip
    assert node_token(0, "aac3", "talker").split("/") == [
        "@ros2_lv", "0", "aac3", "0", "0", "NN", "%", "%", "talker",
    ]  # fmt: skip


def test_every_token_of_ours_can_be_hashed():
    hashes = type_hashes(KINDS)
    for kind in KINDS:
        for name in (f"/a/{kind.TOPIC.noun}", f"/{'v' * 60}/{kind.TOPIC.noun}"):
            topic = RosTopic(name, dds_name(kind.ROS_TYPE), hashes[kind.ROS_TYPE])
            token = publisher_token(0, "f" * 32, "ground_station", 1, topic)
            assert SHORTEST <= len(token) <= LONGEST
            assert len(gid_of(token)) == ros2_names.GID_BYTES


def test_an_attachment_is_what_zenohs_own_serialiser_makes_of_it():
    gid = bytes(range(16))
    assert attachment(7, 1_700_000_000_123_456_789, gid) == bytes(
        z_serialize((Int64(7), Int64(1_700_000_000_123_456_789), gid))
    )
    assert struct.unpack("<qqB16s", attachment(1, -2, gid)) == (1, -2, 16, gid)


def test_the_package_for_ros_2_holds_every_type_of_ours_as_the_bridge_hashes_it(tmp_path, groundstation):
    shown = groundstation("parts", "--ros2-package", tmp_path)
    package = tmp_path / "air_table_msgs"
    assert shown.output.strip() == str(package)
    hashes = type_hashes(KINDS)
    files = {path.stem: path for path in (package / "msg").iterdir()}
    own = {kind.ROS_TYPE for kind in KINDS if kind.ROS_TYPE.startswith("air_table_msgs/")}
    assert {f"air_table_msgs/msg/{name}" for name in files} == own
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, path in files.items():
        store.register(get_types_from_msg(path.read_text(), f"air_table_msgs/msg/{name}"))
        assert store.hash_rihs01(f"air_table_msgs/msg/{name}") == hashes[f"air_table_msgs/msg/{name}"]
        assert f'"msg/{name}.msg"' in (package / "CMakeLists.txt").read_text()
    ElementTree.parse(package / "package.xml")
    with pytest.raises(UsageError, match="is there already"):
        groundstation("parts", "--ros2-package", tmp_path)
