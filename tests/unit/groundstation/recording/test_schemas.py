"""A recording is read by its own schemas: what today's classes need must be there, in whatever order."""

from dataclasses import fields, make_dataclass
from typing import Annotated, Any

import numpy as np
import pytest
from mcap.writer import Writer

from groundstation.bus.cdr import Codec, codec_of, ros_fields
from groundstation.bus.ros_schema import ENCODING, schema_text
from groundstation.declarations.message import Message
from groundstation.parts.control.messages import Wrench
from groundstation.parts.stars.messages import StarFix, StarSpots
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import METADATA_NAME, RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.schemas import decoder_of

FIX = StarFix(7, "alpha", True, 0.1, -0.2, 3.0, tuple(map(float, range(9))), 0.002, 12, "tracking", "")


def changed(kind, columns):
    """A class as another version of the program had it."""
    made = [(name, Annotated[Any, ros_type]) for name, ros_type in columns]
    return make_dataclass(
        "Other", made, bases=(Message,), frozen=True, eq=False, namespace={"ROS_TYPE": kind.ROS_TYPE}
    )


def as_other(payload, columns, **more):
    """The bytes and the schema of a payload in another version of its class."""
    other = changed(type(payload), columns)
    values = {name: more.get(name, getattr(payload, name, None)) for name, _ in columns}
    return Codec(other).encode(other(payload.stamp_ns, payload.vehicle, **values)), schema_text(other)


def same(one, other):
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name)) for field in fields(other)
    )


def test_todays_schema_is_read_by_todays_codec():
    decode = decoder_of(StarFix, schema_text(StarFix), "a.mcap: /alpha/star_fix")
    assert same(decode(codec_of(StarFix).encode(FIX)), FIX)


@pytest.mark.parametrize("lost", [name for name, _ in ros_fields(StarFix)])
def test_a_recording_without_a_field_of_today_is_refused_by_the_fields_name(lost):
    columns = [column for column in ros_fields(StarFix) if column[0] != lost]
    _, schema = as_other(FIX, columns)
    with pytest.raises(
        RecordingError, match=f"^a.mcap: /alpha/star_fix was recorded without the field '{lost}'$"
    ):
        decoder_of(StarFix, schema, "a.mcap: /alpha/star_fix")


@pytest.mark.parametrize("place", range(len(ros_fields(StarFix)) + 1))
def test_a_field_more_is_passed_over_wherever_it_stands(place):
    columns = ros_fields(StarFix)
    columns.insert(place, ("remark", "string"))
    data, schema = as_other(FIX, columns, remark="of yesterday")
    assert same(decoder_of(StarFix, schema, "x")(data), FIX)


def test_fields_in_another_order_are_taken_by_their_names():
    data, schema = as_other(FIX, ros_fields(StarFix)[::-1])
    found = decoder_of(StarFix, schema, "x")(data)
    assert type(found) is StarFix
    assert same(found, FIX)


def test_arrays_survive_another_order():
    some = np.arange(3, dtype=np.float32)
    kinds = {"float32[]": some, "string": "", "bool": False, "int64": 5, "uint16": 2, "float64": 1.5}
    spots = StarSpots(7, "alpha", *(kinds[ros_type] for _, ros_type in ros_fields(StarSpots)))
    data, schema = as_other(spots, ros_fields(StarSpots)[::-1])
    assert same(decoder_of(StarSpots, schema, "x")(data), spots)


def test_a_field_of_another_type_is_refused_with_both_types():
    columns = [(name, "uint32" if name == "stars" else kind) for name, kind in ros_fields(StarFix)]
    _, schema = as_other(FIX, columns)
    with pytest.raises(RecordingError, match="was recorded with stars as uint32, expected uint16"):
        decoder_of(StarFix, schema, "x")


def test_a_standard_type_under_another_definition_is_refused():
    with pytest.raises(RecordingError, match="x holds another type than geometry_msgs/msg/WrenchStamped"):
        decoder_of(Wrench, schema_text(StarFix), "x")


@pytest.mark.parametrize(
    "line",
    [
        "float64",
        "float64 9lives",
        "float64 class",
        "float32[x] u_px",
        "geometry_msgs/Pose pose",
        "float64 x_m",
    ],
    ids=["no name", "no identifier", "a keyword", "no length", "unknown type", "twice"],
)
def test_a_garbled_schema_is_refused_as_such(line):
    schema = schema_text(StarFix).replace("bool fix\n", f"bool fix\n{line}\n")
    with pytest.raises(RecordingError, match=r"^x has a schema that cannot be read"):
        decoder_of(StarFix, schema, "x")


def write(path, schema, data, metadata):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        writer.add_metadata(METADATA_NAME, metadata)
        number = writer.register_schema(StarFix.ROS_TYPE, ENCODING, schema.encode())
        channel = writer.register_channel("/alpha/star_fix", "cdr", number)
        writer.add_message(channel, 5, data, 5, 1)
        writer.finish()
    return path


def test_a_file_whose_schema_lacks_a_field_is_refused_with_file_channel_and_field(tmp_path):
    data, schema = as_other(FIX, [column for column in ros_fields(StarFix) if column[0] != "stars"])
    path = write(tmp_path / "old.mcap", schema, data, RecordingInfo().to_metadata())
    with Recording(path) as recording:
        with pytest.raises(RecordingError) as refused:
            list(recording.messages([StarFix]))
        assert str(refused.value) == f"{path}: /alpha/star_fix was recorded without the field 'stars'"
        assert list(recording.messages([Wrench])) == []  # what does not need it is read


def test_a_file_with_a_field_more_is_read(tmp_path):
    columns = [("remark", "string"), *ros_fields(StarFix)[::-1]]
    data, schema = as_other(FIX, columns, remark="a word")
    path = write(tmp_path / "new.mcap", schema, data, RecordingInfo().to_metadata())
    with Recording(path) as recording:
        (found,) = recording.delivered([StarFix])
    assert same(found.payload, FIX)


@pytest.mark.parametrize("is_todays", [True, False])
def test_a_damaged_message_is_refused_with_file_and_channel(tmp_path, is_todays):
    columns = ros_fields(StarFix)[:: 1 if is_todays else -1]
    data, schema = as_other(FIX, columns)
    path = write(tmp_path / "torn.mcap", schema, data[:-9], RecordingInfo().to_metadata())
    with Recording(path) as recording:
        (found,) = recording.messages([StarFix])
        with pytest.raises(RecordingError, match=r"torn\.mcap: /alpha/star_fix holds a damaged message"):
            _ = found.payload


@pytest.mark.parametrize(
    "metadata", [{"software": "groundstation 0.0.1"}, {"format": "1", "software": "old"}]
)
def test_a_recording_of_the_first_format_is_refused_in_a_sentence(tmp_path, metadata):
    path = write(tmp_path / "first.mcap", schema_text(StarFix), codec_of(StarFix).encode(FIX), metadata)
    with pytest.raises(RecordingError) as refused:
        Recording(path)
    assert str(refused.value) == (
        f"{path}: it is of recording format 1, this program reads format 2: "
        f"use the version that recorded it ({metadata['software']})"
    )


@pytest.mark.parametrize(
    ("reported", "sentence"),
    [("3", "recording format 3, this program reads format 2"), ("two", "metadata record")],
)
def test_a_recording_of_a_format_to_come_is_refused_in_a_sentence(tmp_path, reported, sentence):
    path = write(tmp_path / "x.mcap", schema_text(StarFix), b"", {"format": reported})
    with pytest.raises(RecordingError, match=sentence):
        Recording(path)
